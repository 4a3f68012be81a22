// SPDX-License-Identifier: BSD-3-Clause
// The detector as a whole, frame by frame: a box before a wall that moves or rests, labelled or not.
#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "roslam/dynamic_objects/dynamic_object_detector.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {
namespace {

constexpr double kRate = 15.0;  // frames a second
constexpr std::uint8_t kPersonLabel = 11;
constexpr Panel kBox{-0.6, -0.4, -0.1, 0.4, 2.0};

class WholeRemoval : public testing::Test {
 protected:
  static SE3 pose_at(std::size_t index) {
    const double t = static_cast<double>(index) / kRate;
    return turned(0.02 * t, {0.05 * t, 0.0, 0.03 * t});
  }

  // The scene as the camera, which moves too, sees it at a frame.
  View view_at(std::size_t index, const std::vector<Panel>& panels) const {
    return stage_.show(panels, pose_at(index));
  }

  static LabelledFrame labels(std::size_t index, const cv::Mat& person, float confidence = 0.9F) {
    LabelledFrame frame;
    frame.index = index;
    frame.segmentation.labels = cv::Mat::zeros(person.size(), CV_8UC1);
    frame.segmentation.labels.setTo(kPersonLabel, person);
    frame.segmentation.confidence.fill(confidence);
    return frame;
  }

  // The next frame, with the true pose as tracking would find it.
  DynamicObjects play(const View& view, const std::optional<LabelledFrame>& given = {},
                      bool examine_geometry = true) {
    Frame frame;
    frame.index = next_++;
    frame.timestamp = static_cast<double>(frame.index) / kRate;
    frame.depth = view.depth;
    const SE3 pose = pose_at(frame.index);
    const DynamicObjects dynamic_objects = detector_->detect(frame, view.grey, pose, given, examine_geometry);
    const auto points = stage_.grid_points(dynamic_objects.mask);
    detector_->remember(pose, points.outside, points.inside);
    return dynamic_objects;
  }

  // Frames of the wall alone.
  void play_wall(std::size_t frames) {
    for (std::size_t i = 0; i < frames; ++i) play(view_at(next_, room()));
  }

  // All of the object and little else.
  static void expect_removed(const DynamicObjects& dynamic_objects, const cv::Mat& thing) {
    EXPECT_GT(share_set(thing, dynamic_objects.mask), 0.97);
    cv::Mat around;
    cv::dilate(thing, around, cv::getStructuringElement(cv::MORPH_RECT, {29, 29}));
    EXPECT_LT(share_set(~around, dynamic_objects.mask), 0.01);
  }

  // Without unlabelled objects that flow may detect besides.
  static std::vector<MovableObject> people_of(const DynamicObjects& dynamic_objects) {
    std::vector<MovableObject> people;
    for (const auto& object : dynamic_objects.objects) {
      if (object.kind == Movable::kPerson) people.push_back(object);
    }
    return people;
  }

  // Median depth of the box in the view, which faces the camera.
  static float depth_of(const View& view) {
    return static_cast<float>(cv::mean(view.depth, view.shows(kThing))[0]);
  }

  static double removed_share(const DynamicObjects& dynamic_objects) {
    const cv::Mat& mask = dynamic_objects.mask;
    return mask.empty() ? 0.0 : cv::countNonZero(mask) / static_cast<double>(mask.total());
  }

  void set_options(const DynamicObjectOptions& options) {
    DynamicObjectDetector::Settings settings;
    settings.dynamic_objects = options;
    detector_.emplace(stage_.camera(), settings);
  }

