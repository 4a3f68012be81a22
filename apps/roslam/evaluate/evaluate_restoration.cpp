// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>

#include "apps/roslam/evaluate/evaluate.hpp"
#include "apps/roslam/evaluate/restoration_evaluation.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam::app {

using namespace evaluation;

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

Images are paired by timestamp, or by name if one of both is a plain folder of images. PSNR, SSIM and absolute
error are computed inside the holes and averaged over the images; holes below 100 pixels are left out. Depth
is compared where both have it and camera.yaml or --truth-depth-units states the units.
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
  if (const auto model = find_segmentation_model(); arguments.labels && !model.empty())
    segmenter = std::make_unique<PspnetSegmenter>(model);
  settings.segmenter = segmenter.get();
  const RestorationError error = evaluate_restoration(settings);
  std::cout << (arguments.json ? to_json(error) : to_markdown(error));
  require_written_output();
}
}  // namespace

void add_evaluate_restoration_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand(
      "restoration", "Compare the filled holes of restored images with the true background");
  const auto arguments = std::make_shared<Arguments>();
  RestorationEvaluationSettings& settings = arguments->settings;
  command
      ->add_option(
          "--truth", settings.truth,
          "Images without dynamic objects: a TUM RGB-D folder, a folder of roslam compose or simulate, "
          "or a folder of images")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--estimate", settings.estimate,
                   "Restored images: a folder of roslam restore, or a folder of images")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--masks", settings.masks,
                   "Masks (PNG) with the names of the restored images, nonzero where these were restored; "
                   "default provenance/ of the estimate")
      ->type_name("DIR");
  command
      ->add_option("--truth-depth-units", arguments->truth_depth_units,
                   "Value of the true depth images at one metre; default as stated beside them")
      ->check(CLI::PositiveNumber);
  command->add_option("--every", settings.every, "Compare every N-th image")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("!--no-labels", arguments->labels,
                    "Do not test with the segmentation network whether inpainted pixels look movable");
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout instead of a table");
  command->add_flag("--quiet", settings.quiet, "Print no progress");
  command->footer(kExamples);
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
