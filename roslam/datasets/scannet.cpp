// SPDX-License-Identifier: BSD-3-Clause
// ScanNet as exported from .sens files: color/N.jpg, depth/N.png (millimetres), pose/N.txt (4x4, to world;
// -inf where tracking was lost), intrinsic/intrinsic_{color,depth}.txt (4x4, pixels of the images as stored)
// and extrinsic_{color,depth}.txt (4x4, from the sensor to the frame of the poses). Frames have no times; the
// Structure sensor takes 30 a second.
#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "roslam/common/error.hpp"
#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/numbered_poses.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/sensors/depth_registration.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::datasets {

namespace {
constexpr double kUnitsPerMetre = 1000.0;

// The size of the first image that can be read, of a few.
template <typename Read>
cv::Size size_of(const std::map<long, Path>& files, const Read& read) {
  int left = 20;
  for (const auto& [number, file] : files) {
    if (const ImageFile image = read(file); image.error.empty()) return image.image.size();
    if (--left == 0) break;
  }
  return {};
}

// A pinhole camera of a matrix of intrinsics.
Camera camera_from(const Path& file, const cv::Size& size) {
  const auto K = read_matrix(file);
  if (!K)
    throw InputError(file.string() +
                     ": is no 4x4 matrix of intrinsics; export it from the .sens file, or give --camera");
  Camera camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.fx = (*K)(0, 0);
  camera.fy = (*K)(1, 1);
  camera.cx = (*K)(0, 2);
  camera.cy = (*K)(1, 2);
  camera.depth_units_per_metre = kUnitsPerMetre;
  try {
    camera.validate();
  } catch (const CalibrationError& error) {
    throw CalibrationError(file.string() + ": " + error.what());
  }
  return camera;
}

SE3 extrinsics_from(const Path& file) {
  if (!is_present(file)) return {};  // exports without it are of aligned images
  const auto matrix = read_matrix(file);
  const auto transform = matrix ? rigid_transform(*matrix) : std::nullopt;
  if (!transform) throw InputError(file.string() + ": is no rigid transform; export it from the .sens file");
  return *transform;
}

// The camera of the images when they are resized. The centre of the top left pixel is at (0, 0), so that it
// is the corner at (-0.5, -0.5) that stays.
Camera resized(Camera camera, const cv::Size& size) {
  const double x = static_cast<double>(size.width) / camera.width;
  const double y = static_cast<double>(size.height) / camera.height;
  camera.fx *= x;
  camera.fy *= y;
  camera.cx = (camera.cx + 0.5) * x - 0.5;
  camera.cy = (camera.cy + 0.5) * y - 0.5;
  camera.width = size.width;
  camera.height = size.height;
  return camera;
}

// True if a point is seen at the same pixel by both, to half a pixel.
bool agree(const Camera& depth, const Camera& colour, const SE3& T_colour_depth) {
  if (depth.has_distortion() || colour.has_distortion()) return false;
  constexpr double kNear = 0.5;  // metres
  constexpr double kPixels = 0.5;
  for (const double x : {0.0, depth.width - 1.0}) {
    for (const double y : {0.0, depth.height - 1.0}) {
      const Eigen::Vector3d point = T_colour_depth * depth.unproject({x, y}, kNear);
      if (!(point.z() > 0.0) || !((colour.project(point) - Eigen::Vector2d(x, y)).norm() < kPixels))
        return false;
    }
  }
  return true;
}

// The camera of the colour images at the size of the depth images.
Camera colour_camera(const Path& folder, const GivenCamera& given, const cv::Size& colour,
                     const cv::Size& depth) {
  const Camera camera = given ? *given : camera_from(folder / "intrinsic" / "intrinsic_color.txt", colour);
  const cv::Size size(camera.width, camera.height);
  if (size != colour && size != depth) {
    throw InputError(folder.string() + ": the colour images are " + std::to_string(colour.width) + "x" +
                     std::to_string(colour.height) + " but the camera " + std::to_string(size.width) + "x" +
                     std::to_string(size.height) + " pixels; leave --camera out, as the folder has it");
  }
  return resized(camera, depth);
}
}  // namespace

bool is_scannet(const Path& folder) {
  std::error_code error;
  for (const char* part : {"color", "depth", "intrinsic"}) {
    if (!std::filesystem::is_directory(folder / part, error)) return false;
  }
  return true;
}

FolderListing list_scannet(const Path& folder, const GivenCamera& camera) {
  const auto colour = numbered_files(folder / "color", "", {".jpg", ".png"});
  const auto depth = numbered_files(folder / "depth", "", {".png"});
  const cv::Size colour_size = size_of(colour, [](const Path& file) { return read_colour_image(file); });
  const cv::Size depth_size = size_of(depth, [](const Path& file) { return read_depth_image(file); });
  if (colour_size.empty() || depth_size.empty()) {
    throw InputError(folder.string() + ": " + (colour_size.empty() ? "color" : "depth") +
                     " has no image that can be read; export them from the .sens file");
  }
  FolderListing listing{folder.string(), colour_camera(folder, camera, colour_size, depth_size), {}};
  listing.colour_size = colour_size;
  listing.depth_size = depth_size;
  list_numbered(colour, depth, numbered_files(folder / "pose", "", {".txt"}), listing.camera.fps, listing);

  const Camera depth_camera = camera_from(folder / "intrinsic" / "intrinsic_depth.txt", depth_size);
  const SE3 T_rig_colour = extrinsics_from(folder / "intrinsic" / "extrinsic_color.txt");
  const SE3 T_rig_depth = extrinsics_from(folder / "intrinsic" / "extrinsic_depth.txt");
  const SE3 T_colour_depth = T_rig_colour.inverse() * T_rig_depth;
  for (auto& frame : listing.frames) {
    if (frame.T_world_camera) frame.T_world_camera = *frame.T_world_camera * T_rig_colour;
  }
  std::shared_ptr<const DepthRegistration> registration;
  if (!agree(depth_camera, listing.camera, T_colour_depth))
    registration = std::make_shared<const DepthRegistration>(depth_camera, listing.camera, T_colour_depth);
  if (registration) ++listing.notes["depth was registered to colour by the calibration of both"];
  listing.transform = [=](cv::Mat& image, cv::Mat& metres) {
    // Averages over the area of a pixel where the image shrinks: its details would alias otherwise.
    if (image.size() != depth_size) cv::resize(image, image, depth_size, 0, 0, cv::INTER_AREA);
    if (registration && !metres.empty()) metres = (*registration)(metres);
  };
  return listing;
}

}  // namespace roslam::datasets
