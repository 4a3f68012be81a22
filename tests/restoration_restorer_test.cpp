// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <memory>

#include "roslam/common/error.hpp"
#include "tests/restoration_scene.hpp"

namespace roslam::scene {
namespace {

// Fills with grey, or fails.
class GreyInpainter : public Inpainter {
 public:
  cv::Mat inpaint(const cv::Mat& crop, const cv::Mat&, const cv::Rect&, Movable) override {
    if (fails) throw ModelError("no network today");
    return cv::Mat(crop.size(), CV_8UC3, cv::Scalar::all(120));
  }
  bool fails = false;
};

class Restorer : public testing::Test {
 protected:
  roslam::PosedImage target() const { return taken(stage_, room({kPerson}), SE3(), 10.0); }

  // All that the person hides, seen while they were elsewhere.
  SourceImage elsewhere(double person = 0.8, double x = -0.05) const {
    return *prepare_source(taken(stage_, room({kPerson.shifted(person)}), looking_from(x, 0.0, 0.0), 8.0),
                           {});
  }

  RestoredImage restore(const roslam::PosedImage& view, const std::vector<const SourceImage*>& sources,
                        const StaticSceneRestorer::Settings& settings = {}) const {
    return StaticSceneRestorer(stage_.camera(), settings, inpainter_)
        .restore(view, {{Movable::kPerson, {100, 20, 200, 200}}}, sources);
  }

  static void expect_whole(const roslam::PosedImage& view, const RestoredImage& restored) {
    const cv::Mat measured = restored.provenance == static_cast<double>(Provenance::kMeasured);
    EXPECT_EQ(cv::countNonZero(measured & (view.removed != 0)), 0);
    EXPECT_EQ(difference(restored.colour, view.colour, measured), 0.0);
    if (!view.depth.empty()) {
      EXPECT_EQ(difference(restored.depth, view.depth, measured), 0.0);
    }
    EXPECT_EQ(restored.pixels_of(Provenance::kMeasured) + restored.pixels_of(Provenance::kReprojected) +
                  restored.pixels_of(Provenance::kInpainted),
              restored.colour.total());
  }