  const Stage stage_;
  std::optional<DynamicObjectDetector> detector_{std::in_place, stage_.camera(),
                                                 DynamicObjectDetector::Settings()};
  std::size_t next_ = 0;
};

// Where there is no time for geometry in every frame, what it found is carried to the frames between.
TEST_F(WholeRemoval, AnUnlabelledThingThatMovesStaysRemovedWhereGeometryIsExaminedInEverySecondFrame) {
  play_wall(8);
  std::size_t removed = 0;
  std::size_t between = 0;
  for (std::size_t i = 0; i < 24; ++i) {
    const View view = view_at(next_, room({kBox.shifted(0.04 * static_cast<double>(i))}));
    const bool examines = i % 2 == 0;
    const DynamicObjects dynamic_objects = play(view, {}, examines);
    if (i < 8) continue;  // found by then
    const double share = share_set(view.shows(kThing), dynamic_objects.mask);
    if (share > 0.8) ++removed;
    if (share > 0.8 && !examines) ++between;
    EXPECT_LT(removed_share(dynamic_objects), 0.3) << i;
  }
  EXPECT_GE(removed, 14U);  // of 16
  EXPECT_GE(between, 7U);   // of 8
}

TEST_F(WholeRemoval, ALabelledThingThatMovesIsRemoved) {
  for (std::size_t i = 0; i < 36; ++i) {
    const View view = view_at(i, room({kBox.shifted(0.03 * static_cast<double>(i))}));
    const DynamicObjects dynamic_objects = play(view, labels(i, view.shows(kThing)));
    expect_removed(dynamic_objects, view.shows(kThing));
    const auto people = people_of(dynamic_objects);
    ASSERT_EQ(people.size(), 1U) << i;
    EXPECT_EQ(people[0].id, 1);
    EXPECT_NEAR(people[0].median_depth, depth_of(view), 0.05F);
    EXPECT_FALSE(people[0].is_at_rest) << i;
    EXPECT_TRUE(dynamic_objects.resting.empty());
    EXPECT_EQ(dynamic_objects.label_age, 0);
    if (!dynamic_objects.still.empty()) {
      EXPECT_LT(share_set(view.shows(kThing), dynamic_objects.still), 0.1) << i;
    }
  }
  EXPECT_TRUE(detector_->faults().empty());
}

TEST_F(WholeRemoval, ALabelledThingAtRestIsNamedSoAfterAWhile) {
  std::optional<std::size_t> first;
  for (std::size_t i = 0; i < 40; ++i) {
    const View view = view_at(i, room({kBox}));
    const DynamicObjects dynamic_objects = play(view, labels(i, view.shows(kThing)));
    ASSERT_EQ(dynamic_objects.objects.size(), 1U);
    expect_removed(dynamic_objects, view.shows(kThing));
    if (static_cast<double>(i) / kRate > 1.3) {  // seen without motion for a second
      ASSERT_FALSE(dynamic_objects.still.empty()) << i;
      EXPECT_GT(share_set(view.shows(kThing), dynamic_objects.still), 0.6) << i;
      EXPECT_EQ(cv::countNonZero(dynamic_objects.still & ~dynamic_objects.mask), 0);
    }
    if (!dynamic_objects.objects[0].is_at_rest) {
      EXPECT_TRUE(dynamic_objects.resting.empty()) << i;
      EXPECT_FALSE(first) << i;
      continue;
    }
    if (!first) first = i;
    EXPECT_GT(share_set(view.shows(kThing), dynamic_objects.resting), 0.97);
    EXPECT_EQ(cv::countNonZero(dynamic_objects.resting & ~dynamic_objects.mask), 0);
  }
  ASSERT_TRUE(first);
  EXPECT_NEAR(static_cast<double>(*first) / kRate, DynamicObjectOptions().rest, 0.3);
}

TEST_F(WholeRemoval, OfTwoThingsOnlyTheOneAtRestIsNamedSo) {
  const Panel other{0.3, -0.4, 0.6, 0.4, 2.0};
  DynamicObjects dynamic_objects;
  View view;
  for (std::size_t i = 0; i < 36; ++i) {
    view = view_at(i, room({kBox, other.shifted(0.01 * static_cast<double>(i))}));
    dynamic_objects = play(view, labels(i, view.panel >= kThing));
  }
  ASSERT_EQ(dynamic_objects.objects.size(), 2U);
  EXPECT_GT(share_set(view.shows(kThing), dynamic_objects.resting), 0.95);
  EXPECT_EQ(share_set(view.shows(kThing + 1), dynamic_objects.resting), 0.0);
  EXPECT_GT(share_set(view.panel >= kThing, dynamic_objects.mask), 0.97);
}

TEST_F(WholeRemoval, UncertainLabelsSeenOnceAreNotBelieved) {
  play_wall(8);
  cv::Mat area = cv::Mat::zeros(240, 320, CV_8UC1);
  area(cv::Rect(100, 60, 60, 100)).setTo(255);
  EXPECT_EQ(removed_share(play(view_at(next_, room()), labels(next_, area, 0.3F))), 0.0);
  // However often repeated, static points and depth still refute them.
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(removed_share(play(view_at(next_, room()), labels(next_, area, 0.3F))), 0.0) << i;
  }
  // Labels of high confidence are confirmed at once.
  EXPECT_GT(removed_share(play(view_at(next_, room()), labels(next_, area, 0.9F))), 0.07);
}

