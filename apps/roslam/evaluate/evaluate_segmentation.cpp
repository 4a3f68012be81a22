// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>
#include <string>

#include "apps/roslam/evaluate/evaluate.hpp"
#include "apps/roslam/support/output.hpp"
#include "evaluation/segmentation_error.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
struct Arguments {
  std::string truth;
  std::string estimate;
  std::string classes = "cityscapes19";
  std::string truth_classes;
  std::string estimate_classes;
  bool json = false;
};

void run(const Arguments& arguments) {
  const LabelSet set = *label_set_from(arguments.classes);
  const SegmentationError error = evaluate_segmentation(arguments.truth, arguments.estimate, set,
                                                        arguments.truth_classes, arguments.estimate_classes);
  std::cout << (arguments.json ? to_json(error, set.name) : to_markdown(error));
  require_written_output();
}
}  // namespace

void add_evaluate_segmentation_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand("segmentation", "Compare label images with the true ones");
  const auto arguments = std::make_shared<Arguments>();
  const CLI::IsMember known(label_set_names());
  command
      ->add_option("--truth", arguments->truth,
                   "Folder of true label images (PNG), or one with them in labels/")
      ->required()
      ->type_name("DIR");
  command->add_option("--estimate", arguments->estimate, "Folder of label images (PNG) with the same names")
      ->required()
      ->type_name("DIR");
  command->add_option("--classes", arguments->classes, "Classes to score")
      ->check(known)
      ->capture_default_str();
  command
      ->add_option("--truth-classes", arguments->truth_classes,
                   "Classes of the true labels; default as found, see below")
      ->check(known);
  command
      ->add_option("--estimate-classes", arguments->estimate_classes,
                   "Classes of the estimated labels; default as found, see below")
      ->check(known);
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout instead of a table");
  command->footer(
      "Example, labels of 19 classes scored in eight groups:\n"
      "  roslam segment val/images --out labels\n"
      "  roslam evaluate segmentation --truth val/labels --estimate labels --classes groups8\n"
      "Prints IoU, recall and precision by class, mean IoU and pixel accuracy.\n"
      "The classes of a folder are those of its labels.json (roslam segment writes it), else they are\n"
      "inferred from the values: labels of the 19 Cityscapes classes are recognised and grouped. For\n"
      "--classes person any value but 0 is a person.\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
