// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>
#include <string>

#include "apps/roslam/evaluate.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/removal_evaluation.hpp"
#include "roslam/error.hpp"

namespace roslam::app {

namespace {
constexpr auto kExamples = R"(Examples:
  People composed into a recording:
    roslam compose rgbd_dataset_freiburg1_rpy --camera tum-fr1 --people people --out rpy_people
    roslam run rpy_people --camera rpy_people/camera.yaml --out with_people
    roslam evaluate removal rpy_people --camera rpy_people/camera.yaml --run with_people
  A simulated flight, with the same --traffic, --frames and --seed as its run; for a script:
    roslam run simulated:street --traffic heavy --frames 300 --out street
    roslam evaluate removal simulated:street --traffic heavy --frames 300 --run street --json

The points that each frame has without a mask are held against the mask that the run left in masks/. Of those on
actors, the things that really move, some survive; of those on the static scene, what is removed is removed
wrongly. What can move but rests, such as parked cars, is right either way.
A TUM folder knows what moves by images named as those of colour (PNG):
  instances/ (16 bit)     nonzero on an actor; labels/ beside it tells what can move but rests
  labels/ alone (8 bit)   numbers of actors, 0 = none; or classes (Cityscapes train ids, 255 = none), of which
                          all that can move are taken to be actors
Ctrl-C ends it early and prints what was compared so far.
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
        ": does not know what moves in it: it holds no true instances/ or labels/; roslam compose "
        "and roslam simulate make sequences that do");
  }
  std::cout << (arguments.json ? to_json(*error) : to_markdown(*error));
  require_written_output();
}
}  // namespace

void add_evaluate_removal_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand(
      "removal", "Measure how well a run removed the points on things that move, where the truth is known.");
  const auto arguments = std::make_shared<Arguments>();
  add_source_options(*command, arguments->source)->required();
  command->add_option("--run", arguments->run, "Folder that roslam run wrote, from the same source")
      ->required()
      ->type_name("DIR");
  add_flight_options(*command, arguments->source);
  command->add_flag("--json", arguments->json, "Print one JSON object instead of a table");
  command->add_flag("--quiet", arguments->quiet, "No progress");
  command->footer(kExamples);
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
