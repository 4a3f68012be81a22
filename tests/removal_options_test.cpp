// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "roslam/error.hpp"
#include "roslam/removal/dynamic_removal.hpp"
#include "tests/removal_scene.hpp"

namespace roslam {
namespace {

using Change = void (*)(RemovalOptions&);

// What validate() says; empty if it is content.
std::string complaint(Change change) {
  RemovalOptions options;
  change(options);
  try {
    options.validate();
    return "";
  } catch (const OptionsError& error) {
    return error.what();
  }
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(RemovalOptions, DefaultsAreValid) { EXPECT_NO_THROW(RemovalOptions().validate()); }

TEST(RemovalOptions, EachBadFieldIsNamed) {
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
      {"sure",
       {[](auto& o) { o.sure = -0.1; }, [](auto& o) { o.sure = 1.1; }, [](auto& o) { o.sure = kNaN; }}},
      {"keep_missed",
       {[](auto& o) { o.keep_missed = -0.1; }, [](auto& o) { o.keep_missed = 61.0; },
        [](auto& o) { o.keep_missed = kNaN; }}},
      {"history_interval",
       {[](auto& o) { o.history_interval = 0.0; }, [](auto& o) { o.history_interval = 61.0; },
        [](auto& o) { o.history_interval = kNaN; }}},
      {"history",
       {[](auto& o) { o.history = 0.1; }, [](auto& o) { o.history = 41.0 * o.history_interval; },
        [](auto& o) { o.history = kNaN; }}},
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
      {"scarce_points", {[](auto& o) { o.scarce_points = -1; }}}};
  for (const auto& [field, changes] : all) {
    for (std::size_t i = 0; i < changes.size(); ++i) {
      const std::string text = complaint(changes[i]);
      EXPECT_EQ(text.rfind("removal." + field + " must", 0), 0U) << field << ' ' << i << ": " << text;
    }
  }
}

TEST(RemovalOptions, LimitsThemselvesAreValid) {
  EXPECT_EQ(complaint([](auto& o) {
              o.label_every = 1000;
              o.max_labelled_share = 1.0;
              o.min_object_share = o.sure = o.keep_missed = o.depth_tolerance = o.growth = 0.0;
              o.history = o.history_interval;
              o.flow_interval = 1.0;
              o.edge_band = o.margin = o.scarce_points = 0;
            }),
            "");
}

TEST(RemovalOptions, ModesAreNamedAndRecognised) {
  EXPECT_EQ(removal_modes().size(), 6U);
  for (const std::string& name : removal_modes()) {
    const auto options = removal_from(name);
    ASSERT_TRUE(options) << name;
    EXPECT_EQ(mode_of(*options), name);
    EXPECT_EQ(options->is_on(), name != "none");
  }
  const auto ds_slam = removal_from("ds-slam-like");
  EXPECT_TRUE(ds_slam->labels && ds_slam->flow && ds_slam->keep_resting);
  EXPECT_FALSE(ds_slam->free_space || ds_slam->refine);
  const auto dynaslam = removal_from("dynaslam-like");
  EXPECT_TRUE(dynaslam->labels && dynaslam->free_space);
  EXPECT_FALSE(dynaslam->flow || dynaslam->keep_resting);
  EXPECT_EQ(dynaslam->sure, 0.0);
  EXPECT_EQ(dynaslam->scarce_points, 0);
  // The same switches alone make nothing like another system.
  RemovalOptions without_flow;
  without_flow.flow = false;
  EXPECT_EQ(mode_of(without_flow), "both");
  EXPECT_TRUE(removal_from("labels")->labels);
  EXPECT_FALSE(removal_from("labels")->free_space || removal_from("labels")->flow);
  EXPECT_FALSE(removal_from("geometry")->labels);
  EXPECT_TRUE(removal_from("geometry")->free_space && removal_from("geometry")->flow);
  EXPECT_FALSE(removal_from("magic"));
  EXPECT_FALSE(removal_from(""));
  EXPECT_FALSE(removal_from("Both"));
}

TEST(RemovalOptions, AModeKeepsTheOtherSettings) {
  RemovalOptions base;
  base.margin = 9;
  base.rest = 7.0;
  base.carry = base.refine = false;
  const auto options = removal_from("geometry", base);
  ASSERT_TRUE(options);
  EXPECT_EQ(options->margin, 9);
  EXPECT_EQ(options->rest, 7.0);
  EXPECT_FALSE(options->carry || options->refine);
}

TEST(RemovalOptions, AreCheckedWhereTheyAreUsed) {
  DynamicRemoval::Settings settings;
  settings.removal.margin = -1;
  EXPECT_THROW(DynamicRemoval(scene::small_camera(), settings), OptionsError);
}

}  // namespace
}  // namespace roslam
