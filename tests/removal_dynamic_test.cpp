// SPDX-License-Identifier: BSD-3-Clause
// The removal as a whole, frame by frame: a box before a wall that moves or rests, labelled or not.
#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "roslam/removal/dynamic_removal.hpp"
#include "tests/removal_scene.hpp"

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
  Removal play(const View& view, const std::optional<LabelledFrame>& given = {}) {
    Frame frame;
    frame.index = next_++;
    frame.timestamp = static_cast<double>(frame.index) / kRate;
    frame.depth = view.depth;
    const SE3 pose = pose_at(frame.index);
    const Removal removal = removal_->find(frame, view.grey, pose, given);
    auto past = stage_.past(view, 0, 0.0, pose, removal.mask);
    removal_->remember(pose, std::move(past.points), std::move(past.moving_points));
    return removal;
  }

  // Frames of the wall alone.
  void play_wall(std::size_t frames) {
    for (std::size_t i = 0; i < frames; ++i) play(view_at(next_, room()));
  }

  // All of the thing and little of anything else.
  static void expect_removed(const Removal& removal, const cv::Mat& thing) {
    EXPECT_GT(share_set(thing, removal.mask), 0.97);
    cv::Mat around;
    cv::dilate(thing, around, cv::getStructuringElement(cv::MORPH_RECT, {29, 29}));
    EXPECT_LT(share_set(~around, removal.mask), 0.01);
  }

  // Without what flow may find beside them.
  static std::vector<MovableObject> people_of(const Removal& removal) {
    std::vector<MovableObject> people;
    for (const auto& object : removal.objects) {
      if (object.kind == Movable::kPerson) people.push_back(object);
    }
    return people;
  }

  // Median depth of the box in the view, which faces the camera.
  static float depth_of(const View& view) {
    return static_cast<float>(cv::mean(view.depth, view.shows(kThing))[0]);
  }

  static double removed_share(const Removal& removal) {
    return removal.mask.empty() ? 0.0
                                : cv::countNonZero(removal.mask) / static_cast<double>(removal.mask.total());
  }

  void set_options(const RemovalOptions& options) {
    DynamicRemoval::Settings settings;
    settings.removal = options;
    removal_.emplace(stage_.camera(), settings);
  }

  const Stage stage_;
  std::optional<DynamicRemoval> removal_{std::in_place, stage_.camera(), DynamicRemoval::Settings()};
  std::size_t next_ = 0;
};

TEST_F(WholeRemoval, ALabelledThingThatMovesIsRemoved) {
  for (std::size_t i = 0; i < 36; ++i) {
    const View view = view_at(i, room({kBox.shifted(0.03 * static_cast<double>(i))}));
    const Removal removal = play(view, labels(i, view.shows(kThing)));
    expect_removed(removal, view.shows(kThing));
    const auto people = people_of(removal);
    ASSERT_EQ(people.size(), 1U) << i;
    EXPECT_EQ(people[0].id, 1);
    EXPECT_NEAR(people[0].median_depth, depth_of(view), 0.05F);
    EXPECT_FALSE(people[0].is_at_rest) << i;
    EXPECT_TRUE(removal.resting.empty());
    EXPECT_EQ(removal.label_age, 0);
  }
  EXPECT_TRUE(removal_->faults().empty());
}

TEST_F(WholeRemoval, ALabelledThingAtRestIsNamedSoAfterAWhile) {
  std::optional<std::size_t> first;
  for (std::size_t i = 0; i < 40; ++i) {
    const View view = view_at(i, room({kBox}));
    const Removal removal = play(view, labels(i, view.shows(kThing)));
    ASSERT_EQ(removal.objects.size(), 1U);
    expect_removed(removal, view.shows(kThing));
    if (!removal.objects[0].is_at_rest) {
      EXPECT_TRUE(removal.resting.empty()) << i;
      EXPECT_FALSE(first) << i;
      continue;
    }
    if (!first) first = i;
    EXPECT_GT(share_set(view.shows(kThing), removal.resting), 0.97);
    EXPECT_EQ(cv::countNonZero(removal.resting & ~removal.mask), 0);
  }
  ASSERT_TRUE(first);
  EXPECT_NEAR(static_cast<double>(*first) / kRate, RemovalOptions().rest, 0.3);
}

TEST_F(WholeRemoval, OfTwoThingsOnlyTheOneAtRestIsNamedSo) {
  const Panel other{0.3, -0.4, 0.6, 0.4, 2.0};
  Removal removal;
  View view;
  for (std::size_t i = 0; i < 36; ++i) {
    view = view_at(i, room({kBox, other.shifted(0.01 * static_cast<double>(i))}));
    removal = play(view, labels(i, view.panel >= kThing));
  }
  ASSERT_EQ(removal.objects.size(), 2U);
  EXPECT_GT(share_set(view.shows(kThing), removal.resting), 0.95);
  EXPECT_EQ(share_set(view.shows(kThing + 1), removal.resting), 0.0);
  EXPECT_GT(share_set(view.panel >= kThing, removal.mask), 0.97);
}

TEST_F(WholeRemoval, UncertainLabelsSeenOnceAreNotBelieved) {
  play_wall(8);
  cv::Mat area = cv::Mat::zeros(240, 320, CV_8UC1);
  area(cv::Rect(100, 60, 60, 100)).setTo(255);
  EXPECT_EQ(removed_share(play(view_at(next_, room()), labels(next_, area, 0.3F))), 0.0);
  // Seen again and again, they are still refuted by points and depth at rest.
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(removed_share(play(view_at(next_, room()), labels(next_, area, 0.3F))), 0.0) << i;
  }
  // Sure labels are believed at once.
  EXPECT_GT(removed_share(play(view_at(next_, room()), labels(next_, area, 0.9F))), 0.07);
}