TEST_F(WholeRemoval, UncertainLabelsThatLastAreBelievedWhereGeometryDoesNotRefuteThem) {
  // From the first frame on there is no evidence against them yet.
  for (std::size_t i = 0; i < 4; ++i) {
    const View view = view_at(i, room({kBox.shifted(0.05 * static_cast<double>(i))}));
    const DynamicObjects dynamic_objects = play(view, labels(i, view.shows(kThing), 0.3F));
    if (i >= 2) expect_removed(dynamic_objects, view.shows(kThing));
    if (i == 0) {
      EXPECT_EQ(removed_share(dynamic_objects), 0.0);
    }
  }
}

TEST_F(WholeRemoval, AnUnlabelledThingThatStepsInIsFoundByGeometry) {
  play_wall(12);
  DynamicObjects dynamic_objects;
  View view;
  for (int i = 0; i < 14; ++i) {
    view = view_at(next_, room({kBox.shifted(0.04 * i)}));
    dynamic_objects = play(view);
    if (i > 0) {
      ASSERT_EQ(dynamic_objects.objects.size(), 1U) << i;
      EXPECT_EQ(dynamic_objects.objects[0].id, 1);
      EXPECT_EQ(dynamic_objects.objects[0].misses, 0);
      expect_removed(dynamic_objects, view.shows(kThing));
    }
    if (i == 0) {
      EXPECT_EQ(removed_share(dynamic_objects), 0.0) << "once may be noise";
    }
  }
  EXPECT_EQ(dynamic_objects.objects[0].kind, Movable::kUnknown);
  EXPECT_EQ(dynamic_objects.label_age, -1);
}

TEST_F(WholeRemoval, WithFlowAloneAnUnlabelledThingIsRemovedOnlyOnceItIsSeenTwice) {
  DynamicObjectOptions options = *options_of_mode("geometry");
  options.depth_consistency = false;
  set_options(options);
  std::size_t first = 0;
  for (std::size_t i = 0; i < 14; ++i) {
    const View view = view_at(i, room({kBox.shifted(0.04 * static_cast<double>(i))}));
    const DynamicObjects dynamic_objects = play(view);
    if (!dynamic_objects.objects.empty() && first == 0) first = i;
    for (const auto& object : dynamic_objects.objects) EXPECT_GE(object.times_seen, 2) << i;
    if (first > 0 && i > first + 2) {
      EXPECT_GT(share_set(view.shows(kThing), dynamic_objects.mask), 0.3) << i;
    }
  }
  EXPECT_GE(first, 2U) << "motion shows from the second frame on, and once may be noise";
}

