// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/depth_registration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "roslam/common/error.hpp"
#include "tests/dense_scene.hpp"

namespace roslam {
namespace {

using dense_scene::Slab;

// A wall, and a pillar before it.
const std::vector<Slab> kScene{{2, 4.0, {-9, -9, -9}, {9, 9, 9}, {}},
                               {2, 1.5, {-0.3, -0.8, -9}, {0.1, 0.8, 9}, {}}};

Camera depth_camera() {
  Camera camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 195.0;
  camera.cx = 160.3;
  camera.cy = 118.2;
  return camera;
}

Camera colour_camera() {
  Camera camera;
  camera.width = 424;
  camera.height = 240;
  camera.fx = 306.0;
  camera.fy = 305.0;
  camera.cx = 210.0;
  camera.cy = 121.0;
  return camera;
}

// The first surface on a ray from a point: its distance in units of the direction.
double hit(const std::vector<Slab>& scene, const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Slab& slab : scene) {
    const double t = (slab.at - from[slab.axis]) / direction[slab.axis];
    const Eigen::Vector3d point = from + t * direction;
    bool is_inside = t > 0.01;
    for (int a = 0; a < 3; ++a)
      is_inside &= a == slab.axis || (point[a] >= slab.low[a] && point[a] <= slab.high[a]);
    if (is_inside) nearest = std::min(nearest, t);
  }
  return nearest;
}

cv::Mat depth_of(const std::vector<Slab>& scene, const Camera& camera, const SE3& T_world_camera) {
  cv::Mat depth(camera.height, camera.width, CV_32FC1);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = camera.unproject(camera.undistort(Eigen::Vector2d(u, v)), 1.0);
      depth.at<float>(v, u) =
          static_cast<float>(hit(scene, T_world_camera.translation(), T_world_camera.rotation() * ray));
    }
  }
  return depth;
}

struct Agreement {
  int compared = 0, right = 0;
  int unseen = 0, invented = 0;  // pixels that the depth camera cannot see, and those of them with a depth
};

// Of the depth registered to the colour camera with that rendered there.
Agreement compare(const Camera& depth, const Camera& colour, const SE3& T_colour_depth) {
  const cv::Mat registered = DepthRegistration(depth, colour, T_colour_depth)(depth_of(kScene, depth, SE3()));
  const SE3 T_world_colour = T_colour_depth.inverse();
  const cv::Mat expected = depth_of(kScene, colour, T_world_colour);
  Agreement result;
  for (int v = 0; v < colour.height; ++v) {
    for (int u = 0; u < colour.width; ++u) {
      const double z = expected.at<float>(v, u);
      const Eigen::Vector3d point = T_world_colour * colour.unproject(colour.undistort(Eigen::Vector2d(u, v)),
                                                                      z);  // in the depth camera
      const Eigen::Vector2d pixel = depth.distort(depth.project(point));
      const bool is_in_image =
          pixel.x() > 1 && pixel.y() > 1 && pixel.x() < depth.width - 2 && pixel.y() < depth.height - 2;
      const float got = registered.at<float>(v, u);
      if (!is_in_image || std::abs(hit(kScene, Eigen::Vector3d::Zero(), point) - 1.0) > 1e-3) {
        if (!is_in_image) continue;
        ++result.unseen;
        result.invented += got > 0.0F ? 1 : 0;
        continue;
      }
      ++result.compared;
      result.right += std::abs(static_cast<double>(got) - z) < 0.01 * z ? 1 : 0;
    }
  }
  return result;
}

void expect_agreement(const Agreement& found, int least) {
  EXPECT_GT(found.compared, least);
  EXPECT_GE(found.right, 0.99 * found.compared) << found.right << " of " << found.compared;
}

const SE3 kBeside(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d(1, 2, 0.5).normalized())),
                  {0.059, 0.001, -0.002});

TEST(DepthRegistration, AgreesWithTheSceneSeenFromTheColourCamera) {
  expect_agreement(compare(depth_camera(), colour_camera(), kBeside), 60000);
}

