// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>
#include <string>

#include "apps/roslam/evaluate/evaluate.hpp"
#include "apps/roslam/evaluate/removal_evaluation.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "roslam/common/error.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
constexpr auto kExamples = R"(Examples:
  People composed into a recording:
    roslam compose rgbd_dataset_freiburg1_rpy --camera tum-fr1 --people people --out rpy_people
    roslam run rpy_people --camera rpy_people/camera.yaml --out with_people
    roslam evaluate removal rpy_people --camera rpy_people/camera.yaml --run with_people
  A simulated flight, with the same --traffic, --frames and --seed as its run; for a script:
    roslam run simulated:street --traffic heavy --frames 300 --out street
    roslam evaluate removal simulated:street --traffic heavy --frames 300 --run street --json

The ORB points of each frame, extracted without a mask, are compared with the mask of the run in masks/.
Actors are the objects that move: points on them should be removed, points on the static scene kept. Points on
movable objects at rest, such as parked cars, count neither way.
The truth of a TUM RGB-D folder is in images with the names of the colour images (PNG):
  instances/ (16 bit)     nonzero on an actor; labels/ beside it marks movable objects at rest
  labels/ alone (8 bit)   numbers of actors, 0 = none; or classes (Cityscapes train ids, 255 = none), of which
                          all movable ones count as actors
Ctrl-C ends it early and prints the results so far.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

struct Arguments {
  SourceArguments source;
  std::string run;
  bool json = false;
  bool quiet = false;
};

void run(const Arguments& arguments) {
  const InterruptWatcher interrupt;
  const auto error = evaluate_removal_of_run(arguments.source, arguments.run,
                                             {interrupt.token(), arguments.quiet || arguments.json});
  if (!error) {
    throw InputError(
        arguments.source.name +
        ": has no truth of the dynamic objects, neither instances/ nor true labels/; roslam compose "
        "and roslam simulate write sequences with it");
  }
  std::cout << (arguments.json ? to_json(*error) : to_markdown(*error));
  require_written_output();
}
}  // namespace

void add_evaluate_removal_command(CLI::App& evaluate) {
  auto* command =
      evaluate.add_subcommand("removal", "Compare the points a run removed with the true dynamic objects");
  const auto arguments = std::make_shared<Arguments>();
  add_source_options(*command, arguments->source)->required();
  command->add_option("--run", arguments->run, "Folder of a run of the same source")
      ->required()
      ->type_name("DIR");
  add_flight_options(*command, arguments->source);
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout instead of a table");
  command->add_flag("--quiet", arguments->quiet, "Print no progress");
  command->footer(kExamples);
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
