// SPDX-License-Identifier: BSD-3-Clause
#include "recording/removal_image.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <string>

namespace roslam::recording {

namespace {
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr std::array<Movable, 4> kKinds{Movable::kPerson, Movable::kCar, Movable::kBicycle,
                                        Movable::kUnknown};

void draw_cross(cv::Mat& image, const cv::Point2f& point, const cv::Scalar& colour) {
  const cv::Point centre(cvRound(point.x), cvRound(point.y));
  constexpr int kArm = 3;
  cv::line(image, centre - cv::Point(kArm, kArm), centre + cv::Point(kArm, kArm), colour, 1, cv::LINE_AA);
  cv::line(image, centre - cv::Point(kArm, -kArm), centre + cv::Point(kArm, -kArm), colour, 1, cv::LINE_AA);
}

void draw_text(cv::Mat& image, const std::string& text, const cv::Point& at, const cv::Scalar& colour) {
  constexpr double kSize = 0.45;
  cv::putText(image, text, at, kFont, kSize, cv::Scalar(0, 0, 0), 3, cv::LINE_AA);
  cv::putText(image, text, at, kFont, kSize, colour, 1, cv::LINE_AA);
}

cv::Mat legend(int width) {
  cv::Mat image(26, width, CV_8UC3, cv::Scalar::all(255));
  int x = 10;
  const auto entry = [&](const std::string& text, Movable kind) {
    const cv::Scalar colour = removal_colour(kind);
    if (kind == Movable::kNone) {
      cv::circle(image, {x + 4, 13}, 3, colour, cv::FILLED, cv::LINE_AA);
    } else {
      draw_cross(image, {static_cast<float>(x + 4), 13.0F}, colour);
    }
    cv::putText(image, text, {x + 14, 18}, kFont, 0.45, cv::Scalar(40, 40, 40), 1, cv::LINE_AA);
    x += 30 + 8 * static_cast<int>(text.size());
  };
  entry("kept", Movable::kNone);
  for (const Movable kind : kKinds) entry("removed: " + std::string(name_of(kind)), kind);
  return image;
}
}  // namespace

cv::Vec3b removal_colour(Movable kind) {
  switch (kind) {
    case Movable::kNone:
      return {80, 220, 60};
    case Movable::kPerson:
      return {60, 60, 235};
    case Movable::kCar:
      return {235, 130, 40};
    case Movable::kBicycle:
      return {30, 190, 250};
    case Movable::kUnknown:
      return {220, 70, 220};
  }
  return {255, 255, 255};
}

cv::Mat removed_kinds(const DynamicObjects& dynamic_objects, const cv::Size& size) {
  cv::Mat kinds = cv::Mat::zeros(size, CV_8UC1);
  if (dynamic_objects.mask.empty()) return kinds;
  for (const auto& object : dynamic_objects.objects)
    draw_object(object, kinds, static_cast<int>(object.kind));
  // Region growing: each round assigns the margin's pixels next to an object.
  const cv::Mat window = cv::getStructuringElement(cv::MORPH_RECT, {3, 3});
  for (int round = 0; round < std::max(size.width, size.height); ++round) {
    const cv::Mat unassigned = (kinds == 0) & (dynamic_objects.mask != 0);
    const int before = cv::countNonZero(unassigned);
    if (before == 0) break;
    cv::Mat wider;
    cv::dilate(kinds, wider, window);
    wider.copyTo(kinds, unassigned);
    if (cv::countNonZero((kinds == 0) & (dynamic_objects.mask != 0)) == before) break;
  }
  return kinds;
}

Movable kind_at(const cv::Mat& kinds, const cv::Point2f& point) {
  const cv::Point pixel(std::clamp(cvRound(point.x), 0, kinds.cols - 1),
                        std::clamp(cvRound(point.y), 0, kinds.rows - 1));
  return static_cast<Movable>(kinds.at<std::uint8_t>(pixel));
}

cv::Mat removal_image(const cv::Mat& colour, const DynamicObjects& dynamic_objects,
                      const std::vector<cv::Point2f>& points,
                      const std::vector<cv::Point2f>& removed_points) {
  cv::Mat image = colour.clone();
  const cv::Mat kinds = removed_kinds(dynamic_objects, colour.size());
  for (const Movable kind : kKinds) {
    const cv::Mat area = kinds == static_cast<int>(kind);
    if (cv::countNonZero(area) == 0) continue;
    const cv::Mat tint(colour.size(), CV_8UC3, cv::Scalar(removal_colour(kind)));
    cv::Mat tinted;
    cv::addWeighted(colour, 0.6, tint, 0.4, 0.0, tinted);
    tinted.copyTo(image, area);
    std::vector<std::vector<cv::Point>> outlines;
    cv::findContours(area, outlines, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
    cv::drawContours(image, outlines, -1, cv::Scalar(removal_colour(kind)), 1);
  }
  for (const auto& point : points)
    cv::circle(image, point, 2, cv::Scalar(removal_colour(Movable::kNone)), cv::FILLED, cv::LINE_AA);
  for (const auto& point : removed_points) {
    const Movable kind = kind_at(kinds, point);
    draw_cross(image, point, cv::Scalar(removal_colour(kind == Movable::kNone ? Movable::kUnknown : kind)));
  }
  for (const auto& object : dynamic_objects.objects) {
    std::string text = std::to_string(object.id) + " " + std::string(name_of(object.kind));
    if (object.is_at_rest) text += ", at rest";
    draw_text(image, text, object.box.tl() + cv::Point(2, 14), cv::Scalar::all(255));
  }
  return image;
}

cv::Mat removal_strip(const std::vector<cv::Mat>& images, int columns, int width) {
  if (images.empty()) return {};
  const int height = width * images.front().rows / images.front().cols;
  const int rows = (static_cast<int>(images.size()) + columns - 1) / columns;
  const int used = std::min(columns, static_cast<int>(images.size()));
  const cv::Mat key = legend(used * width);
  cv::Mat strip(rows * height + key.rows, used * width, CV_8UC3, cv::Scalar::all(255));
  for (int i = 0; i < static_cast<int>(images.size()); ++i) {
    cv::Mat tile = strip(cv::Rect(i % columns * width, i / columns * height, width, height));
    cv::resize(images[static_cast<std::size_t>(i)], tile, tile.size(), 0, 0, cv::INTER_AREA);
  }
  key.copyTo(strip(cv::Rect(0, rows * height, key.cols, key.rows)));
  return strip;
}

}  // namespace roslam::recording
