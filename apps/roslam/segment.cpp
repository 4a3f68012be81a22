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

#include "apps/roslam/commands.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/progress.hpp"
#include "roslam/error.hpp"
#include "roslam/evaluation/markdown_table.hpp"
#include "roslam/evaluation/statistics.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/sources/picture_source.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {

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
  bool json = false;
};

// What was found over all pictures.
struct Findings {
  std::size_t pictures = 0;
  double pixels = 0.0;
  std::array<double, kClasses> areas{};        // pixels
  std::array<double, kClasses> confidences{};  // weighted by area
  std::vector<double> milliseconds;

  void add(const Segmentation& segmentation) {
    ++pictures;
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

std::set<fs::path> folders_of_pictures(const std::vector<std::string>& inputs) {
  std::set<fs::path> folders;
  for (const fs::path path : inputs) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
      for (const auto& file : pictures_in(path)) folders.insert(file.parent_path());
    } else {
      folders.insert(fs::absolute(path).parent_path());
    }
  }
  return folders;
}

// Labels and overlays are named as the pictures: in their folder they would replace them.
void protect_inputs(const SegmentArguments& arguments) {
  for (const auto& folder : folders_of_pictures(arguments.inputs)) {
    for (const auto& written : {arguments.out, arguments.out / "overlay"}) {
      std::error_code error;
      if ((written == arguments.out || arguments.overlay) && fs::equivalent(folder, written, error)) {
        throw OutputError(written.string() +
                          ": holds the pictures, which labels could replace; choose another --out");
      }
    }
  }
}

fs::path model_of(const SegmentArguments& arguments) {
  if (!arguments.model.empty()) return arguments.model;
  const fs::path shipped = shipped_segmentation_model();
  if (shipped.empty()) throw missing_segmentation_model();
  return shipped;
}

Json summary_json(const SegmentArguments& arguments, const fs::path& model, const Findings& found,
                  const PictureSource& source, bool interrupted) {
  Json json{{"classes", arguments.classes}, {"out", arguments.out.string()},
            {"model", model.string()},      {"working_side", arguments.options.working_side},
            {"pictures", found.pictures},   {"interrupted", interrupted},
            {"skipped", source.skipped()},  {"processor_milliseconds", median(found.milliseconds)},
            {"by_class", Json::object()}};
  for (std::size_t c = 0; c < kClasses; ++c) {
    json["by_class"][std::string(class_name(static_cast<int>(c)))] = {{"share", found.share(c)},
                                                                      {"confidence", found.confidence(c)}};
  }
  return json;
}

void print_summary(const SegmentArguments& arguments, const Findings& found, const PictureSource& source) {
  std::vector<TableRow> rows{{"class", "share of pixels", "confidence"}};
  for (std::size_t c = 0; c < kClasses; ++c) {
    if (found.areas[c] > 0.0) {
      rows.push_back({std::string(class_name(static_cast<int>(c))), fixed(found.share(c), 4),
                      fixed(found.confidence(c), 2)});
    }
  }
  std::cout << markdown_table(rows) << "\n";
  std::cout << "labelled " << found.pictures << " pictures, median " << fixed(median(found.milliseconds), 1)
            << " ms of processor time from image to labels\n";
  for (const auto& [reason, count] : source.skipped())
    std::cout << "skipped " << count << ": " << reason << "\n";
  std::cout << "results: " << arguments.out.string() << "\n";
}

Findings label_all(const SegmentArguments& arguments, const LabelSet& set, PictureSource& source,
                   Segmenter& segmenter, const std::stop_token& stop) {
  Findings found;
  Progress progress(source.size(), arguments.quiet || arguments.json);
  while (!stop.stop_requested()) {
    const auto picture = source.next();
    if (!picture) break;
    const Segmentation segmentation = segmenter.segment(picture->image);
    found.add(segmentation);
    write_picture(arguments.out / (picture->name + ".png"), relabel(segmentation.labels, set));
    if (arguments.overlay) {
      write_picture(arguments.out / "overlay" / (picture->name + ".jpg"),
                    label_overlay(picture->image, segmentation.labels));
    }
    progress.show(found.pictures, "labelled");
  }
  return found;
}

void segment(const SegmentArguments& arguments) {
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // FFmpeg's own lines say less than ours
  const InterruptWatcher interrupt;
  const LabelSet set = *label_set_from(arguments.classes);
  const fs::path model = model_of(arguments);
  PspnetSegmenter segmenter(model, arguments.options, arguments.backend);
  const auto source = open_pictures({arguments.inputs.begin(), arguments.inputs.end()});
  protect_inputs(arguments);
  make_folder(arguments.overlay ? arguments.out / "overlay" : arguments.out);
  const Findings found = label_all(arguments, set, *source, segmenter, interrupt.token());
  const bool interrupted = interrupt.token().stop_requested();
  if (found.pictures == 0 && !interrupted) {
    throw InputError(arguments.inputs.front() + ": no picture could be labelled" +
                     in_words(source->skipped()) + "; check the files");
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
  CLI::App* command =
      program.add_subcommand("segment", "Label every pixel of pictures: road, building, person, car ...");
  command->footer(
      "Examples:\n"
      "  roslam segment street.jpg --out labels --overlay\n"
      "  roslam segment rgbd_dataset_freiburg3_walking_xyz --out labels --classes person\n"
      "  roslam segment flight.mp4 --out labels --overlay --working-side 512\n"
      "DIR then holds a PNG of labels for each picture, named as it, labels.json (classes, areas, speed) "
      "and, with\n"
      "--overlay, pictures with the labels drawn over them. Classes of the labels: cityscapes19 (0-18), "
      "groups8 (flat,\n"
      "building, pole, nature, sky, person, car, bicycle; 0-7), camvid11 (0-10), person (255, else 0).");
  command
      ->add_option("INPUT", arguments->inputs,
                   "Pictures, folders of pictures, TUM RGB-D folders, or one video")
      ->required();
  command->add_option("--out", arguments->out, "Folder the labels are written to; made if it does not exist")
      ->required();
  command->add_option("--classes", arguments->classes, "Classes of the labels")
      ->check(CLI::IsMember(label_set_names()))
      ->capture_default_str();
  command->add_flag("--overlay", arguments->overlay, "Also write pictures with the labels drawn over them");
  command->add_option("--model", arguments->model,
                      "Weights (ONNX) in place of those that come with the program");
  command
      ->add_option("--working-side", arguments->options.working_side,
                   "Longer side of the picture the network sees, in pixels: less is faster, more is finer")
      ->check(CLI::Range(32, 4096))
      ->capture_default_str();
  const std::map<std::string, InferenceBackend> backends{{"auto", InferenceBackend::kAutomatic},
                                                         {"opencv", InferenceBackend::kOpenCv},
                                                         {"onnxruntime", InferenceBackend::kOnnxRuntime}};
  command
      ->add_option("--backend", arguments->backend,
                   "What runs the network; auto is ONNX Runtime where built with it")
      ->transform(CLI::CheckedTransformer(backends).description(""))
      ->type_name("auto|opencv|onnxruntime");
  command->add_flag("--quiet", arguments->quiet, "No progress");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object");
  command->callback([arguments] { segment(*arguments); });
}

}  // namespace roslam::app
