// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "apps/roslam/evaluate/evaluate.hpp"
#include "apps/roslam/support/named_path.hpp"
#include "apps/roslam/support/output.hpp"
#include "evaluation/odometry_error.hpp"
#include "recording/odometry_file.hpp"
#include "recording/recorded_run.hpp"
#include "roslam/common/error.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
constexpr auto kExamples = R"(Examples:
  A simulated flight, whose run folder has the truth:
    roslam run simulated:street --traffic none --out street
    roslam evaluate odometry street
  A recording with ground truth, and two mounts compared, for a script:
    roslam evaluate odometry level=run-1 tilted=run-2 --truth rgbd_dataset_freiburg1_rpy --json

Reads odometry.csv and run.json of each run; groundtruth.txt has camera poses, T_body_camera of run.json leads to
the body. Steps are from frame to frame within one value of the reset counter. The true velocity is the central
difference of the true poses. The delay is the shift of the true velocity that fits best, "-" where the velocity
changes too little to tell. NEES is that of the velocity against its covariance: 6 where the covariance is right;
below and above are the shares of frames outside the two-sided 99 % bounds. The correction is the largest step of
the pose in the map that T_map_odom carries. The tilt is that of the map's z axis against the truth's.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

struct Arguments {
  std::vector<std::string> runs;
  std::string truth;
  bool json = false;
};

EvaluatedOdometry evaluate(const NamedPath& run, const std::string& truth_of_all) {
  const std::filesystem::path truth_file =
      file_in(truth_of_all.empty() ? run.path : std::filesystem::path(truth_of_all), {"groundtruth.txt"},
              "name the true trajectory with --truth");
  const auto odometry = recording::read_odometry(run.path / "odometry.csv");
  const Camera camera = recording::camera_of_run(run.path);
  try {
    return {run.name,
            evaluate_odometry(read_trajectory(truth_file).trajectory, odometry, camera.T_body_camera)};
  } catch (const InputError& error) {
    throw InputError((run.path / "odometry.csv").string() + ": " + error.what());
  }
}

void run(const Arguments& arguments) {
  std::vector<NamedPath> runs = parse_named(arguments.runs);
  make_names_unique({&runs});
  std::vector<EvaluatedOdometry> evaluated;
  for (const NamedPath& one : runs) evaluated.push_back(evaluate(one, arguments.truth));
  std::cout << (arguments.json ? to_json(evaluated) : to_markdown(evaluated));
  require_written_output();
}
}  // namespace

void add_evaluate_odometry_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand(
      "odometry", "Compare the odometry of runs, its velocities and covariances with the truth");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("RUN", arguments->runs, "Run folders, also as NAME=FOLDER")
      ->required()
      ->type_name("DIR");
  command
      ->add_option(
          "--truth", arguments->truth,
          "True camera poses (TUM format) or a folder with groundtruth.txt; default that of each run")
      ->type_name("FILE");
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout instead of a table");
  command->footer(kExamples);
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
