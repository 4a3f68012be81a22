// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "roslam/common/error.hpp"
#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/background_reprojection.hpp"
#include "tests/restoration_scene.hpp"

namespace roslam::scene {
namespace {

// A target with a person before the room, and what other views know.
class Reprojection : public testing::Test {
 protected:
  roslam::PosedImage target() const { return taken(stage_, room({kPerson}), SE3(), 10.0); }
  View truth() const { return stage_.show(room()); }

  // A view from elsewhere, with the person elsewhere.
  roslam::PosedImage other(double x, double person, double timestamp) const {
    return taken(stage_, room({kPerson.shifted(person)}), turned(0.02 * x, {x, 0.0, 0.0}), timestamp);
  }

  void add(const roslam::PosedImage& view) {
    auto source = prepare_source(view, {});
    ASSERT_TRUE(source);
    sources_.push_back(std::make_unique<const SourceImage>(std::move(*source)));
  }

  ReprojectedArea fill(const roslam::PosedImage& view, const ReprojectionOptions& options = {}) const {
    std::vector<const SourceImage*> sources;
    for (const auto& source : sources_) sources.push_back(source.get());
    return BackgroundReprojection(stage_.camera(), options).fill(view, view.removed, sources);
  }

  Stage stage_;
  std::vector<std::unique_ptr<const SourceImage>> sources_;
};

TEST_F(Reprojection, FillsAHoleWithWhatOtherViewsSaw) {
  add(other(-0.1, 0.8, 8.0));
  add(other(0.1, -0.9, 12.0));
  const auto area = fill(target());
  EXPECT_GT(share_set(target().removed, area.filled), 0.98);
  EXPECT_LT(difference(in_colour(truth().grey), area.colour, area.filled), 3.0);
  // At the edges of the shelf and the bench a pixel may fall on either side.
  const cv::Mat known = area.depth > 0;
  const cv::Mat wrong = (cv::abs(area.depth - truth().depth) > 0.01 * truth().depth) & known;
  EXPECT_LT(share_set(known, wrong), 0.03);
  EXPECT_EQ(cv::countNonZero(area.filled & ~target().removed), 0);
}

TEST_F(Reprojection, TellsHowOldAndHowSureItIs) {
  add(other(-0.1, 0.8, 7.0));
  const auto one = fill(target());
  const cv::Scalar age = cv::mean(one.age, one.filled);
  EXPECT_NEAR(age[0], 3.0, 1e-3);
  add(other(0.1, 0.8, 12.0));
  add(other(0.0, 0.8, 13.0));
  const auto three = fill(target());
  EXPECT_GT(cv::mean(three.certainty, three.filled)[0], cv::mean(one.certainty, one.filled)[0] + 0.05);
}

TEST_F(Reprojection, SomethingNearHidesWhatIsBehindIt) {
  // Other views look past the shelf at the wall behind it: the wall must not come through.
  for (const double x : {-0.4, -0.2, 0.3}) add(other(x, 0.9, 10.0 + x));
  auto view = target();
  const cv::Mat shelf = inside(truth().shows(2), 3);
  view.removed = shelf;
  const auto area = fill(view);
  EXPECT_GT(share_set(shelf, area.filled), 0.95);
  EXPECT_LT(depth_difference(truth().depth, area.depth, shelf & (area.depth > 0)), 0.02);
}

TEST_F(Reprojection, AThingThatOneMaskMissedStaysOut) {
  for (const double x : {-0.15, 0.0, 0.15}) add(other(x, 0.9, 10.0 + x));
  auto ghost = other(0.05, 0.1, 10.1);
  ghost.removed = cv::Mat();
  add(ghost);
  const auto area = fill(target());
  const cv::Mat inner = inside(target().removed, 8) & area.filled;
  EXPECT_LT(difference(in_colour(truth().grey), area.colour, inner), 4.0);
  const cv::Mat near = (area.depth > 0) & (area.depth < 1.5) & inner;
  EXPECT_LT(share_set(inner, near), 0.01);
}

TEST_F(Reprojection, TakesTheLightOfTheTarget) {
  auto brighter = other(0.1, 0.9, 11.0);
  brighter.colour.convertTo(brighter.colour, -1, 1.25);
  add(brighter);
  const cv::Mat colour = in_colour(truth().grey);
  const auto area = fill(target());
  cv::Mat dark;  // not overexposed in the brighter image
  cv::inRange(colour, cv::Scalar::all(0), cv::Scalar::all(190), dark);
  EXPECT_LT(difference(colour, area.colour, area.filled & dark), 4.0);
}

TEST_F(Reprojection, LaysViewsOverTheTargetWhosePoseIsOff) {
  auto view = other(0.1, 0.9, 11.0);
  view.T_world_camera = *view.T_world_camera * SE3(so3_exp({0.004, -0.006, 0.003}), {0.012, -0.008, 0.01});
  add(view);
  const cv::Mat colour = in_colour(truth().grey);
  ReprojectionOptions as_told;
  as_told.align = false;
  const auto crooked = fill(target(), as_told);
  const auto straight = fill(target());
  const double before = difference(colour, crooked.colour, crooked.filled);
  const double after = difference(colour, straight.colour, straight.filled);
  EXPECT_LT(after, 0.5 * before) << before;
}

TEST_F(Reprojection, FillsNothingWithoutPoseOrSources) {
  EXPECT_EQ(cv::countNonZero(fill(target()).filled), 0);
  add(other(0.1, 0.9, 11.0));
  auto lost = target();
  lost.T_world_camera.reset();
  EXPECT_EQ(cv::countNonZero(fill(lost).filled), 0);
  auto whole = target();
  whole.removed.setTo(0);
  EXPECT_EQ(cv::countNonZero(fill(whole).filled), 0);
}

TEST_F(Reprojection, WorksForATargetWithoutDepth) {
  add(other(-0.1, 0.8, 8.0));
  add(other(0.1, -0.9, 12.0));
  auto view = target();
  view.depth = cv::Mat();
  const auto area = fill(view);
  EXPECT_GT(share_set(view.removed, area.filled), 0.95);
}

TEST_F(Reprojection, FillsDistortedImages) {
  Camera camera = small_camera();
  camera.distortion = {0.12, -0.2, 0.002, -0.001, 0.0};
  // The scene as the distorting camera shows it, resampled from one with a wider view.
  Camera wide = small_camera();
  wide.distortion = {};
  wide.width = 480;
  wide.height = 360;
  wide.cx += 80;
  wide.cy += 60;
  const Stage stage(wide);
  cv::Mat map(camera.height, camera.width, CV_32FC2);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d straight = camera.undistort({x, y});
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(straight.x() + 80),
                                 static_cast<float>(straight.y() + 60)};
    }
  }
  const auto taken_through = [&](const std::vector<Panel>& panels, const SE3& pose, double time) {
    roslam::PosedImage view = taken(stage, panels, pose, time);
    cv::remap(view.colour, view.colour, map, {}, cv::INTER_LINEAR);
    cv::remap(view.depth, view.depth, map, {}, cv::INTER_NEAREST);
    cv::remap(view.removed, view.removed, map, {}, cv::INTER_NEAREST);
    return view;
  };
  const auto one =
      prepare_source(taken_through(room({kPerson.shifted(0.8)}), looking_from(-0.1, 0.0, 0.0), 8.0), {});
  const auto two =
      prepare_source(taken_through(room({kPerson.shifted(-0.9)}), looking_from(0.1, 0.0, 0.0), 12.0), {});
  ASSERT_TRUE(one && two);
  auto target = taken_through(room({kPerson}), SE3(), 10.0);
  target.depth.at<float>(5, 5) = std::numeric_limits<float>::quiet_NaN();
  const std::vector<const SourceImage*> sources{&*one, &*two};
  const auto area = BackgroundReprojection(camera, {}).fill(target, target.removed, sources);
  const auto truth = taken_through(room(), SE3(), 10.0);
  EXPECT_GT(share_set(target.removed, area.filled), 0.95);
  EXPECT_LT(difference(truth.colour, area.colour, area.filled), 4.0);
}

