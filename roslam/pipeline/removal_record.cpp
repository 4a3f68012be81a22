// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/removal_record.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "roslam/removal/auxiliary_descriptor.hpp"
#include "roslam/removal/removal_picture.hpp"

namespace roslam {

namespace {
using Json = nlohmann::ordered_json;

constexpr int kLastNumber = 255;

double rounded(double value, double factor) { return std::round(value * factor) / factor; }

double area_share(const Removal& removal, const cv::Size& picture) {
  return removal.mask.empty() ? 0.0 : cv::countNonZero(removal.mask) / static_cast<double>(picture.area());
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

PointCounts removed_by_class(const FrameResult& result, const cv::Size& picture) {
  PointCounts counts;
  if (result.removed_points.empty()) return counts;
  const cv::Mat kinds = removed_kinds(result.removal, picture);
  for (const auto& point : result.removed_points) {
    const Movable kind = kind_at(kinds, point);
    // Extraction keeps some pixels off the mask, where no class is drawn.
    ++counts[kind == Movable::kNone ? kBesideMask : std::string(name_of(kind))];
  }
  return counts;
}

void RemovalTally::add(const FrameResult& result, const cv::Size& picture, const PointCounts& removed) {
  ++frames;
  removed_area += area_share(result.removal, picture);
  kept_points += result.points.size();
  for (const auto& [kind, count] : removed) removed_points[kind] += count;
  if (result.removal.label_age >= 0) label_ages.push_back(result.removal.label_age);
  if (result.state == TrackingState::kPredicted) ++predicted;
  constexpr double kLow = 0.5;
  if (result.T_world_camera && result.trust < kLow) ++low_trust;
}

std::string descriptor_line(const FrameResult& result, const cv::Size& picture, const PointCounts& removed,
                            const std::string& mask_file) {
  const Eigen::Matrix4i matrix = auxiliary_descriptor(result.removal.objects);
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) {
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)});
  }
  Json objects = Json::array();
  int value = 0;
  for (const auto& object : result.removal.objects) {
    value = std::min(value + 1, kLastNumber);
    objects.push_back(object_json(object, value));
  }
  Json line;
  line["frame"] = result.index;
  line["timestamp"] = result.timestamp;
  line["state"] = name_of(result.state);
  line["trust"] = rounded(result.trust, 1e3);
  line["label_age"] = result.removal.label_age >= 0 ? Json(result.removal.label_age) : Json(nullptr);
  line["descriptor"] = rows;
  line["mask"] = mask_file.empty() ? Json(nullptr) : Json(mask_file);
  line["removed_area"] = rounded(area_share(result.removal, picture), 1e4);
  line["kept_points"] = result.points.size();
  line["removed_points"] = removed;
  line["objects"] = objects;
  return line.dump();
}

std::string mask_name(double timestamp) {
  return std::string(kMaskFolder) + "/" + time_text(timestamp) + ".png";
}

cv::Mat object_image(const std::vector<MovableObject>& objects, const cv::Size& picture) {
  cv::Mat image = cv::Mat::zeros(picture, CV_8UC1);
  int value = 0;
  for (const auto& object : objects) {
    value = std::min(value + 1, kLastNumber);
    paint(object, image, value);
  }
  return image;
}

}  // namespace roslam
