// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "apps/roslam/support/backend_option.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/image_source.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/statistics.hpp"
#include "recording/output_folder.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct SegmentArguments {
  std::vector<std::string> inputs;
  fs::path out;
  std::string classes = "cityscapes19";
  bool overlay = false;
  fs::path model;
  InferenceBackend backend = InferenceBackend::kAutomatic;
  SegmenterOptions options;
  bool quiet = false;
  bool overwrite = false;
  bool json = false;
};

// Sums over all images.
struct LabelStatistics {
  std::size_t images = 0;
  double pixels = 0.0;
  std::array<double, kClasses> areas{};        // pixels
  std::array<double, kClasses> confidences{};  // weighted by area
  std::vector<double> milliseconds;

  void add(const Segmentation& segmentation) {
    ++images;
    pixels += static_cast<double>(segmentation.labels.total());
    std::array<double, kClasses> counts{};
    for (auto it = segmentation.labels.begin<std::uint8_t>(); it != segmentation.labels.end<std::uint8_t>();
         ++it) {
      ++counts[*it];
    }
    for (std::size_t c = 0; c < kClasses; ++c) {
      areas[c] += counts[c];
      confidences[c] += counts[c] * static_cast<double>(segmentation.confidence[c]);
    }
    milliseconds.push_back(1000.0 * segmentation.seconds);
  }

  double share(std::size_t c) const { return areas[c] / pixels; }
  double confidence(std::size_t c) const { return areas[c] > 0.0 ? confidences[c] / areas[c] : 0.0; }
};

std::set<fs::path> folders_of_images(const std::vector<std::string>& inputs) {
  std::set<fs::path> folders;
  for (const fs::path path : inputs) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
      for (const auto& file : images_in(path)) folders.insert(file.parent_path());
    } else {
      folders.insert(fs::absolute(path).parent_path());
    }
  }
  return folders;
}

// Labels and overlays have the names of the images: in the same folder they would overwrite them.
void protect_inputs(const SegmentArguments& arguments) {
  for (const auto& folder : folders_of_images(arguments.inputs)) {
    for (const auto& written : {arguments.out, arguments.out / "overlay"}) {
      std::error_code error;
      if ((written == arguments.out || arguments.overlay) && fs::equivalent(folder, written, error)) {
        throw OutputError(written.string() +
                          ": holds the images, which labels could replace; choose another --out");
      }
    }
  }
}

fs::path model_of(const SegmentArguments& arguments) {
  if (!arguments.model.empty()) return arguments.model;
  const fs::path shipped = find_segmentation_model();
  if (shipped.empty()) throw missing_segmentation_model();
  return shipped;
}

Json summary_json(const SegmentArguments& arguments, const fs::path& model, const LabelStatistics& found,
                  const ImageSource& source, bool interrupted) {
  Json json{{"classes", arguments.classes}, {"out", arguments.out.string()},
            {"model", model.string()},      {"working_side", arguments.options.working_side},
            {"images", found.images},       {"interrupted", interrupted},
            {"skipped", source.skipped()},  {"processor_milliseconds", median(found.milliseconds)},
            {"by_class", Json::object()}};
  for (std::size_t c = 0; c < kClasses; ++c) {
    json["by_class"][std::string(class_name(static_cast<int>(c)))] = {{"share", found.share(c)},
                                                                      {"confidence", found.confidence(c)}};
  }
  return json;
}

void print_summary(const SegmentArguments& arguments, const LabelStatistics& found,
                   const ImageSource& source) {
  std::vector<TableRow> rows{{"class", "share of pixels", "confidence"}};
  for (std::size_t c = 0; c < kClasses; ++c) {
    if (found.areas[c] > 0.0) {
      rows.push_back({std::string(class_name(static_cast<int>(c))), fixed(found.share(c), 4),
                      fixed(found.confidence(c), 2)});
    }
  }
  std::cout << markdown_table(rows) << "\n";
  std::cout << "labelled " << found.images << " images, median " << fixed(median(found.milliseconds), 1)
            << " ms of processor time from image to labels\n";
  for (const auto& [reason, count] : source.skipped())
    std::cout << "skipped " << count << ": " << reason << "\n";
  std::cout << "results: " << arguments.out.string() << "\n";
}

