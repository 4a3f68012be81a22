// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/options/options_fields.hpp"
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

// Converts to the type of any field.
struct AnyField {
  template <typename Field>
  operator Field() const;  // NOLINT: implicit, and never defined
};

template <typename Struct, std::size_t... kIndices>
constexpr bool takes_fields(std::index_sequence<kIndices...>) {
  return requires { Struct{(static_cast<void>(kIndices), AnyField{})...}; };
}

// How many fields a struct has, whether or not anything names them.
template <typename Struct, std::size_t kCount = 1>
constexpr std::size_t field_count() {
  static_assert(std::is_aggregate_v<Struct>);
  if constexpr (takes_fields<Struct>(std::make_index_sequence<kCount>())) {
    return field_count<Struct, kCount + 1>();
  } else {
    return kCount - 1;
  }
}

struct FieldCounter {
  struct Inner {
    int a = 0;
    int b = 0;
  };
  bool first = false;
  int second = 0;
  double third = 0.0;
  Inner fourth;
};
static_assert(field_count<FieldCounter>() == 4 && field_count<FieldCounter::Inner>() == 2);

// Fields that are no option of a configuration file.
constexpr std::size_t kUnlistedInpainting = 1;  // InpaintingOptions::classic: which method, set by programs

// How many options each section has that for_each_option must name.
std::map<std::string, std::size_t> fields_by_section() {
  // A section that is added to Options must be added here, too: it does not compile otherwise.
  const Options options;
  const auto& [orb, depth, stereo, noise, segmenter, dynamic_objects, matcher, pose, local_map, relocaliser,
               tracker, plausible, keyframes, landmarks, fusion, culling, bundle, loop, geometric_verifier,
               loop_closer, pose_graph, restoration, reprojection, inpainting, depth_completion, dense,
               threads] = options;
  const auto count = [](const auto& section) { return field_count<std::decay_t<decltype(section)>>(); };
  return {{"orb", count(orb)},
          {"depth", count(depth)},
          {"stereo", count(stereo)},
          {"noise", count(noise)},
          {"segmenter", count(segmenter)},
          {"dynamic_objects", count(dynamic_objects)},
          {"matcher", count(matcher)},
          {"pose", count(pose)},
          {"local_map", count(local_map)},
          {"relocaliser", count(relocaliser)},
          {"tracker", count(tracker)},
          {"plausible", count(plausible)},
          {"keyframes", count(keyframes)},
          {"landmarks", count(landmarks)},
          {"fusion", count(fusion)},
          {"culling", count(culling)},
          {"bundle", count(bundle)},
          {"loop", count(loop)},
          {"geometric_verifier", count(geometric_verifier)},
          {"loop_closer", count(loop_closer)},
          {"pose_graph", count(pose_graph)},
          {"restoration", count(restoration)},
          {"reprojection", count(reprojection)},
          {"inpainting", count(inpainting) - kUnlistedInpainting},
          {"depth_completion", count(depth_completion)},
          {"dense", count(dense)},
          {"threads", count(threads)}};
}

int option_count() {
  std::size_t sum = 0;
  for (const auto& [section, count] : fields_by_section()) sum += count;
  return static_cast<int>(sum);
}

// for_each_option names every field of every section, each once, under one name.
TEST(OptionsFields, AreAllNamed) {
  const Options options;
  std::map<std::string, std::size_t> named;
  std::set<const void*> fields;
  for_each_option(options, [&](const char* section, const char* key, const auto& field) {
    using Field = std::decay_t<decltype(field)>;
    static_assert(std::is_same_v<Field, bool> || std::is_same_v<Field, int> || std::is_same_v<Field, double>);
    ++named[section];
    EXPECT_TRUE(fields.insert(&field).second) << section << "." << key << " is a field that has another name";
  });
  EXPECT_EQ(named, fields_by_section());
  EXPECT_EQ(named.size(), field_count<Options>());
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
  EXPECT_EQ(fields, option_count());
  EXPECT_GE(differing, fields - 3);  // a few have room for no other value
}

// run.json of version 0.1.0.
TEST(OptionsJson, OldNamesAreStillRead) {
  const Options options = options_from_json(
      R"({"removal": {"labels": false, "free_space": false, "sure": 0.7}, "loop": {"patience": 5},
          "tracker": {"new_world_frames": 7}, "invention": {"max_crops": 2}, "restoration": {"invent": false}})");
  EXPECT_FALSE(options.dynamic_objects.labels);
  EXPECT_FALSE(options.dynamic_objects.depth_consistency);
  EXPECT_EQ(options.dynamic_objects.min_confidence, 0.7);
  EXPECT_EQ(options.loop.max_gap, 5);
  EXPECT_EQ(options.tracker.new_submap_after_lost, 7);
  EXPECT_EQ(options.inpainting.max_crops, 2);
  EXPECT_FALSE(options.restoration.inpaint);
}

TEST(OptionsJson, EveryFieldSurvivesWritingAndReading) {
  const Options options = altered();
  const Options again = options_from_json(options_to_json(options));
  std::vector<double> values;
  for_each_option(options, [&](const char*, const char*, const auto& field) { values.push_back(field); });
  int fields = 0;
  for_each_option(again, [&](const char* section, const char* key, const auto& field) {
    EXPECT_DOUBLE_EQ(static_cast<double>(field), values[static_cast<std::size_t>(fields++)])
        << section << "." << key;
  });
  EXPECT_EQ(fields, option_count());
  EXPECT_EQ(options_to_json(again), options_to_json(options));
  EXPECT_NE(options_to_json(options), options_to_json(Options{}));
}

TEST(OptionsJson, OtherVersionsAreReadAsFarAsKnown) {
  const Options options = options_from_json(R"({"orb": {"features": 500, "colour": "red"}, "later": 3})");
  EXPECT_EQ(options.orb.features, 500);
  EXPECT_EQ(options.orb.levels, OrbOptions().levels);
  for (const char* bad : {"", "{", "3", "[]", R"({"orb": 3})", R"({"orb": {"features": "many"}})",
                          R"({"orb": {"features": 3}})", R"({"orb": {"features": 500.5}})",
                          R"({"orb": {"features": 99999999999}})", R"({"orb": {"features": 1e300}})",
                          R"({"orb": {"scale_factor": null}})", R"({"dynamic_objects": {"labels": 1}})"}) {
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
  EXPECT_NE(refusal("removal:\n  labels: false\n").find("it is called 'dynamic_objects' now"),
            std::string::npos);
  EXPECT_NE(refusal("loop:\n  patience: 2\n").find("it is called 'loop.max_gap' now"), std::string::npos);
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