TEST(PixelRays, PixelsComeBackThroughLensDistortion) {
  Camera camera = small_camera();
  camera.distortion = {0.1, -0.2, 0.001, -0.001, 0.0};
  const PixelRays rays(camera);
  for (const cv::Point& pixel :
       {cv::Point(0, 0), cv::Point(40, 200), cv::Point(310, 10), cv::Point(160, 120)}) {
    const auto back = rays.pixel(rays.point(pixel.x, pixel.y, 2.5F));
    if (!back) continue;  // the outermost may fall outside by rounding
    EXPECT_NEAR(back->x(), pixel.x, 0.02);
    EXPECT_NEAR(back->y(), pixel.y, 0.02);
  }
  EXPECT_FALSE(rays.pixel({0.0F, 0.0F, -1.0F}));
  EXPECT_FALSE(rays.pixel({50.0F, 0.0F, 1.0F}));
  EXPECT_TRUE(rays.pixel(rays.point(160, 120, 2.5F)));
}

TEST_F(Reprojection, AViewWithoutPoseOrDepthIsNoSource) {
  auto view = other(0.1, 0.9, 11.0);
  view.depth.setTo(0);
  EXPECT_FALSE(prepare_source(view, {}));
  view = other(0.1, 0.9, 11.0);
  view.depth = cv::Mat();
  EXPECT_FALSE(prepare_source(view, {}));
  view = other(0.1, 0.9, 11.0);
  view.T_world_camera.reset();
  EXPECT_FALSE(prepare_source(view, {}));
}

TEST(ReprojectionOptions, NameTheFieldThatIsOutOfRange) {
  ReprojectionOptions options;
  options.views = 0;
  EXPECT_THROW(options.validate(), OptionsError);
  options = {};
  options.age_scale = 0.0;
  EXPECT_THROW(options.validate(), OptionsError);
}

}  // namespace
}  // namespace roslam::scene
