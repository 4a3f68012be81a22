// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/places/vocabulary.hpp"

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/roslam/commands.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/progress.hpp"
#include "roslam/error.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/sources/picture_source.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Pictures = std::vector<std::vector<Descriptor>>;

struct TrainArguments {
  std::vector<std::string> inputs;
  fs::path out;
  OrbOptions orb;
  VocabularyOptions options;
  bool quiet = false;
  bool json = false;
};

Pictures describe_all(const TrainArguments& arguments, PictureSource& source, const std::stop_token& stop) {
  const OrbExtractor extractor(arguments.orb);
  Progress progress(source.size(), arguments.quiet || arguments.json);
  Pictures pictures;
  while (!stop.stop_requested()) {
    const auto picture = source.next();
    if (!picture) break;
    cv::Mat grey;
    cv::cvtColor(picture->image, grey, cv::COLOR_BGR2GRAY);
    auto& descriptors = pictures.emplace_back();
    for (const auto& feature : extractor.extract(grey)) descriptors.push_back(feature.descriptor);
    progress.show(pictures.size(), "described");
  }
  return pictures;
}

void train(const TrainArguments& arguments) {
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // FFmpeg's own lines say less than ours
  arguments.options.validate();
  const InterruptWatcher interrupt;
  const auto source = open_pictures({arguments.inputs.begin(), arguments.inputs.end()});
  const Pictures pictures = describe_all(arguments, *source, interrupt.token());
  if (interrupt.token().stop_requested()) throw InputError("interrupted; no vocabulary was written");
  const Vocabulary vocabulary = [&] {
    constexpr std::size_t kSteps = 1000;
    Progress progress(kSteps, arguments.quiet || arguments.json);
    return Vocabulary::train(pictures, arguments.options, [&](double share) {
      progress.show(static_cast<std::size_t>(share * kSteps), "of 1000 parts sorted");
    });
  }();
  vocabulary.save(arguments.out);
  std::size_t descriptors = 0;
  for (const auto& picture : pictures) descriptors += picture.size();
  const Json summary{
      {"out", arguments.out.string()}, {"words", vocabulary.words()}, {"bytes", fs::file_size(arguments.out)},
      {"pictures", pictures.size()},   {"descriptors", descriptors},  {"skipped", source->skipped()}};
  if (arguments.json) {
    std::cout << summary.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    for (const auto& [reason, count] : source->skipped())
      std::cout << "skipped " << count << ": " << reason << "\n";
    std::cout << vocabulary.words() << " words from " << descriptors << " points of " << pictures.size()
              << " pictures\nresults: " << arguments.out.string() << "\n";
  }
  require_written_output();
}

void add_train_command(CLI::App& vocabulary) {
  const auto arguments = std::make_shared<TrainArguments>();
  CLI::App* command = vocabulary.add_subcommand("train", "Make a vocabulary from pictures");
  command->footer(
      "Example:\n"
      "  roslam vocabulary train flights/rgb photographs --out my_vocabulary.bin\n"
      "A thousand pictures of what the camera will see make a good one. The same pictures, options and seed "
      "make the\nsame file.");
  command
      ->add_option("IMAGES", arguments->inputs,
                   "Pictures, folders of pictures, TUM RGB-D folders, or one video")
      ->required();
  command->add_option("--out", arguments->out, "File the vocabulary is written to")->required();
  command->add_option("--features", arguments->orb.features, "Points of a picture")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  command->add_option("--branching", arguments->options.branching, "Children of a node of the tree")
      ->check(CLI::Range(2, 64))
      ->capture_default_str();
  command
      ->add_option("--depth", arguments->options.depth, "Levels of the tree; branching^depth words at most")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "Of the first medians")->capture_default_str();
  command->add_flag("--quiet", arguments->quiet, "No progress");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object");
  command->callback([arguments] { train(*arguments); });
}
}  // namespace

void add_vocabulary_command(CLI::App& program) {
  CLI::App* vocabulary =
      program.add_subcommand("vocabulary", "Words that pictures of one place have in common");
  vocabulary->require_subcommand(1);
  add_train_command(*vocabulary);
}

}  // namespace roslam::app
