// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/tum_writer.hpp"
#include "recording/output_folder.hpp"
#include "roslam/common/formatted.hpp"
#include "roslam/common/write_file.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam::app {

using namespace simulation;
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct SimulateArguments {
  std::string path;
  fs::path out;
  std::string traffic = "light";
  std::string depth = "d455";
  std::size_t frames = 0;
  std::uint32_t seed = 1;
  bool imu = false;
  bool stereo = false;
  bool overwrite = false;
  bool json = false;
};

constexpr const char* kHelp =
    R"(Houses, trees, cars and people are generated from the seed; nothing is downloaded.
The output is a TUM RGB-D folder for roslam run, of the camera preset simulated.

Example, ten seconds with many cars and people:
  roslam simulate street --traffic heavy --frames 300 --out flight

Writes to the folder of --out; images are named after their timestamp in seconds:
  rgb/ rgb.txt            colour
  depth/ depth.txt        depth, 16 bit, 1000 per metre, 0 = unknown
  imu.txt                 with --imu: timestamp (s), turn rates (rad/s), accelerations (m/s^2)
  groundtruth.txt         camera poses: timestamp (s), position (m), quaternion x y z w
  camera.yaml             camera parameters, for --camera of roslam run
  image_2/ image_3/ calib.txt times.txt poses.txt
                          with --stereo: left and right images and poses, in the layout of KITTI odometry;
                          roslam run takes these then
  labels/                 8 bit: class of each pixel, Cityscapes train ids, 255 = none of them
  instances/              16 bit: number of the moving object, 0 = none
  background/rgb, depth   the same images without movable objects, parked cars included

Ctrl-C ends it early and keeps the frames written so far.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

std::string pose_line(double timestamp, const SE3& pose) {
  const auto& t = pose.translation();
  const auto& q = pose.rotation();
  char text[256];
  std::snprintf(text, sizeof(text), "%.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f", timestamp, t.x(), t.y(), t.z(),
                q.x(), q.y(), q.z(), q.w());
  return text;
}

void write_images(const fs::path& out, const std::string& name, const SimulatedView& view,
                  const Camera& camera) {
  write_image_fast(out / "rgb" / name, view.frame.colour);
  write_image_fast(out / "depth" / name, packed_depth(view.frame.depth, camera.depth_units_per_metre));
  write_image_fast(out / "labels" / name, view.frame.labels);
  write_image_fast(out / "instances" / name, view.instances);
  write_image_fast(out / "background" / "rgb" / name, view.background_colour);
  write_image_fast(out / "background" / "depth" / name,
                   packed_depth(view.background_depth, camera.depth_units_per_metre));
}

// The lists of KITTI odometry: P2 and P3 project from the frame of the left camera.
class StereoFiles {
 public:
  StereoFiles(const fs::path& out, const Camera& camera)
      : out_(out), times_(out / "times.txt"), poses_(out / "poses.txt") {
    for (const char* folder : {"image_2", "image_3"}) make_folder(out / folder);
    TextFile calibration(out / "calib.txt");
    for (const auto& [name, x] : {std::pair{"P2", 0.0}, std::pair{"P3", -camera.fx * camera.baseline}}) {
      char text[256];
      std::snprintf(text, sizeof(text), "%s: %.9f 0 %.9f %.9f 0 %.9f %.9f 0 0 0 1 0", name, camera.fx,
                    camera.cx, x, camera.fy, camera.cy);
      calibration.line(text);
    }
    calibration.close();
  }

  void add(const Frame& frame) {
    char name[32], time[32];
    std::snprintf(name, sizeof(name), "%06zu.png", count_++);
    std::snprintf(time, sizeof(time), "%.9f", frame.timestamp);
    write_image_fast(out_ / "image_2" / name, frame.colour);
    write_image_fast(out_ / "image_3" / name, frame.right);
    times_.line(time);
    const Eigen::Matrix4d T = frame.T_world_camera->matrix();
    std::string line;
    for (int i = 0; i < 12; ++i) line += (i > 0 ? " " : "") + formatted("%.9f", T(i / 4, i % 4));
    poses_.line(line);
  }

  void close() {
    times_.close();
    poses_.close();
  }

 private:
  fs::path out_;
  TextFile times_, poses_;
  std::size_t count_ = 0;
};

void write_inertial(TextFile& file, const std::vector<InertialSample>& samples) {
  for (const auto& [time, w, a] : samples) {
    char text[256];
    std::snprintf(text, sizeof(text), "%.6f %.9f %.9f %.9f %.9f %.9f %.9f", time, w.x(), w.y(), w.z(), a.x(),
                  a.y(), a.z());
    file.line(text);
  }
}