TEST_F(WholeRemoval, LabelledThingsAtRestAreKeptIfAskedForAndThoseThatMoveAreNot) {
  set_options(*options_of_mode("ds-slam-like"));
  const Panel other{0.3, -0.4, 0.6, 0.4, 2.0};
  DynamicObjects dynamic_objects;
  View view;
  for (std::size_t i = 0; i < 20; ++i) {
    view = view_at(i, room({kBox, other.shifted(0.03 * static_cast<double>(i))}));
    dynamic_objects = play(view, labels(i, view.panel >= kThing));
  }
  EXPECT_EQ(share_set(view.shows(kThing), dynamic_objects.mask), 0.0);
  EXPECT_GT(share_set(view.shows(kThing + 1), dynamic_objects.mask), 0.9);
}

TEST_F(WholeRemoval, NothingIsRemovedWhereNothingMoves) {
  for (std::size_t i = 0; i < 30; ++i) {
    EXPECT_EQ(removed_share(play(view_at(i, room({kBox})))), 0.0) << i;
  }
}

TEST_F(WholeRemoval, LateLabelsAreCarriedToTheFrame) {
  View before = view_at(0, room({kBox}));
  play(before);
  for (std::size_t i = 1; i < 4; ++i) {
    const View view = view_at(i, room({kBox.shifted(0.04 * static_cast<double>(i))}));
    const bool has_come = i == 3;
    const DynamicObjects dynamic_objects =
        play(view, has_come ? std::optional(labels(0, before.shows(kThing))) : std::nullopt);
    if (!has_come) continue;
    EXPECT_EQ(dynamic_objects.label_age, 3);
    EXPECT_GT(share_set(inside(view.shows(kThing), 2), dynamic_objects.mask), 0.9);
    EXPECT_LT(removed_share(dynamic_objects), 0.3);
  }
  EXPECT_TRUE(detector_->faults().empty());
}

TEST_F(WholeRemoval, AThingThatLabelsMissIsStillRemoved) {
  play_wall(10);
  for (int i = 0; i < 12; ++i) {
    const View view = view_at(next_, room({kBox.shifted(0.03 * i)}));
    const bool is_missed = i == 5 || i == 6 || i == 9;
    const auto given =
        is_missed ? labels(next_, cv::Mat::zeros(240, 320, CV_8UC1)) : labels(next_, view.shows(kThing));
    const DynamicObjects dynamic_objects = play(view, given);
    EXPECT_EQ(people_of(dynamic_objects).size(), 1U) << i;
    expect_removed(dynamic_objects, view.shows(kThing));
  }
  EXPECT_EQ(detector_->flickers(), 2U);
}

TEST_F(WholeRemoval, LabelsThatCannotBeUsedAreCountedByReason) {
  const View view = view_at(0, room());
  const cv::Mat all(240, 320, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(removed_share(play(view, labels(0, all))), 0.0);
  EXPECT_EQ(removed_share(play(view, labels(1, cv::Mat::zeros(24, 32, CV_8UC1)))), 0.0);
  for (int i = 0; i < 12; ++i) play(view_at(next_, room()));
  EXPECT_EQ(removed_share(play(view, labels(2, cv::Mat::zeros(240, 320, CV_8UC1)))), 0.0);
  const std::map<std::string, std::size_t> expected{{"nearly everything is labelled as movable", 1},
                                                    {"labels have another size than the image", 1},
                                                    {"labels came too late", 1}};
  EXPECT_EQ(detector_->faults(), expected);
}

TEST_F(WholeRemoval, FindsThePoseOfTheCamera) {
  for (std::size_t i = 0; i < 6; ++i) {
    const DynamicObjects dynamic_objects = play(view_at(i, room({kBox})));
    EXPECT_EQ(dynamic_objects.T_camera_world.has_value(), i > 0);
    if (!dynamic_objects.T_camera_world) continue;
    EXPECT_LT((pose_at(i).inverse() * *dynamic_objects.T_camera_world).translation().norm(), 0.003);
  }
}

}  // namespace
}  // namespace roslam::scene
