// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/place_recognition/vocabulary.hpp"

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/image_source.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "roslam/common/error.hpp"
#include "roslam/features/orb_extractor.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Images = std::vector<std::vector<Descriptor>>;

struct TrainArguments {
  std::vector<std::string> inputs;
  fs::path out;
  OrbOptions orb;
  VocabularyOptions options;
  bool quiet = false;
  bool json = false;
};

Images describe_all(const TrainArguments& arguments, ImageSource& source, const std::stop_token& stop) {
  const OrbExtractor extractor(arguments.orb);
  Progress progress(source.size(), arguments.quiet || arguments.json);
  Images images;
  while (!stop.stop_requested()) {
    const auto image = source.next();
    if (!image) break;
    cv::Mat grey;
    cv::cvtColor(image->image, grey, cv::COLOR_BGR2GRAY);
    auto& descriptors = images.emplace_back();
    for (const auto& feature : extractor.extract(grey)) descriptors.push_back(feature.descriptor);
    progress.show(images.size(), "described");
  }
  return images;
}

void train(const TrainArguments& arguments) {
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // our error message replaces FFmpeg's lines
  arguments.options.validate();
  const InterruptWatcher interrupt;
  const auto source = open_images({arguments.inputs.begin(), arguments.inputs.end()});
  const Images images = describe_all(arguments, *source, interrupt.token());
  if (interrupt.token().stop_requested()) throw InputError("interrupted; no vocabulary was written");
  const Vocabulary vocabulary = [&] {
    constexpr std::size_t kSteps = 1000;
    Progress progress(kSteps, arguments.quiet || arguments.json);
    return Vocabulary::train(images, arguments.options, [&](double share) {
      progress.show(static_cast<std::size_t>(share * kSteps), "of 1000 parts clustered");
    });
  }();
  vocabulary.save(arguments.out);
  std::size_t descriptors = 0;
  for (const auto& image : images) descriptors += image.size();
  const Json summary{
      {"out", arguments.out.string()}, {"words", vocabulary.words()}, {"bytes", fs::file_size(arguments.out)},
      {"images", images.size()},       {"descriptors", descriptors},  {"skipped", source->skipped()}};
  if (arguments.json) {
    std::cout << summary.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    for (const auto& [reason, count] : source->skipped())
      std::cout << "skipped " << count << ": " << reason << "\n";
    std::cout << vocabulary.words() << " words from " << descriptors << " descriptors of " << images.size()
              << " images\nresults: " << arguments.out.string() << "\n";
  }
  require_written_output();
}

void add_train_command(CLI::App& vocabulary) {
  const auto arguments = std::make_shared<TrainArguments>();
  CLI::App* command = vocabulary.add_subcommand("train", "Train a vocabulary of ORB descriptors from images");
  command->footer(
      "Example:\n"
      "  roslam vocabulary train flights/rgb photographs --out my_vocabulary.bin\n"
      "Clusters the ORB descriptors of the images by hierarchical k-medians; the leaves of the tree are the\n"
      "words. About a thousand images of the kind the camera will see are enough. The same images, options\n"
      "and seed give the same file.\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  command
      ->add_option("IMAGES", arguments->inputs, "Images, folders of images, TUM RGB-D folders, or one video")
      ->required();
  command->add_option("--out", arguments->out, "File the vocabulary is written to")
      ->required()
      ->check(ReplacesOnly({"ROSLAMVO"}));
  command->add_option("--features", arguments->orb.features, "ORB points per image")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  command->add_option("--branching", arguments->options.branching, "Children per node of the tree")
      ->check(CLI::Range(2, 64))
      ->capture_default_str();
  command
      ->add_option("--depth", arguments->options.depth, "Levels of the tree; at most branching^depth words")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "Seed of the initial cluster centres")
      ->capture_default_str();
  command->add_flag("--quiet", arguments->quiet, "Print no progress");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object on stdout");
  command->callback([arguments] { train(*arguments); });
}
}  // namespace

void add_vocabulary_command(CLI::App& program) {
  CLI::App* vocabulary =
      program.add_subcommand("vocabulary", "Train the visual vocabulary for place recognition");
  vocabulary->require_subcommand(1);
  add_train_command(*vocabulary);
}

}  // namespace roslam::app
