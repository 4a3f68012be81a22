// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/label_set.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::array<std::string_view, 5> kMovableNames{"none", "person", "car", "bicycle", "unknown"};

constexpr std::array<std::string_view, kClasses> kNames{
    "road",         "sidewalk",   "building", "wall",       "fence",  "pole",  "traffic light",
    "traffic sign", "vegetation", "terrain",  "sky",        "person", "rider", "car",
    "truck",        "bus",        "train",    "motorcycle", "bicycle"};

constexpr std::array<Movable, kClasses> kMovable{
    Movable::kNone, Movable::kNone,   Movable::kNone,   Movable::kNone,   Movable::kNone,
    Movable::kNone, Movable::kNone,   Movable::kNone,   Movable::kNone,   Movable::kNone,
    Movable::kNone, Movable::kPerson, Movable::kPerson, Movable::kCar,    Movable::kCar,
    Movable::kCar,  Movable::kCar,    Movable::kCar,    Movable::kBicycle};

// BGR, easy to tell apart: muted for most static classes, saturated for movable ones.
const std::array<cv::Vec3b, kClasses> kColours{
    cv::Vec3b(110, 90, 110), cv::Vec3b(190, 150, 190), cv::Vec3b(95, 95, 95),   cv::Vec3b(120, 110, 100),
    cv::Vec3b(90, 120, 150), cv::Vec3b(160, 160, 160), cv::Vec3b(60, 190, 240), cv::Vec3b(60, 230, 230),
    cv::Vec3b(60, 150, 60),  cv::Vec3b(130, 210, 150), cv::Vec3b(220, 180, 90), cv::Vec3b(50, 40, 235),
    cv::Vec3b(90, 30, 190),  cv::Vec3b(230, 90, 30),   cv::Vec3b(180, 60, 60),  cv::Vec3b(200, 120, 0),
    cv::Vec3b(170, 40, 110), cv::Vec3b(230, 40, 170),  cv::Vec3b(30, 140, 250)};

using Positions = std::array<std::uint8_t, kClasses>;

LabelSet numbered(std::string name, std::vector<std::string> classes, const Positions& from_class) {
  std::vector<std::uint8_t> values;
  for (std::size_t i = 0; i < classes.size(); ++i) values.push_back(static_cast<std::uint8_t>(i));
  return {std::move(name), std::move(classes), std::move(values), from_class};
}

std::vector<LabelSet> all_sets() {
  std::vector<std::string> names(kNames.begin(), kNames.end());
  Positions same{};
  for (std::size_t i = 0; i < same.size(); ++i) same[i] = static_cast<std::uint8_t>(i);
  return {
      numbered("cityscapes19", names, same),
      numbered("groups8", {"flat", "building", "pole", "nature", "sky", "person", "car", "bicycle"},
               {0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 5, 5, 6, 6, 6, 6, 6, 7}),
      numbered("camvid11",
               {"sky", "building", "pole", "road", "pavement", "tree", "sign", "fence", "car", "pedestrian",
                "bicyclist"},
               {3, 4, 1, 1, 7, 2, 6, 6, 5, 5, 0, 9, 10, 8, 8, 8, 8, 10, 10}),
      {"person", {"other", "person"}, {0, 255}, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0}}};
}

cv::Mat looked_up(const cv::Mat& labels, const std::array<std::uint8_t, 256>& table) {
  if (labels.type() != CV_8UC1) throw InputError("labels must be an 8-bit grey image");
  cv::Mat result;
  if (!labels.empty())
    cv::LUT(labels, cv::Mat(1, 256, CV_8UC1, const_cast<std::uint8_t*>(table.data())), result);
  return result;
}
}  // namespace

std::string_view class_name(int label) {
  return label >= 0 && label < kClasses ? kNames[static_cast<std::size_t>(label)] : "void";
}

Movable movable_of(int label) {
  return label >= 0 && label < kClasses ? kMovable[static_cast<std::size_t>(label)] : Movable::kNone;
}

std::string_view name_of(Movable movable) { return kMovableNames[static_cast<std::size_t>(movable)]; }

std::optional<Movable> movable_from(std::string_view name) {
  const auto* const found = std::find(kMovableNames.begin(), kMovableNames.end(), name);
  if (found == kMovableNames.end()) return std::nullopt;
  return static_cast<Movable>(found - kMovableNames.begin());
}

std::optional<LabelSet> label_set_from(std::string_view name) {
  for (auto& set : all_sets()) {
    if (set.name == name) return set;
  }
  return std::nullopt;
}

std::vector<std::string> label_set_names() {
  std::vector<std::string> names;
  for (const auto& set : all_sets()) names.push_back(set.name);
  return names;
}

cv::Mat relabel(const cv::Mat& labels, const LabelSet& set) {
  std::array<std::uint8_t, 256> table{};
  table.fill(kVoid);
  for (std::size_t label = 0; label < kClasses; ++label) table[label] = set.values[set.from_class[label]];
  return looked_up(labels, table);
}

cv::Mat movable_mask(const cv::Mat& labels) {
  std::array<std::uint8_t, 256> table{};
  for (int label = 0; label < kClasses; ++label) {
    if (movable_of(label) != Movable::kNone) table[static_cast<std::size_t>(label)] = 255;
  }
  return looked_up(labels, table);
}

cv::Vec3b class_colour(int label) {
  return label >= 0 && label < kClasses ? kColours[static_cast<std::size_t>(label)] : cv::Vec3b(0, 0, 0);
}

cv::Mat label_overlay(const cv::Mat& image, const cv::Mat& labels, double share) {
  if (image.type() != CV_8UC3 || labels.type() != CV_8UC1 || image.size() != labels.size()) {
    throw InputError("an overlay needs a colour image and labels of the same size");
  }
  cv::Mat overlay = image.clone();
  const cv::Mat movable = movable_mask(labels);
  const auto mix = [](std::uint8_t a, std::uint8_t b, double part) {
    return cv::saturate_cast<std::uint8_t>(a * (1.0 - part) + b * part);
  };
  for (int y = 0; y < image.rows; ++y) {
    auto* out = overlay.ptr<cv::Vec3b>(y);
    const auto* label = labels.ptr<std::uint8_t>(y);
    const auto* is_movable = movable.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      const double part = is_movable[x] != 0 ? share : 0.5 * share;
      const cv::Vec3b colour = class_colour(label[x]);
      for (int c = 0; c < 3; ++c) out[x][c] = mix(out[x][c], colour[c], part);
    }
  }
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(movable, outlines, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  for (const auto& outline : outlines) {
    for (const auto& p : outline) overlay.at<cv::Vec3b>(p) = class_colour(labels.at<std::uint8_t>(p));
  }
  return overlay;
}

}  // namespace roslam
