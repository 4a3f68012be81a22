// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/named_path.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "recording/map_render.hpp"
#include "roslam/common/error.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

using namespace recording;

namespace {
constexpr auto kExamples = R"(Examples:
  roslam render dense.ply --out top.png
  roslam render dense.ply --view front --colour provenance --out front.png
  roslam render dense.ply --view follow --trajectory run/trajectory.txt --out follow.png
  roslam render cloud.ply --point-size 0.01 --out cloud.png

MAP is a PLY file of RO-SLAM or another program, in metres; the normal of its level surfaces is up.
Views: top, from straight above; front, from above and behind the first pose of the trajectory; follow, six
views from above and behind poses along the trajectory, in one image.
Colours: rgb; height, low blue to high red; class, as labelled by the segmentation network; provenance,
measured grey, reprojected (seen in another image) green, inpainted magenta.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

constexpr double kUsualSpacing = 0.02;  // metres; point spacing of a map that does not state it

struct Arguments {
  std::string map;
  std::string out;
  std::string view = "top";
  std::string colour = "rgb";
  std::string trajectory;
  std::vector<int> size{1280, 720};
  double point_size = 0.0;
  bool no_inpainted = false;
};

SurfaceMap read_map(const Arguments& arguments) {
  SurfaceMap surface = read_surface_ply(
      file_in(arguments.map, {"dense.ply"}, "give a PLY file or the folder of a run with a dense map"));
  if (arguments.no_inpainted) surface = without_inpainted(surface);
  if (surface.points.empty())
    throw InputError(arguments.map + ": there are no points to draw; give another map");
  return surface;
}

Trajectory read_poses(const Arguments& arguments) {
  namespace fs = std::filesystem;
  const fs::path map = arguments.map;
  const fs::path folder = fs::is_directory(map) ? map : map.parent_path();
  const fs::path given =
      arguments.trajectory.empty() ? folder / "trajectory.txt" : fs::path(arguments.trajectory);
  return read_trajectory(file_in(given, {"trajectory.txt"}, "name the trajectory file itself")).trajectory;
}

// Views from poses along the trajectory, in rows of three.
cv::Mat follow(const SurfaceMap& surface, const Trajectory& poses, const cv::Size& size, MapColour colour,
               double point_size) {
  constexpr int kColumns = 3, kRows = 2;
  const cv::Size part(size.width / kColumns, size.height / kRows);
  cv::Mat sheet(part.height * kRows, part.width * kColumns, CV_8UC3);
  for (int i = 0; i < kColumns * kRows; ++i) {
    const std::size_t at = (poses.size() - 1) * static_cast<std::size_t>(i) / (kColumns * kRows);
    const Viewpoint view = front_view(poses[at].T_world_camera, part);
    const cv::Rect place({i % kColumns * part.width, i / kColumns * part.height}, part);
    draw_surface(surface, view, colour, point_size).copyTo(sheet(place));
  }
  return sheet;
}

void run(const Arguments& arguments) {
  const SurfaceMap surface = read_map(arguments);
  const cv::Size size(arguments.size[0], arguments.size[1]);
  const MapColour colour = *map_colour_from(arguments.colour);
  const double spacing = surface.spacing > 0.0 ? surface.spacing : kUsualSpacing;
  const double point_size = arguments.point_size > 0.0 ? arguments.point_size : spacing;
  cv::Mat image;
  if (arguments.view == "top") {
    image = draw_surface(surface, top_view(surface, size), colour, point_size);
  } else {
    const Trajectory poses = read_poses(arguments);
    image = arguments.view == "follow"
                ? follow(surface, poses, size, colour, point_size)
                : draw_surface(surface, front_view(poses.front().T_world_camera, size), colour, point_size);
  }
  write_image_fast(arguments.out, image);
  std::printf("drew %zu points: %s\n", surface.points.size(), arguments.out.c_str());
  require_written_output();
}
}  // namespace

void add_render_command(CLI::App& program) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("render", "Render a dense map to an image");
  command->footer(kExamples);
  command->add_option("MAP", arguments->map, "Dense map (PLY), or folder of a run: its dense.ply")
      ->required();
  command->add_option("--out", arguments->out, "Image file to write, PNG or JPEG")
      ->required()
      ->check(replaces_only_images());
  command->add_option("--view", arguments->view, "Viewpoint: top, front or follow")
      ->check(CLI::IsMember({"top", "front", "follow"}))
      ->capture_default_str();
  command->add_option("--colour", arguments->colour, "What the colour of a point shows")
      ->check(CLI::IsMember(map_colour_names()))
      ->capture_default_str();
  command->add_option("--trajectory", arguments->trajectory,
                      "Poses for front and follow (TUM format), or folder of a run; default trajectory.txt "
                      "beside MAP");
  command->add_option("--size", arguments->size, "Width and height of the image, pixels")
      ->expected(2)
      ->check(CLI::Range(16, 16384))
      ->capture_default_str();
  command
      ->add_option("--point-size", arguments->point_size,
                   "Side of a drawn point, metres; default the voxel size of the map")
      ->check(CLI::PositiveNumber);
  command->add_flag("--no-inpainted,--no-invented", arguments->no_inpainted, "Leave out inpainted points");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
