// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <type_traits>

#include "roslam/error.hpp"
#include "roslam/pipeline/options_fields.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

class OptionsFile : public testing::Test {
 protected:
  void TearDown() override { fs::remove(file_); }

  Options read(const std::string& text) const {
    std::ofstream(file_) << text;
    return read_options(file_);
  }

  std::string refusal(const std::string& text) const {
    try {
      read(text);
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  }

  const fs::path file_ = scratch_path(".yaml");
};

bool accepts(const Options& options) {
  try {
    options.validate();
    return true;
  } catch (const OptionsError&) {
    return false;
  }
}

// Moves every field to a value it does not have by default, where its range allows.
Options altered() {
  Options options;
  for_each_option(options, [&](const char*, const char*, auto& field) {
    using Field = std::decay_t<decltype(field)>;
    const Field before = field;
    if constexpr (std::is_same_v<Field, bool>) {
      field = !before;
    } else if constexpr (std::is_same_v<Field, int>) {
      field = before + 1;
      if (!accepts(options)) field = before - 1;
    } else {
      field = before * 1.0123456789;
      if (!accepts(options)) field = before / 1.0123456789;
    }
    if (!accepts(options)) field = before;
  });
  return options;
}

TEST_F(OptionsFile, EveryFieldSurvivesWritingAndReading) {
  const Options options = altered();
  const Options default_options;
  int fields = 0;
  int differing = 0;
  std::vector<double> defaults;
  for_each_option(default_options,
                  [&](const char*, const char*, const auto& field) { defaults.push_back(field); });
  std::vector<double> values;
  for_each_option(options, [&](const char*, const char*, const auto& field) { values.push_back(field); });
  const Options again = read(options_to_yaml(options));
  for_each_option(again, [&](const char* section, const char* key, const auto& field) {
    const auto i = static_cast<std::size_t>(fields++);
    EXPECT_DOUBLE_EQ(static_cast<double>(field), values[i]) << section << "." << key;
    if (values[i] != defaults[i]) ++differing;
  });
  EXPECT_GE(fields, 50);
  EXPECT_GE(differing, fields - 3);  // a few have room for no other value
}

TEST(OptionsJson, EveryFieldSurvivesWritingAndReading) {
  const Options options = altered();
  EXPECT_EQ(options_to_json(options_from_json(options_to_json(options))), options_to_json(options));
  EXPECT_NE(options_to_json(options), options_to_json(Options{}));
}

TEST(OptionsJson, OtherVersionsAreReadAsFarAsKnown) {
  const Options options = options_from_json(R"({"orb": {"features": 500, "colour": "red"}, "later": 3})");
  EXPECT_EQ(options.orb.features, 500);
  EXPECT_EQ(options.orb.levels, OrbOptions().levels);
  for (const char* bad : {"", "{", "3", "[]", R"({"orb": 3})", R"({"orb": {"features": "many"}})",
                          R"({"orb": {"features": 3}})", R"({"orb": {"features": 500.5}})",
                          R"({"orb": {"features": 99999999999}})", R"({"orb": {"features": 1e300}})",
                          R"({"orb": {"scale_factor": null}})", R"({"removal": {"labels": 1}})"}) {
    EXPECT_THROW(options_from_json(bad), OptionsError) << bad;
  }
}

TEST_F(OptionsFile, NamesAreUnique) {
  std::set<std::string> names;
  int fields = 0;
  const Options options;
  for_each_option(options, [&](const char* section, const char* key, const auto&) {
    names.insert(std::string(section) + "." + key);
    ++fields;
  });
  EXPECT_EQ(names.size(), static_cast<std::size_t>(fields));
}

TEST_F(OptionsFile, WhatIsNotNamedKeepsItsDefault) {
  EXPECT_EQ(read("").orb.features, OrbOptions().features);
  EXPECT_EQ(read("# nothing\n").orb.features, OrbOptions().features);
  EXPECT_EQ(read("orb:\n").orb.features, OrbOptions().features);
  const Options options = read("orb:\n  features: 500\n");
  EXPECT_EQ(options.orb.features, 500);
  EXPECT_EQ(options.orb.levels, OrbOptions().levels);
}

TEST_F(OptionsFile, NoFieldAcceptsWhatIsNotANumber) {
  const Options options;
  for_each_option(options, [&](const char* section, const char* key, const auto& field) {
    const std::string name = std::string(section) + "." + key;
    const std::string before = std::string(section) + ":\n  " + key + ": ";
    for (const char* bad : {".nan", "many", "[1]", "{a: 1}", "1 2", "''"}) {
      const std::string message = refusal(before + bad + "\n");
      EXPECT_NE(message.find(file_.string()), std::string::npos) << name << " " << bad << ": " << message;
      EXPECT_NE(message.find(key), std::string::npos) << name << " " << bad << ": " << message;
    }
    if constexpr (std::is_same_v<std::decay_t<decltype(field)>, int>) {
      for (const char* bad : {"1.5", "99999999999", "-1000"}) {
        const std::string message = refusal(before + bad + "\n");
        EXPECT_NE(message.find(key), std::string::npos) << name << " " << bad << ": " << message;
      }
    } else {
      for (const char* bad : {"-1e9", ".inf", "-.inf"}) {
        const std::string message = refusal(before + bad + "\n");
        EXPECT_NE(message.find(key), std::string::npos) << name << " " << bad << ": " << message;
      }
    }
  });
}

TEST_F(OptionsFile, NamesUnknownAndRepeatedKeys) {
  EXPECT_NE(refusal("orb:\n  feature: 5\n").find("unknown key 'orb.feature'"), std::string::npos);
  EXPECT_NE(refusal("orbs:\n  features: 5\n").find("unknown section 'orbs'"), std::string::npos);
  EXPECT_NE(refusal("orb:\n  features: 500\n  features: 600\n").find("'orb.features' is given twice"),
            std::string::npos);
  EXPECT_NE(refusal("orb:\n  features: 500\norb:\n  levels: 4\n").find("'orb' is given twice"),
            std::string::npos);
  EXPECT_NE(refusal("orb: 5\n").find("'orb' must hold"), std::string::npos);
  EXPECT_NE(refusal("[orb]: 5\n").find("a key must be a word"), std::string::npos);
  EXPECT_NE(refusal("- orb\n").find("sections"), std::string::npos);
  EXPECT_NE(refusal("orb: [unclosed\n").find("not a valid YAML file"), std::string::npos);
  EXPECT_THROW(read_options("/no/such/file.yaml"), InputError);
  EXPECT_THROW(read_options(testing::TempDir()), InputError);
}

}  // namespace
}  // namespace roslam
