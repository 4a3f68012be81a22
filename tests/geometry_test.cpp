// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

Vector6d random_tangent(std::mt19937& generator, double translation, double angle) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Vector6d tangent;
  for (int i = 0; i < 3; ++i) tangent[i] = translation * uniform(generator);
  for (int i = 3; i < 6; ++i) tangent[i] = angle * uniform(generator);
  return tangent;
}

TEST(SE3, ExpAndLogAreInverse) {
  std::mt19937 generator(1);
  for (int i = 0; i < 200; ++i) {
    const Vector6d tangent = random_tangent(generator, 5.0, i % 2 == 0 ? 1.7 : 1e-7);
    EXPECT_LT((SE3::exp(tangent).log() - tangent).norm(), 1e-9) << tangent.transpose();
  }
}

TEST(SE3, ExpMatchesTheMatrixExponential) {
  Vector6d tangent;
  tangent << 0.3, -0.2, 0.5, 0.4, -0.7, 0.2;
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = skew(tangent.tail<3>());
  generator.topRightCorner<3, 1>() = tangent.head<3>();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity();
  for (int n = 1; n < 30; ++n) {
    term = term * generator / n;
    sum += term;
  }
  EXPECT_LT((SE3::exp(tangent).matrix() - sum).norm(), 1e-12);
}

TEST(SE3, InverseAndProductFollowMatrices) {
  std::mt19937 generator(2);
  const SE3 a = SE3::exp(random_tangent(generator, 2.0, 1.0));
  const SE3 b = SE3::exp(random_tangent(generator, 2.0, 1.0));
  EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-12);
  EXPECT_LT(((a * a.inverse()).matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
}

TEST(Camera, ProjectAndUnprojectAreInverse) {
  const Camera camera = *camera_preset("tum-fr1");
  const Eigen::Vector3d point(0.4, -0.3, 2.5);
  EXPECT_LT((camera.unproject(camera.project(point), point.z()) - point).norm(), 1e-12);
}

TEST(Camera, UndistortInvertsDistortOverTheWholeImage) {
  for (const auto& name : camera_preset_names()) {
    const Camera camera = *camera_preset(name);
    for (double x = 0; x < camera.width; x += 31) {
      for (double y = 0; y < camera.height; y += 29) {
        const Eigen::Vector2d pixel(x, y);
        EXPECT_LT((camera.distort(camera.undistort(pixel)) - pixel).norm(), 1e-5)
            << name << " " << pixel.transpose();
      }
    }
  }
}

TEST(Camera, BoundsHoldEveryUndistortedCorner) {
  const Camera camera = *camera_preset("tum-fr1");
  const auto [min_x, min_y, max_x, max_y] = camera.undistorted_bounds();
  const Eigen::Vector2d corner = camera.undistort({camera.width - 1.0, camera.height - 1.0});
  EXPECT_LE(min_x, camera.undistort({0, 0}).x());
  EXPECT_GE(max_x, corner.x());
  EXPECT_GE(max_y, corner.y());
}

class CameraFile : public testing::Test {
 protected:
  Camera read(const std::string& text) const {
    const auto file = scratch_path(".yaml");
    std::ofstream(file) << text;
    return read_camera(file);
  }
  const std::string good_ =
      "model: pinhole\nwidth: 640\nheight: 480\nfx: 500\nfy: 501\ncx: 320\ncy: 240\n"
      "depth_units_per_metre: 1000\n";
};

TEST_F(CameraFile, RoundTrips) {
  for (const auto& name : camera_preset_names()) {
    const Camera written = *camera_preset(name);
    Camera camera = read(camera_to_yaml(written));
    EXPECT_LT((camera.T_body_camera.inverse() * written.T_body_camera).log().norm(), 1e-11) << name;
    camera.T_body_camera = written.T_body_camera;  // a matrix in the file, with rounded numbers
    EXPECT_EQ(camera, written) << name;
  }
}

TEST_F(CameraFile, RejectsAbsurdCalibration) {
  const auto with = [&](const std::string& key, const std::string& value) {
    std::string text = good_;
    const auto at = text.find(key + ":");
    return text.replace(at, text.find('\n', at) - at, key + ": " + value);
  };
  EXPECT_NO_THROW(read(good_));
  for (const auto& [key, value] :
       std::vector<std::pair<std::string, std::string>>{{"fx", "0"},
                                                        {"fx", "-500"},
                                                        {"fy", ".nan"},
                                                        {"cx", ".inf"},
                                                        {"width", "0"},
                                                        {"height", "-480"},
                                                        {"cx", "640"},
                                                        {"cy", "-1"},
                                                        {"depth_units_per_metre", "0"},
                                                        {"depth_units_per_metre", "-1"}}) {
    try {
      read(with(key, value));
      FAIL() << key << ": " << value << " was accepted";
    } catch (const CalibrationError& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(scratch_path(".yaml").string()), std::string::npos)
          << error.what();
    }
  }
  EXPECT_THROW(read(good_ + "distortion: [.nan, 0]\n"), CalibrationError);
}

TEST_F(CameraFile, HasNoDefaultForTheScaleOfDepth) {
  const std::string without = good_.substr(0, good_.find("depth_units"));
  try {
    read(without);
    FAIL() << "a camera file without depth_units_per_metre was accepted";
  } catch (const InputError& error) {
    const std::string text = error.what();
    for (const char* word : {"depth_units_per_metre", "1000", "5000", "TUM", "RealSense"})
      EXPECT_NE(text.find(word), std::string::npos) << word << ": " << text;
  }
  EXPECT_NO_THROW(Camera{}.validate()) << "depth in metres needs no unit";
}

TEST_F(CameraFile, RefusesDistortionThatCouldMeanTwoThings) {
  EXPECT_THROW(read(good_ + "distortion: [0.1, -0.2, 0.01]\n"), InputError);
  EXPECT_EQ(read(good_ + "distortion: [0.1, -0.2]\n").distortion,
            (std::array<double, 8>{0.1, -0.2, 0, 0, 0}));
  EXPECT_EQ(read(good_ + "distortion: [0.1, -0.2, 0.001, 0.002]\n").distortion,
            (std::array<double, 8>{0.1, -0.2, 0.001, 0.002, 0}));
  EXPECT_EQ(read(good_ + "distortion: []\n").distortion, (std::array<double, 8>{}));
}

TEST_F(CameraFile, TellsACalibrationOfAnotherSize) {
  for (const auto& name : camera_preset_names())
    EXPECT_TRUE(camera_preset(name)->has_central_principal_point()) << name;
  Camera camera = read(good_);
  camera.width = 1280;
  camera.height = 960;
  EXPECT_FALSE(camera.has_central_principal_point());
}

TEST_F(CameraFile, RejectsWhatItDoesNotKnow) {
  EXPECT_THROW(read(good_ + "focal: 3\n"), InputError);
  EXPECT_THROW(read(good_ + "fps: fast\n"), InputError);
  EXPECT_THROW(read("width: 640\n"), InputError);
  EXPECT_THROW(read("model: [unclosed\n"), InputError);
  EXPECT_THROW(read(""), InputError);
  EXPECT_THROW(load_camera("no-such-preset"), InputError);
}

}  // namespace
}  // namespace roslam