  Stage stage_;
  std::shared_ptr<GreyInpainter> inpainter_ = std::make_shared<GreyInpainter>();
};

TEST_F(Restorer, TakesWhatWasSeenAndInventsTheRest) {
  const SourceImage source = elsewhere(0.25);  // the person still hides part of it
  const auto view = target();
  const auto restored = restore(view, {&source});
  expect_whole(view, restored);
  const View truth = stage_.show(room());
  const cv::Mat seen = restored.provenance == static_cast<double>(Provenance::kReprojected);
  const cv::Mat invented = restored.provenance == static_cast<double>(Provenance::kInpainted);
  EXPECT_GT(share_set(view.removed, seen), 0.3);
  EXPECT_GT(share_set(view.removed, invented), 0.1);
  EXPECT_LT(difference(in_colour(truth.grey), restored.colour, seen), 4.0);
  // Wall, shelf and bench go on behind the person.
  EXPECT_EQ(share_set(invented, restored.depth > 0), 1.0);
  const cv::Mat wrong = cv::abs(restored.depth - truth.depth) > 0.1 * truth.depth;
  EXPECT_LT(share_set(invented, wrong), 0.15);
  EXPECT_EQ(cv::countNonZero((restored.certainty > 0) & invented), 0);
}

TEST_F(Restorer, LeavesAImageWithoutHolesAsItIs) {
  auto view = target();
  for (const cv::Mat& none : {cv::Mat(), cv::Mat(cv::Mat::zeros(view.colour.size(), CV_8UC1))}) {
    view.removed = none;
    const SourceImage source = elsewhere();
    const auto restored = restore(view, {&source});
    EXPECT_EQ(cv::norm(restored.colour, view.colour, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(restored.depth, view.depth, cv::NORM_INF), 0.0);
    EXPECT_EQ(restored.pixels_of(Provenance::kMeasured), view.colour.total());
  }
}

TEST_F(Restorer, FillsAImageOfWhichNothingIsLeft) {
  auto view = target();
  view.removed = cv::Mat(view.colour.size(), CV_8UC1, cv::Scalar(255));
  const auto without = restore(view, {});
  EXPECT_EQ(without.pixels_of(Provenance::kInpainted), view.colour.total());
  EXPECT_EQ(cv::countNonZero(without.depth), 0);
  const SourceImage source = elsewhere();
  const auto with = restore(view, {&source});
  EXPECT_GT(with.pixels_of(Provenance::kReprojected), view.colour.total() / 2);
}

TEST_F(Restorer, DoesWithoutAnyDepth) {
  auto view = target();
  view.depth = cv::Mat();
  const auto restored = restore(view, {});
  expect_whole(view, restored);
  EXPECT_TRUE(restored.depth.empty());
  view.depth = cv::Mat::zeros(view.colour.size(), CV_32FC1);
  const auto blind = restore(view, {});
  EXPECT_EQ(cv::countNonZero(blind.depth), 0);
  EXPECT_EQ(blind.pixels_of(Provenance::kInpainted),
            static_cast<std::size_t>(cv::countNonZero(view.removed)));
}

TEST_F(Restorer, DoesWithoutANetwork) {
  inpainter_ = nullptr;
  const auto view = target();
  const auto restored = restore(view, {});
  expect_whole(view, restored);
  cv::Mat black;
  cv::inRange(restored.colour, cv::Scalar::all(0), cv::Scalar::all(0), black);
  EXPECT_EQ(cv::countNonZero(black & view.removed), 0);
}

TEST_F(Restorer, CanBeToldToDoOneThingAlone) {
  const SourceImage source = elsewhere(0.25);
  const auto view = target();
  StaticSceneRestorer::Settings settings;
  settings.restoration.inpaint = false;
  const auto seen_only = restore(view, {&source}, settings);
  const cv::Mat open = seen_only.provenance == static_cast<double>(Provenance::kInpainted);
  EXPECT_GT(cv::countNonZero(open), 0);
  EXPECT_EQ(cv::norm(seen_only.colour, cv::NORM_INF, open), 0.0);
  settings.restoration = {.reproject = false};
  EXPECT_EQ(restore(view, {&source}, settings).pixels_of(Provenance::kReprojected), 0U);
}

TEST_F(Restorer, TheSameInputGivesTheSameBytes) {
  const SourceImage source = elsewhere(0.25);
  const auto view = target();
  const auto first = restore(view, {&source}), second = restore(view, {&source});
  EXPECT_EQ(cv::norm(first.colour, second.colour, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(first.depth, second.depth, cv::NORM_INF), 0.0);
}

TEST_F(Restorer, RefusesImagesThatDoNotFit) {
  auto view = target();
  view.colour = view.colour(cv::Rect(0, 0, 100, 100)).clone();
  EXPECT_THROW(restore(view, {}), InputError);
  view = target();
  view.depth.convertTo(view.depth, CV_16U);
  EXPECT_THROW(restore(view, {}), InputError);
  view = target();
  view.removed = view.removed(cv::Rect(0, 0, 100, 100)).clone();
  EXPECT_THROW(restore(view, {}), InputError);
  view = target();
  view.colour = cv::Mat();
  EXPECT_THROW(restore(view, {}), InputError);
}

TEST_F(Restorer, PassesOnThatTheNetworkFails) {
  inpainter_->fails = true;
  EXPECT_THROW(restore(target(), {}), ModelError);
}

TEST(RestorationOptions, NameTheFieldThatIsOutOfRange) {
  RestorationOptions options;
  options.min_certainty = 2.0;
  EXPECT_THROW(options.validate(), OptionsError);
}

}  // namespace
}  // namespace roslam::scene
