// SPDX-License-Identifier: BSD-3-Clause
#include "recording/removal_record.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "recording/removal_image.hpp"
#include "roslam/dynamic_objects/auxiliary_descriptor.hpp"

namespace roslam::recording {

namespace {
using Json = nlohmann::ordered_json;

constexpr int kMaxValue = 255;

double rounded(double value, double factor) { return std::round(value * factor) / factor; }

double area_share(const DynamicObjects& removal, const cv::Size& image) {
  return removal.mask.empty() ? 0.0 : cv::countNonZero(removal.mask) / static_cast<double>(image.area());
}

Json object_json(const MovableObject& object, int value) {
  const cv::Rect& box = object.box;
  return {{"id", object.id},
          {"value", value},
          {"class", name_of(object.kind)},
          {"confidence", rounded(static_cast<double>(object.confidence), 1e3)},
          {"box", {box.x, box.y, box.width, box.height}},
          {"centre", {box.x + box.width / 2, box.y + box.height / 2}},
          {"side", std::max(box.width, box.height)},
          {"pixels", cv::countNonZero(object.mask)},
          {"median_depth", rounded(static_cast<double>(object.median_depth), 1e3)},
          {"at_rest", object.is_at_rest},
          {"missed", object.misses}};
}
}  // namespace

PointCounts removed_by_class(const FrameResult& result, const cv::Size& image) {
  PointCounts counts;
  if (result.removed_points.empty()) return counts;
  const cv::Mat kinds = removed_kinds(result.dynamic_objects, image);
  for (const auto& point : result.removed_points) {
    const Movable kind = kind_at(kinds, point);
    // Points within orb.mask_margin of the mask are removed as well; they have no class.
    ++counts[kind == Movable::kNone ? kBesideMask : std::string(name_of(kind))];
  }
  return counts;
}

void RemovalTally::add(const FrameResult& result, const cv::Size& image, const PointCounts& removed) {
  ++frames;
  removed_area += area_share(result.dynamic_objects, image);
  kept_points += result.points.size();
  for (const auto& [kind, count] : removed) removed_points[kind] += count;
  if (result.dynamic_objects.label_age >= 0) label_ages.push_back(result.dynamic_objects.label_age);
  if (result.state == TrackingState::kPredicted) ++predicted;
  constexpr double kLow = 0.5;
  if (result.T_world_camera && result.quality < kLow) ++low_quality;
}

void RemovalTally::merge(const RemovalTally& other) {
  frames += other.frames;
  low_quality += other.low_quality;
  predicted += other.predicted;
  removed_area += other.removed_area;
  kept_points += other.kept_points;
  for (const auto& [kind, count] : other.removed_points) removed_points[kind] += count;
  masks_dropped += other.masks_dropped;
  lines_dropped += other.lines_dropped;
  label_ages.insert(label_ages.end(), other.label_ages.begin(), other.label_ages.end());
}

std::string descriptor_line(const FrameResult& result, const cv::Size& image, const PointCounts& removed,
                            const std::string& mask_file) {
  const Eigen::Matrix4i matrix = auxiliary_descriptor(result.dynamic_objects.objects);
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) {
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)});
  }
  Json objects = Json::array();
  int value = 0;
  for (const auto& object : result.dynamic_objects.objects) {
    value = std::min(value + 1, kMaxValue);
    objects.push_back(object_json(object, value));
  }
  Json line;
  line["frame"] = result.index;
  line["timestamp"] = result.timestamp;
  line["state"] = name_of(result.state);
  line["quality"] = rounded(result.quality, 1e3);
  line["label_age"] =
      result.dynamic_objects.label_age >= 0 ? Json(result.dynamic_objects.label_age) : Json(nullptr);
  line["descriptor"] = rows;
  line["mask"] = mask_file.empty() ? Json(nullptr) : Json(mask_file);
  line["removed_area"] = rounded(area_share(result.dynamic_objects, image), 1e4);
  line["kept_points"] = result.points.size();
  line["removed_points"] = removed;
  line["objects"] = objects;
  return line.dump();
}

std::string mask_name(double timestamp) {
  return std::string(kMaskFolder) + "/" + time_text(timestamp) + ".png";
}

cv::Mat object_image(const std::vector<MovableObject>& objects, const cv::Size& size) {
  cv::Mat image = cv::Mat::zeros(size, CV_8UC1);
  int value = 0;
  for (const auto& object : objects) {
    value = std::min(value + 1, kMaxValue);
    draw_object(object, image, value);
  }
  return image;
}

}  // namespace roslam::recording
