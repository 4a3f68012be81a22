// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/roslam/commands.hpp"
#include "apps/roslam/output.hpp"
#include "roslam/cloud/map_picture.hpp"
#include "roslam/cloud/surface_file.hpp"
#include "roslam/error.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

namespace {
constexpr auto kExamples = R"(Examples:
  roslam render dense.ply --out top.png
  roslam render dense.ply --view front --colour provenance --out front.png
  roslam render dense.ply --view follow --trajectory run/trajectory.txt --out flight.png
  roslam render cloud.ply --point-size 0.01 --out cloud.png

MAP is a PLY file, RO-SLAM's or another's. Its level surfaces tell what is up. Views: top, from straight above; front,
from above and behind the first pose; follow, a sheet of six views from above and behind poses along the flight.
Colours: rgb, height, class (as the segmentation network labels), provenance (measured grey, seen at another time green,
invented magenta).
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

constexpr double kUsualSpacing = 0.02;  // metres between points of a map that does not tell

struct Arguments {
  std::string map;
  std::string out;
  std::string view = "top";
  std::string colour = "rgb";
  std::string trajectory;
  std::vector<int> size{1280, 720};
  double point_size = 0.0;
  bool no_invented = false;
};

Surface read_map(const Arguments& arguments) {
  Surface surface = read_surface_ply(arguments.map);
  if (arguments.no_invented) surface = without_invented(surface);
  if (surface.points.empty())
    throw InputError(arguments.map + ": there are no points to draw; give another map");
  return surface;
}

Trajectory read_flight(const Arguments& arguments) {
  const auto beside = std::filesystem::path(arguments.map).parent_path() / "trajectory.txt";
  return read_trajectory(arguments.trajectory.empty() ? beside : std::filesystem::path(arguments.trajectory))
      .trajectory;
}

// Views from poses along the flight, in rows of three.
cv::Mat follow(const Surface& surface, const Trajectory& flight, const cv::Size& size, MapColour colour,
               double point_size) {
  constexpr int kColumns = 3, kRows = 2;
  const cv::Size part(size.width / kColumns, size.height / kRows);
  cv::Mat sheet(part.height * kRows, part.width * kColumns, CV_8UC3);
  for (int i = 0; i < kColumns * kRows; ++i) {
    const std::size_t at = (flight.size() - 1) * static_cast<std::size_t>(i) / (kColumns * kRows);
    const MapView view = front_view(flight[at].T_world_camera, part);
    const cv::Rect place({i % kColumns * part.width, i / kColumns * part.height}, part);
    draw_surface(surface, view, colour, point_size).copyTo(sheet(place));
  }
  return sheet;
}

void run(const Arguments& arguments) {
  const Surface surface = read_map(arguments);
  const cv::Size size(arguments.size[0], arguments.size[1]);
  const MapColour colour = *map_colour_from(arguments.colour);
  const double spacing = surface.spacing > 0.0 ? surface.spacing : kUsualSpacing;
  const double point_size = arguments.point_size > 0.0 ? arguments.point_size : spacing;
  cv::Mat picture;
  if (arguments.view == "top") {
    picture = draw_surface(surface, top_view(surface, size), colour, point_size);
  } else {
    const Trajectory flight = read_flight(arguments);
    picture =
        arguments.view == "follow"
            ? follow(surface, flight, size, colour, point_size)
            : draw_surface(surface, front_view(flight.front().T_world_camera, size), colour, point_size);
  }
  write_picture(arguments.out, picture);
  std::printf("drew %zu points: %s\n", surface.points.size(), arguments.out.c_str());
  require_written_output();
}
}  // namespace

void add_render_command(CLI::App& program) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("render", "Draw a dense map to a picture");
  command->footer(kExamples);
  command->add_option("MAP", arguments->map, "PLY file")->required();
  command->add_option("--out", arguments->out, "Picture to write, PNG or JPEG")->required();
  command->add_option("--view", arguments->view, "top, front or follow")
      ->check(CLI::IsMember({"top", "front", "follow"}))
      ->capture_default_str();
  command->add_option("--colour", arguments->colour, "What colours show")
      ->check(CLI::IsMember(map_colour_names()))
      ->capture_default_str();
  command->add_option("--trajectory", arguments->trajectory,
                      "Flight for front and follow (TUM format); default: trajectory.txt beside MAP");
  command->add_option("--size", arguments->size, "Width and height, pixels")
      ->expected(2)
      ->check(CLI::Range(16, 16384))
      ->capture_default_str();
  command
      ->add_option("--point-size", arguments->point_size, "Metres; default: what the map says of its voxels")
      ->check(CLI::PositiveNumber);
  command->add_flag("--no-invented", arguments->no_invented, "Leave out what nobody saw");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