LabelStatistics label_all(const SegmentArguments& arguments, recording::OutputFolder& out,
                          const LabelSet& set, ImageSource& source, Segmenter& segmenter,
                          const std::stop_token& stop) {
  LabelStatistics found;
  Progress progress(source.size(), arguments.quiet || arguments.json);
  while (!stop.stop_requested()) {
    const auto image = source.next();
    if (!image) break;
    const fs::path labels = image->name + ".png";
    const fs::path overlay = fs::path("overlay") / (image->name + ".jpg");
    out.claim(labels);
    if (arguments.overlay) out.claim(overlay);
    const Segmentation segmentation = segmenter.segment(image->image);
    found.add(segmentation);
    write_image_fast(arguments.out / labels, relabel(segmentation.labels, set));
    if (arguments.overlay) {
      write_image_fast(arguments.out / overlay, label_overlay(image->image, segmentation.labels));
    }
    progress.show(found.images, "labelled");
  }
  return found;
}

void segment(const SegmentArguments& arguments) {
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // our error message replaces FFmpeg's lines
  const InterruptWatcher interrupt;
  const LabelSet set = *label_set_from(arguments.classes);
  const fs::path model = model_of(arguments);
  PspnetSegmenter segmenter(model, arguments.options, arguments.backend);
  if (!segmenter.note().empty()) std::cerr << "note: " << segmenter.note() << "\n";
  const auto source = open_images({arguments.inputs.begin(), arguments.inputs.end()});
  protect_inputs(arguments);
  recording::OutputFolder out(arguments.out, "segment", {"labels.json"}, arguments.overwrite);
  if (arguments.overlay) make_folder(arguments.out / "overlay");
  const LabelStatistics found = label_all(arguments, out, set, *source, segmenter, interrupt.token());
  const bool interrupted = interrupt.token().stop_requested();
  if (found.images == 0 && !interrupted) {
    throw InputError(arguments.inputs.front() + ": no image could be labelled" + in_words(source->skipped()) +
                     "; check the files");
  }
  const Json summary = summary_json(arguments, model, found, *source, interrupted);
  write_file(arguments.out / "labels.json",
             summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  if (arguments.json) {
    std::cout << summary.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print_summary(arguments, found, *source);
  }
  require_written_output();
}
}  // namespace

void add_segment_command(CLI::App& program) {
  const auto arguments = std::make_shared<SegmentArguments>();
  CLI::App* command = program.add_subcommand(
      "segment", "Label each pixel of images by class: road, building, person, car ...");
  command->footer(
      "Examples:\n"
      "  roslam segment street.jpg --out labels --overlay\n"
      "  roslam segment rgbd_dataset_freiburg3_walking_xyz --out labels --classes person\n"
      "  roslam segment flight.mp4 --out labels --overlay --working-side 512\n"
      "Writes to the folder of --out a label image (PNG, 8 bit) for each image, named as it, labels.json\n"
      "(classes, share of pixels, confidence, processor time) and, with --overlay, the images with their\n"
      "labels to overlay/. Values of the labels: cityscapes19 0-18; groups8 0-7 (flat, building, pole,\n"
      "nature, sky, person, car, bicycle); camvid11 0-10; person 255, else 0.\n"
      "Ctrl-C ends it early and keeps the labels so far.\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  command
      ->add_option("INPUT", arguments->inputs, "Images, folders of images, TUM RGB-D folders, or one video")
      ->required();
  command->add_option("--out", arguments->out, "Folder the labels are written to; made if it does not exist")
      ->required();
  command->add_option("--classes", arguments->classes, "Classes of the labels written")
      ->check(CLI::IsMember(label_set_names()))
      ->capture_default_str();
  command->add_flag("--overlay", arguments->overlay, "Also write the images with the labels drawn over them");
  command->add_option("--model", arguments->model,
                      "Weights of the segmentation network (ONNX); default the shipped ones");
  command
      ->add_option("--working-side", arguments->options.working_side,
                   "Longer side of the network's input, pixels: less is faster, more is finer")
      ->check(CLI::Range(32, 4096))
      ->capture_default_str();
  add_backend_option(*command, arguments->backend);
  command->add_flag("--overwrite", arguments->overwrite,
                    "Replace files in the folder of --out that this command did not write");
  command->add_flag("--quiet", arguments->quiet, "Print no progress");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object on stdout");
  command->callback([arguments] { segment(*arguments); });
}

}  // namespace roslam::app