TEST_F(WholeRemoval, UncertainLabelsThatLastAreBelievedWhereGeometryDoesNotRefuteThem) {
  // From the first frame on there is no evidence against them yet.
  for (std::size_t i = 0; i < 4; ++i) {
    const View view = view_at(i, room({kBox.shifted(0.05 * static_cast<double>(i))}));
    const Removal removal = play(view, labels(i, view.shows(kThing), 0.3F));
    if (i >= 2) expect_removed(removal, view.shows(kThing));
    if (i == 0) {
      EXPECT_EQ(removed_share(removal), 0.0);
    }
  }
}

TEST_F(WholeRemoval, AnUnlabelledThingThatStepsInIsFoundByGeometry) {
  play_wall(12);
  Removal removal;
  View view;
  for (int i = 0; i < 14; ++i) {
    view = view_at(next_, room({kBox.shifted(0.04 * i)}));
    removal = play(view);
    if (i > 0) {
      ASSERT_EQ(removal.objects.size(), 1U) << i;
      EXPECT_EQ(removal.objects[0].id, 1);
      EXPECT_EQ(removal.objects[0].misses, 0);
      expect_removed(removal, view.shows(kThing));
    }
    if (i == 0) {
      EXPECT_EQ(removed_share(removal), 0.0) << "once may be noise";
    }
  }
  EXPECT_EQ(removal.objects[0].kind, Movable::kUnknown);
  EXPECT_EQ(removal.label_age, -1);
}

TEST_F(WholeRemoval, WithFlowAloneAnUnlabelledThingIsRemovedOnlyOnceItIsSeenTwice) {
  RemovalOptions options = *removal_from("geometry");
  options.free_space = false;
  set_options(options);
  std::size_t first = 0;
  for (std::size_t i = 0; i < 14; ++i) {
    const View view = view_at(i, room({kBox.shifted(0.04 * static_cast<double>(i))}));
    const Removal removal = play(view);
    if (!removal.objects.empty() && first == 0) first = i;
    for (const auto& object : removal.objects) EXPECT_GE(object.sightings, 2) << i;
    if (first > 0 && i > first + 2) {
      EXPECT_GT(share_set(view.shows(kThing), removal.mask), 0.3) << i;
    }
  }
  EXPECT_GE(first, 2U) << "motion shows from the second frame on, and once may be noise";
}

TEST_F(WholeRemoval, LabelledThingsAtRestAreKeptIfAskedForAndThoseThatMoveAreNot) {
  set_options(*removal_from("ds-slam-like"));
  const Panel other{0.3, -0.4, 0.6, 0.4, 2.0};
  Removal removal;
  View view;
  for (std::size_t i = 0; i < 20; ++i) {
    view = view_at(i, room({kBox, other.shifted(0.03 * static_cast<double>(i))}));
    removal = play(view, labels(i, view.panel >= kThing));
  }
  EXPECT_EQ(share_set(view.shows(kThing), removal.mask), 0.0);
  EXPECT_GT(share_set(view.shows(kThing + 1), removal.mask), 0.9);
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
    const Removal removal =
        play(view, has_come ? std::optional(labels(0, before.shows(kThing))) : std::nullopt);
    if (!has_come) continue;
    EXPECT_EQ(removal.label_age, 3);
    EXPECT_GT(share_set(inside(view.shows(kThing), 2), removal.mask), 0.9);
    EXPECT_LT(removed_share(removal), 0.3);
  }
  EXPECT_TRUE(removal_->faults().empty());
}

TEST_F(WholeRemoval, AThingThatLabelsMissIsStillRemoved) {
  play_wall(10);
  for (int i = 0; i < 12; ++i) {
    const View view = view_at(next_, room({kBox.shifted(0.03 * i)}));
    const bool is_missed = i == 5 || i == 6 || i == 9;
    const auto given =
        is_missed ? labels(next_, cv::Mat::zeros(240, 320, CV_8UC1)) : labels(next_, view.shows(kThing));
    const Removal removal = play(view, given);
    EXPECT_EQ(people_of(removal).size(), 1U) << i;
    expect_removed(removal, view.shows(kThing));
  }
  EXPECT_EQ(removal_->flickers(), 2U);
}

TEST_F(WholeRemoval, LabelsThatCannotBeUsedAreCountedByReason) {
  const View view = view_at(0, room());
  const cv::Mat all(240, 320, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(removed_share(play(view, labels(0, all))), 0.0);
  EXPECT_EQ(removed_share(play(view, labels(1, cv::Mat::zeros(24, 32, CV_8UC1)))), 0.0);
  for (int i = 0; i < 12; ++i) play(view_at(next_, room()));
  EXPECT_EQ(removed_share(play(view, labels(2, cv::Mat::zeros(240, 320, CV_8UC1)))), 0.0);
  const std::map<std::string, std::size_t> expected{{"nearly everything is labelled as movable", 1},
                                                    {"labels have another size than the picture", 1},
                                                    {"labels came too late", 1}};
  EXPECT_EQ(removal_->faults(), expected);
}

TEST_F(WholeRemoval, FindsThePoseOfTheCamera) {
  for (std::size_t i = 0; i < 6; ++i) {
    const Removal removal = play(view_at(i, room({kBox})));
    EXPECT_EQ(removal.T_camera_world.has_value(), i > 0);
    if (!removal.T_camera_world) continue;
    EXPECT_LT((pose_at(i).inverse() * *removal.T_camera_world).translation().norm(), 0.003);
  }
}

}  // namespace
}  // namespace roslam::scene
