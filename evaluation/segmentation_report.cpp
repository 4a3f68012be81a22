// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>

#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/segmentation_error.hpp"
#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::evaluation {

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Table = std::array<std::uint8_t, 256>;

// A folder of label images and the lookup table from their values to class indices.
struct Labels {
  fs::path folder;
  std::map<std::string, fs::path> files;  // by name without ending
  Table to_index{};
};

std::map<std::string, fs::path> label_files(const fs::path& folder) {
  std::map<std::string, fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".png") files.emplace(entry.path().stem().string(), entry.path());
  }
  return files;
}

Labels find_labels(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(folder.string() + ": no such folder of label images");
  for (const auto& candidate : {folder, folder / "labels"}) {
    if (auto files = label_files(candidate); !files.empty()) return {candidate, std::move(files), {}};
  }
  throw InputError(folder.string() + ": contains no label images (PNG)");
}

cv::Mat read_labels(const fs::path& file) {
  ImageFile read = read_label_image(file);
  if (!read.error.empty())
    throw InputError(file.string() + ": " + read.error + "; labels are 8-bit grey PNG images");
  return read.image;
}

std::string named_in_folder(const fs::path& folder) {
  std::ifstream in(folder / "labels.json");
  if (!in) return "";
  const Json json = Json::parse(in, nullptr, false);
  if (json.is_discarded() || !json.is_object() || !json.contains("classes") || !json["classes"].is_string()) {
    throw InputError((folder / "labels.json").string() +
                     ": does not say which classes the labels have; remove it");
  }
  return json["classes"].get<std::string>();
}

// True if a value occurs that is invalid in the set but valid in Cityscapes.
bool looks_like_cityscapes(const Labels& labels, const LabelSet& set) {
  const auto first_foreign = set.classes.size() + 1;  // one beyond the classes often stands for void
  return std::any_of(labels.files.begin(), labels.files.end(), [&](const auto& entry) {
    const cv::Mat image = read_labels(entry.second);
    return std::any_of(image.begin<std::uint8_t>(), image.end<std::uint8_t>(),
                       [&](std::uint8_t value) { return value >= first_foreign && value < kClasses; });
  });
}

Table table_from(const LabelSet& from, const LabelSet& set) {
  Table table;
  table.fill(kVoid);
  if (from.name == set.name && set.name == "person") {
    table.fill(1);  // 255 in masks, the number of an actor in composed sequences
    table[0] = 0;
  } else if (from.name == set.name) {
    for (std::size_t i = 0; i < set.values.size(); ++i) table[set.values[i]] = static_cast<std::uint8_t>(i);
  } else if (from.name == "cityscapes19") {
    for (std::size_t c = 0; c < kClasses; ++c) table[c] = set.from_class[c];
  } else {
    throw InputError("labels of " + from.name + " cannot be scored as " + set.name + "; use --classes " +
                     from.name);
  }
  return table;
}

void choose_label_set(Labels& labels, const LabelSet& set, std::string name) {
  if (name.empty()) name = named_in_folder(labels.folder);
  if (name.empty()) {
    const bool may_differ = set.name != "cityscapes19" && set.name != "person";
    name = may_differ && looks_like_cityscapes(labels, set) ? "cityscapes19" : set.name;
  }
  const auto from = label_set_from(name);
  if (!from) throw InputError(labels.folder.string() + ": unknown label set '" + name + "'");
  labels.to_index = table_from(*from, set);
}

cv::Mat class_indices(const Labels& labels, const fs::path& file) {
  cv::Mat result;
  cv::LUT(read_labels(file), cv::Mat(1, 256, CV_8UC1, const_cast<std::uint8_t*>(labels.to_index.data())),
          result);
  return result;
}

}  // namespace

SegmentationError evaluate_segmentation(const fs::path& truth_folder, const fs::path& estimate_folder,
                                        const LabelSet& set, const std::string& truth_set,
                                        const std::string& estimate_set) {
  Labels truth = find_labels(truth_folder);
  Labels estimate = find_labels(estimate_folder);
  choose_label_set(truth, set, truth_set);
  choose_label_set(estimate, set, estimate_set);
  Confusion confusion(set.classes);
  for (const auto& [name, file] : truth.files) {
    const auto found = estimate.files.find(name);
    if (found == estimate.files.end()) {
      throw InputError((estimate.folder / (name + ".png")).string() + ": missing; " + file.string() +
                       " has no labels to compare with, label all images first");
    }
    try {
      confusion.add(class_indices(truth, file), class_indices(estimate, found->second));
    } catch (const InputError& error) {
      const std::string what = error.what();
      throw InputError(what.starts_with("labels are") ? found->second.string() + ": " + what : what);
    }
  }
  return confusion.error();
}

std::string to_markdown(const SegmentationError& error) {
  std::vector<TableRow> rows{{"class", "IoU", "recall", "precision", "share of pixels"}};
  double known = 0.0;
  for (const auto& c : error.classes) known += static_cast<double>(c.pixels);
  for (const auto& c : error.classes) {
    rows.push_back({c.name, fixed(c.iou, 3), fixed(c.recall, 3), fixed(c.precision, 3),
                    fixed(static_cast<double>(c.pixels) / known, 4)});
  }
  return "Mean IoU " + fixed(error.mean_iou, 4) + ", pixel accuracy " + fixed(error.pixel_accuracy, 4) +
         ", " + std::to_string(error.images) + " images\n\n" + markdown_table(rows);
}

std::string to_json(const SegmentationError& error, const std::string& set) {
  Json json{{"classes", set},
            {"mean_iou", number(error.mean_iou)},
            {"pixel_accuracy", number(error.pixel_accuracy)},
            {"images", error.images},
            {"by_class", Json::object()}};
  for (const auto& c : error.classes) {
    json["by_class"][c.name] = {{"iou", number(c.iou)},
                                {"recall", number(c.recall)},
                                {"precision", number(c.precision)},
                                {"pixels", c.pixels}};
  }
  return json.dump() + "\n";
}

}  // namespace roslam::evaluation
