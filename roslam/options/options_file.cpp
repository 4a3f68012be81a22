// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/yaml_file.hpp"
#include "roslam/options/options_fields.hpp"

namespace roslam {

namespace {
using Keys = std::map<std::string, std::set<std::string>>;

Keys known_keys() {
  Keys keys;
  const Options options;
  for_each_option(options,
                  [&](const char* section, const char* key, const auto&) { keys[section].insert(key); });
  return keys;
}

// Options of version 0.1.0 that have another name now. An empty key stands for a whole section.
struct Renamed {
  std::string_view old_section, old_key, section, key;
};
constexpr std::array kRenamed{
    Renamed{"removal", "free_space", "dynamic_objects", "depth_consistency"},
    Renamed{"removal", "sure", "dynamic_objects", "min_confidence"},
    Renamed{"removal", "", "dynamic_objects", ""},
    Renamed{"invention", "", "inpainting", ""},
    Renamed{"place_check", "", "geometric_verifier", ""},
    Renamed{"restoration", "invent", "restoration", "inpaint"},
    Renamed{"tracker", "new_world_frames", "tracker", "new_submap_after_lost"},
    Renamed{"loop", "patience", "loop", "max_gap"},
};

// The old name of an option, if it had one: section and key.
std::optional<std::pair<std::string, std::string>> old_name_of(std::string_view section,
                                                               std::string_view key) {
  for (const Renamed& r : kRenamed) {
    if (r.section != section || (!r.key.empty() && r.key != key)) continue;
    return std::pair(std::string(r.old_section), std::string(r.key.empty() ? key : r.old_key));
  }
  return std::nullopt;
}

// What to write in place of an old name; empty if there never was such a name.
std::string hint_for(std::string_view section, std::string_view key) {
  for (const Renamed& r : kRenamed) {
    if (r.old_section != section || (!r.old_key.empty() && r.old_key != key)) continue;
    if (key.empty()) return " (it is called '" + std::string(r.section) + "' now)";
    return " (it is called '" + std::string(r.section) + "." + std::string(r.key.empty() ? key : r.key) +
           "' now)";
  }
  return "";
}

std::string joined(const auto& names, const auto& name_of) {
  std::string all;
  for (const auto& entry : names) all += (all.empty() ? "" : " ") + std::string(name_of(entry));
  return all;
}

std::string word_of(const std::filesystem::path& file, const YAML::Node& key) {
  if (!key.IsScalar()) throw OptionsError(file.string() + ": a key must be a word; write 'key: value' lines");
  return key.Scalar();
}

// YAML readers take one of two equal keys without a word.
void reject_repeated(const std::filesystem::path& file, std::set<std::string>& seen, const std::string& key) {
  if (!seen.insert(key).second)
    throw OptionsError(file.string() + ": '" + key + "' is given twice; remove one");
}

void reject_unknown_keys(const std::filesystem::path& file, const YAML::Node& root) {
  const Keys known = known_keys();
  std::set<std::string> seen;
  for (const auto& section : root) {
    const auto name = word_of(file, section.first);
    reject_repeated(file, seen, name);
    const auto found = known.find(name);
    if (found == known.end()) {
      throw OptionsError(file.string() + ": unknown section '" + name + "'" + hint_for(name, "") +
                         "; known: " + joined(known, [](const auto& entry) { return entry.first; }));
    }
    if (section.second.IsNull()) continue;
    if (!section.second.IsMap())
      throw OptionsError(file.string() + ": '" + name + "' must hold 'key: value' lines");
    for (const auto& entry : section.second) {
      const auto key = word_of(file, entry.first);
      reject_repeated(file, seen, name + "." + key);
      if (!found->second.contains(key)) {
        throw OptionsError(file.string() + ": unknown key '" + name + "." + key + "'" + hint_for(name, key) +
                           "; known: " + joined(found->second, [](const auto& k) { return k; }));
      }
    }
  }
}

// False if a JSON value is not of a field's type.
bool take(const nlohmann::json& value, bool& field) {
  if (value.is_boolean()) field = value.get<bool>();
  return value.is_boolean();
}

bool take(const nlohmann::json& value, double& field) {
  if (value.is_number()) field = value.get<double>();
  return value.is_number();
}

bool take(const nlohmann::json& value, int& field) {
  using Limits = std::numeric_limits<int>;
  const double number = value.is_number_integer() ? value.get<double>() : 2.0 * Limits::max();
  if (number < Limits::min() || number > Limits::max()) return false;
  field = static_cast<int>(number);
  return true;
}
}  // namespace

Options read_options(const std::filesystem::path& file) {
  const YAML::Node root =
      load_yaml(file, "cannot open the configuration file; roslam run --print-config shows one");
  Options options;
  if (root.IsNull()) return options;
  if (!root.IsMap())
    throw InputError(file.string() + ": a configuration file holds sections of 'key: value' lines");
  reject_unknown_keys(file, root);
  for_each_option(options, [&](const char* section, const char* key, auto& field) {
    if (!root[section] || !root[section].IsMap() || !root[section][key]) return;
    const std::string name = file.string() + ": '" + section + "." + key + "'";
    try {
      field = root[section][key].template as<std::decay_t<decltype(field)>>();
    } catch (const YAML::Exception&) {
      throw OptionsError(name + " has a value of the wrong type");
    }
    if (!std::isfinite(static_cast<double>(field))) throw OptionsError(name + " must be a finite number");
  });
  try {
    options.validate();
  } catch (const OptionsError& error) {
    throw OptionsError(file.string() + ": " + error.what());
  }
  return options;
}

std::string options_to_yaml(const Options& options) {
  YAML::Emitter out;
  out.SetDoublePrecision(12);
  std::string open;
  out << YAML::BeginMap;
  for_each_option(options, [&](const char* section, const char* key, const auto& field) {
    if (open != section) {
      if (!open.empty()) out << YAML::EndMap;
      out << YAML::Key << section << YAML::Value << YAML::BeginMap;
      open = section;
    }
    out << YAML::Key << key << YAML::Value << field;
  });
  out << YAML::EndMap << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string options_to_json(const Options& options) {
  nlohmann::ordered_json json;
  for_each_option(
      options, [&](const char* section, const char* key, const auto& field) { json[section][key] = field; });
  return json.dump();
}

Options options_from_json(const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) throw OptionsError("options are not a JSON object");
  Options options;
  const auto find = [&](const std::string& section, const std::string& key) -> const nlohmann::json* {
    const auto found = json.find(section);
    if (found == json.end()) return nullptr;
    if (!found->is_object()) throw OptionsError(section + " is no section of options");
    const auto value = found->find(key);
    return value == found->end() ? nullptr : &*value;
  };
  for_each_option(options, [&](const char* section, const char* key, auto& field) {
    const nlohmann::json* value = find(section, key);
    if (value == nullptr) {
      if (const auto old = old_name_of(section, key)) value = find(old->first, old->second);
    }
    if (value != nullptr && !take(*value, field))
      throw OptionsError(std::string(section) + "." + key + " has a value of the wrong type");
  });
  options.validate();
  return options;
}

}  // namespace roslam