TEST(DepthRegistration, LeavesWhatTheDepthCameraCannotSeeUnknown) {
  const SE3 far_aside(Eigen::Quaterniond::Identity(), {0.3, 0.0, 0.0});
  const Agreement found = compare(depth_camera(), colour_camera(), far_aside);
  expect_agreement(found, 50000);
  EXPECT_GT(found.unseen, 2000) << "the pillar hides a part of the wall";
  EXPECT_LT(found.invented, 0.06 * found.unseen) << "at its edges";
}

TEST(DepthRegistration, TakesTheDistortionOfBothCameras) {
  Camera depth = depth_camera(), colour = colour_camera();
  depth.distortion = {0.1, -0.05, 0.001, -0.0005, 0.01};
  colour.distortion = {-0.0565, 0.0682, 0.000366, 0.000693, -0.0218};
  expect_agreement(compare(depth, colour, kBeside), 60000);
}

TEST(DepthRegistration, BringsDepthToASmallerImage) {
  Camera colour = colour_camera();
  colour.width /= 4;
  colour.height /= 4;
  colour.fx /= 4;
  colour.fy /= 4;
  colour.cx = (colour.cx + 0.5) / 4 - 0.5;
  colour.cy = (colour.cy + 0.5) / 4 - 0.5;
  const Agreement found = compare(depth_camera(), colour, kBeside);
  EXPECT_GT(found.compared, 4000);
  EXPECT_GE(found.right, 0.97 * found.compared) << "an edge is a larger part of a small image";
}

TEST(DepthRegistration, WorksForACameraThatIsMountedUpsideDown) {
  const SE3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ())),
                   {0.05, 0.0, 0.0});
  expect_agreement(compare(depth_camera(), colour_camera(), turned), 60000);
}

TEST(DepthRegistration, WorksForACameraThatIsTurnedOnItsSide) {
  const SE3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ())),
                   {0.05, 0.0, 0.0});
  expect_agreement(compare(depth_camera(), colour_camera(), turned), 50000);
}

TEST(DepthRegistration, BringsDepthIntoTheImageOfAFisheye) {
  Camera colour = colour_camera();
  colour.fx = colour.fy = 130.0;  // most of the pinhole's image is far outside 424 x 240
  colour.set_lens("fisheye", {0.02, -0.004, 0.001, -0.0002});
  expect_agreement(compare(depth_camera(), colour, kBeside), 20000);
}

TEST(DepthRegistration, PassesOnWhatIsRegisteredAlready) {
  const Camera camera = depth_camera();
  const DepthRegistration registration(camera, camera, SE3());
  EXPECT_TRUE(registration.is_identity());
  const cv::Mat depth = depth_of(kScene, camera, SE3());
  EXPECT_EQ(cv::norm(registration(depth), depth, cv::NORM_INF), 0.0);
  EXPECT_FALSE(DepthRegistration(camera, colour_camera(), SE3()).is_identity());
}

TEST(DepthRegistration, UnknownAndAbsurdDepthStaysUnknown) {
  const DepthRegistration registration(depth_camera(), colour_camera(), kBeside);
  for (const float bad : {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(), 1e30F, 1e-30F}) {
    const cv::Mat registered = registration(cv::Mat(240, 320, CV_32FC1, cv::Scalar(bad)));
    EXPECT_EQ(cv::countNonZero(registered), 0) << bad;
  }
}

TEST(DepthRegistration, RefusesWhatDoesNotFit) {
  const DepthRegistration registration(depth_camera(), colour_camera(), kBeside);
  EXPECT_THROW(registration(cv::Mat(240, 320, CV_16UC1)), InputError);
  EXPECT_THROW(registration(cv::Mat(480, 640, CV_32FC1)), InputError);
  const SE3 nowhere = SE3::from_parts(Eigen::Quaterniond::Identity(),
                                      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_THROW(DepthRegistration(depth_camera(), colour_camera(), nowhere), CalibrationError);
  Camera bad = depth_camera();
  bad.fx = 0.0;
  EXPECT_THROW(DepthRegistration(bad, colour_camera(), SE3()), CalibrationError);
}

}  // namespace
}  // namespace roslam
