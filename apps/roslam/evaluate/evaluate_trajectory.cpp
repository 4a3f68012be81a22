// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "apps/roslam/evaluate/evaluate.hpp"
#include "apps/roslam/support/named_path.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "evaluation/trajectory_error.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "evaluation/trajectory_report.hpp"
#include "roslam/common/error.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;

constexpr auto kExamples = R"(Examples:
  How accurate is a run?
    roslam evaluate trajectory --truth sequences/desk --estimate runs/desk
  The median of several runs, compared with another system, with a figure:
    roslam evaluate trajectory --truth sequences/desk --estimate runs/desk-1 runs/desk-2 runs/desk-3 \
        --against orb-slam2=results/orb.txt --plot desk.png
  A monocular system, whose scale is unknown, for a script:
    roslam evaluate trajectory --truth sequences/desk --estimate mono.txt --scale --json | jq .median.ate_rmse_m

Trajectories are text files with one pose T_world_camera per line: timestamp tx ty tz qx qy qz qw (seconds,
metres, unit quaternion). For a folder its groundtruth.txt (truth) or trajectory.txt (estimate) is read.
The absolute trajectory error (ATE) is the distance of each position from the truth after SE(3) alignment of
the whole trajectory; the relative pose error (RPE) compares the motion from frame to frame and over one
second.
Exit code: 0 success, 1 an error in the input or a file that cannot be written, 2 wrong usage.)";

struct Arguments {
  std::string truth;
  std::vector<std::string> estimates;
  std::vector<std::string> others;
  std::string plot;
  WorldUp up = WorldUp::kUnknown;
  bool json = false;
  bool scale = false;
  TrajectoryErrorOptions options;
};

constexpr const char* kRemedy = "name the trajectory file itself";

std::vector<NamedPath> parse_all(const std::vector<std::string>& arguments) {
  std::vector<NamedPath> all = parse_named(arguments);
  for (auto& named : all) named.path = file_in(named.path, {"trajectory.txt"}, kRemedy);
  return all;
}

TrajectoryFile read_and_note(const fs::path& file) {
  auto read = read_trajectory(file);
  if (read.skipped > 0) {
    std::cerr << "note: " << file.string() << ": " << read.skipped
              << " lines left out (values that are not finite, no unit quaternion, or a repeated time)\n";
  }
  return read;
}

std::vector<EvaluatedTrajectory> evaluate_all(const Trajectory& truth, const std::vector<NamedPath>& files,
                                              const TrajectoryErrorOptions& options) {
  std::vector<EvaluatedTrajectory> all;
  for (const auto& [name, file] : files) {
    const auto read = read_and_note(file);
    try {
      all.push_back(
          {name, file.string(), read.skipped, evaluate_trajectory(truth, read.trajectory, options)});
    } catch (const InputError& error) {
      throw InputError(file.string() + ": " + error.what());
    }
  }
  return all;
}

void draw(const Arguments& arguments, const Trajectory& truth, const TrajectoryReport& report) {
  std::vector<NamedTrajectoryError> curves;
  for (const auto* list : {&report.runs, &report.others}) {
    for (const auto& trajectory : *list) curves.push_back({trajectory.name, trajectory.error});
  }
  write_png(arguments.plot, plot_trajectory_errors(truth, curves, arguments.up));
}

void run(const Arguments& arguments) {
  TrajectoryReport report;
  report.options = arguments.options;
  report.options.alignment = arguments.scale ? AlignmentModel::kSimilarity : AlignmentModel::kRigid;
  const fs::path truth_file = file_in(arguments.truth, {"groundtruth.txt", "trajectory.txt"}, kRemedy);
  const Trajectory truth = read_and_note(truth_file).trajectory;
  report.truth_file = truth_file.string();
  auto estimates = parse_all(arguments.estimates);
  auto others = parse_all(arguments.others);
  make_names_unique({&estimates, &others});
  report.runs = evaluate_all(truth, estimates, report.options);
  report.others = evaluate_all(truth, others, report.options);
  // The figure first, so that nothing is on stdout if it cannot be written.
  if (!arguments.plot.empty()) draw(arguments, truth, report);
  std::cout << (arguments.json ? to_json(report) : to_markdown(report));
  require_written_output();
}

// Values the library would refuse are usage errors here (exit code 2). Empty if there are none.
std::string check_options(const Arguments& arguments) {
  try {
    arguments.options.validate();
    return "";
  } catch (const OptionsError& error) {
    return error.what();
  }
}
}  // namespace

void add_evaluate_trajectory_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand("trajectory", "Compare estimated trajectories with the true one");
  const auto arguments = std::make_shared<Arguments>();
  command
      ->add_option("--truth", arguments->truth,
                   "True trajectory (TUM format), or a folder with groundtruth.txt")
      ->required()
      ->type_name("FILE");
  command
      ->add_option(
          "--estimate", arguments->estimates,
          "Estimated trajectories or run folders, also as NAME=FILE; for several runs the median is added")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--against", arguments->others,
                   "Trajectories of other systems, also as NAME=FILE; not part of the median")
      ->type_name("FILE");
  command->add_option("--plot", arguments->plot, "Draw the trajectories and their errors to this PNG file")
      ->type_name("FILE.png")
      ->check(replaces_only_images());
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout instead of tables");
  command->add_flag("--scale", arguments->scale, "Align with scale, Sim(3), for monocular estimates");
  auto& association = arguments->options.association;
  command
      ->add_option("--max-time-difference", association.max_time_difference,
                   "Largest time difference of associated poses, seconds")
      ->capture_default_str()
      ->type_name("SECONDS");
  command->add_flag("--interpolate", association.interpolate,
                    "Compare with the truth interpolated in time instead of its nearest pose");
  const std::map<std::string, WorldUp> views{
      {"auto", WorldUp::kUnknown}, {"xy", WorldUp::kZ}, {"xz", WorldUp::kMinusY}};
  command
      ->add_option("--view", arguments->up,
                   "Plane of the figure: auto (the widest), xy (z is up) or xz (y is down)")
      ->transform(CLI::CheckedTransformer(views).description(""))
      ->type_name("auto|xy|xz");
  command->footer(kExamples);
  command->callback([arguments] {
    if (const auto problem = check_options(*arguments); !problem.empty()) {
      throw CLI::ValidationError("--max-time-difference", problem);
    }
    run(*arguments);
  });
}

}  // namespace roslam::app
