// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>

#include "apps/roslam/evaluate.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/restoration_evaluation.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam::app {

namespace {
constexpr auto kExamples = R"(Examples:
  A simulated flight, whose background is known:
    roslam simulate street --traffic heavy --frames 300 --out street
    roslam restore street --camera simulated --out restored
    roslam evaluate restoration --truth street --estimate restored
  People composed into a recording; the truth is the recording:
    roslam compose my_room --camera d435 --people people --out with_people
    roslam restore with_people --camera with_people/camera.yaml --out restored
    roslam evaluate restoration --truth my_room --truth-depth-units 1000 --estimate restored --json

Pictures are paired by their time, or by name where one of both is a plain folder. PSNR, SSIM and absolute error
are means over the pictures of what is inside the holes; holes below 100 pixels are left out. Depth is compared where
both are known and camera.yaml, or --truth-depth-units, tells the units.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

struct Arguments {
  RestorationEvaluationSettings settings;
  double truth_depth_units = 0.0;
  bool labels = true;
  bool json = false;
};

void run(Arguments arguments) {
  const InterruptWatcher interrupt;
  RestorationEvaluationSettings& settings = arguments.settings;
  settings.stop = interrupt.token();
  settings.quiet |= arguments.json;
  if (arguments.truth_depth_units > 0.0) settings.truth_depth_units = arguments.truth_depth_units;
  std::unique_ptr<Segmenter> segmenter;
  if (const auto model = shipped_segmentation_model(); arguments.labels && !model.empty())
    segmenter = std::make_unique<PspnetSegmenter>(model);
  settings.segmenter = segmenter.get();
  const RestorationError error = evaluate_restoration(settings);
  std::cout << (arguments.json ? to_json(error) : to_markdown(error));
  require_written_output();
}
}  // namespace

void add_evaluate_restoration_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand(
      "restoration", "Compare what fills the holes of restored pictures with the truth.");
  const auto arguments = std::make_shared<Arguments>();
  RestorationEvaluationSettings& settings = arguments->settings;
  command
      ->add_option("--truth", settings.truth,
                   "Pictures without what moves: a sequence in the TUM format, what roslam compose or "
                   "simulate wrote, or "
                   "a folder of pictures")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--estimate", settings.estimate,
                   "Restored pictures: what roslam restore wrote, or a folder of pictures")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--masks", settings.masks,
                   "Images named as the restored ones (PNG), nonzero where they were restored; default the "
                   "provenance/ "
                   "of the estimate")
      ->type_name("DIR");
  command
      ->add_option("--truth-depth-units", arguments->truth_depth_units,
                   "Value of the true depth images at one metre")
      ->check(CLI::PositiveNumber);
  command->add_option("--every", settings.every, "Compare one picture in so many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("!--no-labels", arguments->labels,
                    "Do not ask the network whether what was invented may move");
  command->add_flag("--json", arguments->json, "Print one JSON object instead of a table");
  command->add_flag("--quiet", settings.quiet, "No progress");
  command->footer(kExamples);
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