void simulate(const SimulateArguments& arguments) {
  const InterruptWatcher interrupt;
  SimulatorOptions options;
  options.path = *flight_path_from(arguments.path);
  options.traffic = *traffic_level_from(arguments.traffic);
  options.depth = *depth_model_from(arguments.depth);
  options.frames = arguments.frames;
  options.seed = arguments.seed;
  options.imu = arguments.imu;
  options.stereo = arguments.stereo;
  const recording::OutputFolder out(
      arguments.out, "simulate",
      {"rgb.txt", "depth.txt", "groundtruth.txt", "imu.txt", "camera.yaml", "rgb", "depth", "labels",
       "instances", "background", "image_2", "image_3", "calib.txt", "times.txt", "poses.txt"},
      arguments.overwrite);
  for (const char* folder : {"rgb", "depth", "labels", "instances", "background/rgb", "background/depth"}) {
    make_folder(arguments.out / folder);
  }
  const auto start = Clock::now();
  Simulator simulator(options);
  write_file(arguments.out / "camera.yaml", camera_to_yaml(simulator.camera()));
  TextFile colours(arguments.out / "rgb.txt");
  TextFile depths(arguments.out / "depth.txt");
  TextFile poses(arguments.out / "groundtruth.txt");
  std::optional<TextFile> inertial;
  if (arguments.imu) inertial.emplace(arguments.out / "imu.txt");
  std::optional<StereoFiles> stereo;
  if (arguments.stereo) stereo.emplace(arguments.out, simulator.camera());
  if (inertial) inertial->line("# timestamp wx wy wz ax ay az");
  colours.line("# timestamp filename");
  depths.line("# timestamp filename");
  poses.line("# timestamp tx ty tz qx qy qz qw");
  Progress progress(simulator.size());
  std::size_t written = 0;
  for (; written < simulator.size() && !interrupt.token().stop_requested(); ++written) {
    const SimulatedView view = simulator.render(written, SimulatedParts::kBackground);
    const std::string time = time_text(view.frame.timestamp);
    write_images(arguments.out, time + ".png", view, simulator.camera());
    colours.line(time + " rgb/" + time + ".png");
    depths.line(time + " depth/" + time + ".png");
    poses.line(pose_line(view.frame.timestamp, *view.frame.T_world_camera));
    if (inertial) write_inertial(*inertial, view.frame.inertial);
    if (stereo) stereo->add(view.frame);
    progress.show(written + 1, "rendered");
  }
  colours.close();
  depths.close();
  poses.close();
  if (inertial) inertial->close();
  if (stereo) stereo->close();
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  if (arguments.json) {
    const nlohmann::json summary{{"out", arguments.out.string()}, {"path", arguments.path},
                                 {"traffic", arguments.traffic},  {"depth", arguments.depth},
                                 {"seed", arguments.seed},        {"frames", written},
                                 {"fps", simulator.camera().fps}, {"seconds", seconds}};
    std::cout << summary.dump() << "\n";
  } else {
    std::cout << "wrote " << written << " frames to " << arguments.out.string()
              << (written < simulator.size() ? ", interrupted" : "") << "\n";
  }
  require_written_output();
}

}  // namespace

void add_simulate_command(CLI::App& program) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = program.add_subcommand(
      "simulate", "Render a simulated flight of a drone through a street or a corridor, with ground truth");
  command->footer(kHelp);
  command
      ->add_option(
          "path", arguments->path,
          "Flight path: street, 50 m along a street; loop, around a block; hover, turning on the spot; turn, "
          "around a corner; corridor, in a building with white walls and repeated tiles")
      ->required()
      ->check(CLI::IsMember({"street", "loop", "hover", "turn", "corridor"}));
  command->add_option("--out", arguments->out, "Folder the sequence is written to; made if it does not exist")
      ->required();
  command
      ->add_option("--traffic", arguments->traffic,
                   "Amount of moving cars and people: none (parked cars only), light or heavy")
      ->check(CLI::IsMember({"none", "light", "heavy"}))
      ->capture_default_str();
  command
      ->add_option("--frames", arguments->frames,
                   "Number of frames to write, 30 per second; default the whole flight")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--depth", arguments->depth,
                   "Depth sensor: ideal, or d455 with the noise and holes of a RealSense D455")
      ->check(CLI::IsMember({"ideal", "d455"}))
      ->capture_default_str();
  command->add_option("--seed", arguments->seed, "Seed of the generated street and traffic")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--imu", arguments->imu,
                    "Write the samples of a gyroscope and an accelerometer as well, 200 Hz");
  command->add_flag("--stereo", arguments->stereo,
                    "Write the images of a second camera as well, 0.12 m to the right of the first");
  command->add_flag("--overwrite", arguments->overwrite,
                    "Replace files in the folder of --out that this command did not write");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object on stdout");
  command->callback([arguments] { simulate(*arguments); });
}

}  // namespace roslam::app
