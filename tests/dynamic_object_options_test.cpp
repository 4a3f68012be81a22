// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/dynamic_objects/dynamic_object_detector.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam {
namespace {

using Change = void (*)(DynamicObjectOptions&);

// The message of validate(); empty if the options are valid.
std::string complaint(Change change) {
  DynamicObjectOptions options;
  change(options);
  try {
    options.validate();
    return "";
  } catch (const OptionsError& error) {
    return error.what();
  }
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(DynamicObjectOptions, DefaultsAreValid) { EXPECT_NO_THROW(DynamicObjectOptions().validate()); }

TEST(DynamicObjectOptions, EachBadFieldIsNamed) {
  struct Bad {
    std::string field;
    std::vector<Change> changes;
  };
  const std::vector<Bad> all{
      {"label_every", {[](auto& o) { o.label_every = 0; }, [](auto& o) { o.label_every = 1001; }}},
      {"max_labelled_share",
       {[](auto& o) { o.max_labelled_share = 0.0; }, [](auto& o) { o.max_labelled_share = 1.1; },
        [](auto& o) { o.max_labelled_share = kNaN; }}},
      {"min_object_share",
       {[](auto& o) { o.min_object_share = -0.1; }, [](auto& o) { o.min_object_share = 1.0; },
        [](auto& o) { o.min_object_share = kNaN; }}},
      {"min_confidence",
       {[](auto& o) { o.min_confidence = -0.1; }, [](auto& o) { o.min_confidence = 1.1; },
        [](auto& o) { o.min_confidence = kNaN; }}},
      {"keep_missed",
       {[](auto& o) { o.keep_missed = -0.1; }, [](auto& o) { o.keep_missed = 61.0; },
        [](auto& o) { o.keep_missed = kNaN; }}},
      {"history_interval",
       {[](auto& o) { o.history_interval = 0.0; }, [](auto& o) { o.history_interval = 61.0; },
        [](auto& o) { o.history_interval = kNaN; }}},
      {"history",
       {[](auto& o) { o.history = 0.1; }, [](auto& o) { o.history = 41.0 * o.history_interval; },
        [](auto& o) { o.history = kNaN; }}},
      {"appearance_tolerance",
       {[](auto& o) { o.appearance_tolerance = -1.0; }, [](auto& o) { o.appearance_tolerance = 256.0; },
        [](auto& o) { o.appearance_tolerance = kNaN; }}},
      {"depth_tolerance",
       {[](auto& o) { o.depth_tolerance = -0.1; }, [](auto& o) { o.depth_tolerance = 1.0; },
        [](auto& o) { o.depth_tolerance = kNaN; }}},
      {"flow_interval",
       {[](auto& o) { o.flow_interval = 0.0; }, [](auto& o) { o.flow_interval = 1.1; },
        [](auto& o) { o.flow_interval = kNaN; }}},
      {"flow_tolerance",
       {[](auto& o) { o.flow_tolerance = 0.0; }, [](auto& o) { o.flow_tolerance = 101.0; },
        [](auto& o) { o.flow_tolerance = kNaN; }}},
      {"rest",
       {[](auto& o) { o.rest = 0.0; }, [](auto& o) { o.rest = 1001.0; }, [](auto& o) { o.rest = kNaN; }}},
      {"growth",
       {[](auto& o) { o.growth = -0.1; }, [](auto& o) { o.growth = 101.0; },
        [](auto& o) { o.growth = kNaN; }}},
      {"edge_band", {[](auto& o) { o.edge_band = -1; }, [](auto& o) { o.edge_band = 201; }}},
      {"margin", {[](auto& o) { o.margin = -1; }, [](auto& o) { o.margin = 201; }}},
      {"resting_weight",
       {[](auto& o) { o.resting_weight = -0.1; }, [](auto& o) { o.resting_weight = 1.1; },
        [](auto& o) { o.resting_weight = kNaN; }}},
      {"scarce_points", {[](auto& o) { o.scarce_points = -1; }}}};
  for (const auto& [field, changes] : all) {
    for (std::size_t i = 0; i < changes.size(); ++i) {
      const std::string text = complaint(changes[i]);
      EXPECT_EQ(text.rfind("dynamic_objects." + field + " must", 0), 0U) << field << ' ' << i << ": " << text;
    }
  }
}

TEST(DynamicObjectOptions, LimitsThemselvesAreValid) {
  EXPECT_EQ(complaint([](auto& o) {
              o.label_every = 1000;
              o.max_labelled_share = 1.0;
              o.min_object_share = o.min_confidence = o.keep_missed = o.depth_tolerance = o.growth = 0.0;
              o.history = o.history_interval;
              o.flow_interval = 1.0;
              o.edge_band = o.margin = o.scarce_points = 0;
            }),
            "");
}

TEST(DynamicObjectOptions, ModesAreNamedAndRecognised) {
  EXPECT_EQ(dynamic_modes().size(), 6U);
  for (const std::string& name : dynamic_modes()) {
    const auto options = options_of_mode(name);
    ASSERT_TRUE(options) << name;
    EXPECT_EQ(mode_of(*options), name);
    EXPECT_EQ(options->is_on(), name != "none");
  }
  const auto ds_slam = options_of_mode("ds-slam-like");
  EXPECT_TRUE(ds_slam->labels && ds_slam->flow && ds_slam->keep_resting);
  EXPECT_FALSE(ds_slam->depth_consistency || ds_slam->refine);
  const auto dynaslam = options_of_mode("dynaslam-like");
  EXPECT_TRUE(dynaslam->labels && dynaslam->depth_consistency);
  EXPECT_FALSE(dynaslam->flow || dynaslam->keep_resting);
  EXPECT_EQ(dynaslam->min_confidence, 0.0);
  EXPECT_EQ(dynaslam->scarce_points, 0);
  EXPECT_EQ(dynaslam->resting_weight, 0.0);
  // The switches alone do not select the mode that imitates another system.
  DynamicObjectOptions without_flow;
  without_flow.flow = false;
  EXPECT_EQ(mode_of(without_flow), "both");
  EXPECT_TRUE(options_of_mode("labels")->labels);
  EXPECT_FALSE(options_of_mode("labels")->depth_consistency || options_of_mode("labels")->flow);
  EXPECT_FALSE(options_of_mode("geometry")->labels);
  EXPECT_TRUE(options_of_mode("geometry")->depth_consistency && options_of_mode("geometry")->flow);
  EXPECT_FALSE(options_of_mode("magic"));
  EXPECT_FALSE(options_of_mode(""));
  EXPECT_FALSE(options_of_mode("Both"));
}

TEST(DynamicObjectOptions, AModeKeepsTheOtherSettings) {
  DynamicObjectOptions base;
  base.margin = 9;
  base.rest = 7.0;
  base.carry = base.refine = false;
  const auto options = options_of_mode("geometry", base);
  ASSERT_TRUE(options);
  EXPECT_EQ(options->margin, 9);
  EXPECT_EQ(options->rest, 7.0);
  EXPECT_FALSE(options->carry || options->refine);
}

TEST(DynamicObjectOptions, AreCheckedWhereTheyAreUsed) {
  DynamicObjectDetector::Settings settings;
  settings.dynamic_objects.margin = -1;
  EXPECT_THROW(DynamicObjectDetector(scene::small_camera(), settings), OptionsError);
}

}  // namespace
}  // namespace roslam
