// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/movable_object.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "roslam/common/upper_median.hpp"
#include "roslam/common/widened.hpp"
#include "roslam/dynamic_objects/cell_grid.hpp"

namespace roslam {

namespace {
bool is_connected(float a, float b) {
  constexpr float kStep = 0.15F;  // metres
  constexpr float kShareOfDepth = 0.05F;
  return a <= 0.0F || b <= 0.0F || std::abs(a - b) < kStep + kShareOfDepth * std::min(a, b);
}

// Connected components of equal kind, numbered from 1; 0 where nothing is movable. Returns how many.
int number_areas(const cv::Mat& kinds, const cv::Mat& depth, cv::Mat& areas) {
  areas = cv::Mat::zeros(kinds.size(), CV_32SC1);
  int count = 0;
  std::vector<cv::Point> open;
  constexpr std::array<std::array<int, 2>, 4> kNeighbours{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (int y = 0; y < kinds.rows; ++y) {
    for (int x = 0; x < kinds.cols; ++x) {
      if (kinds.at<std::uint8_t>(y, x) == 0 || areas.at<int>(y, x) != 0) continue;
      areas.at<int>(y, x) = ++count;
      open.assign(1, {x, y});
      while (!open.empty()) {
        const cv::Point p = open.back();
        open.pop_back();
        for (const auto& [dx, dy] : kNeighbours) {
          const cv::Point q(p.x + dx, p.y + dy);
          if (q.x < 0 || q.y < 0 || q.x >= kinds.cols || q.y >= kinds.rows || areas.at<int>(q) != 0) continue;
          if (kinds.at<std::uint8_t>(q) != kinds.at<std::uint8_t>(p)) continue;
          if (!is_connected(depth.at<float>(p), depth.at<float>(q))) continue;
          areas.at<int>(q) = count;
          open.push_back(q);
        }
      }
    }
  }
  return count;
}

// The Movable of each label, for cv::LUT.
cv::Mat kinds_of_labels() {
  cv::Mat table = cv::Mat::zeros(1, 256, CV_8UC1);
  for (int label = 0; label < kClasses; ++label) {
    table.at<std::uint8_t>(label) = static_cast<std::uint8_t>(movable_of(label));
  }
  return table;
}

// Mean probability of the labelled class over an object's pixels; without a probability map, of the class
// over the image.
float confidence_of(const MovableObject& object, const Segmentation& segmentation) {
  const cv::Mat& probability = segmentation.probability;
  const cv::Size size = segmentation.labels.size();
  std::vector<int> columns;  // of the probability map, for each column of the box
  for (int x = object.box.x; x < object.box.br().x; ++x) columns.push_back(x * probability.cols / size.width);
  double sum = 0.0;
  int count = 0;
  for (int y = 0; y < object.box.height; ++y) {
    const auto* mask = object.mask.ptr<std::uint8_t>(y);
    const int row = object.box.y + y;
    const auto* labels = segmentation.labels.ptr<std::uint8_t>(row) + object.box.x;
    const float* line =
        probability.empty() ? nullptr : probability.ptr<float>(row * probability.rows / size.height);
    for (int x = 0; x < object.box.width; ++x) {
      if (mask[x] == 0 || labels[x] >= kClasses) continue;
      const float share =
          line == nullptr ? segmentation.confidence[labels[x]] : line[columns[static_cast<std::size_t>(x)]];
      sum += static_cast<double>(share);
      ++count;
    }
  }
  return count == 0 ? 0.0F : static_cast<float>(sum / count);
}
}  // namespace

std::vector<MovableObject> find_objects(const Segmentation& segmentation, const cv::Mat& depth,
                                        const CellGrid& grid, double min_share) {
  const cv::Mat table = kinds_of_labels();
  cv::Mat kinds(grid.size(), CV_8UC1);  // of cells
  for (int y = 0; y < kinds.rows; ++y) {
    for (int x = 0; x < kinds.cols; ++x) {
      kinds.at<std::uint8_t>(y, x) = table.data[segmentation.labels.at<std::uint8_t>(grid.pixel_of({x, y}))];
    }
  }
  cv::Mat areas;
  const int count = number_areas(kinds, depth, areas);
  std::vector<int> sizes(static_cast<std::size_t>(count) + 1, 0);
  for (std::size_t i = 0; i < grid.cells(); ++i) ++sizes[static_cast<std::size_t>(areas.ptr<int>()[i])];
  const auto boxes = boxes_of_numbers(areas, count);
  const double least = std::max(1.0, min_share * static_cast<double>(grid.cells()));
  std::vector<MovableObject> objects;
  for (int area = 1; area <= count; ++area) {
    if (sizes[static_cast<std::size_t>(area)] < least) continue;
    const cv::Rect box = widened(boxes[static_cast<std::size_t>(area)], 1) & cv::Rect({0, 0}, grid.size());
    cv::Mat own_cells = areas(box) == area;
    double kind = 0.0;
    cv::minMaxIdx(kinds(box), nullptr, &kind, nullptr, nullptr, own_cells);
    cv::dilate(own_cells, own_cells, cv::Mat());
    const cv::Rect pixels = grid.pixels_of(box);
    cv::Mat own_kind;
    cv::LUT(segmentation.labels(pixels), table, own_kind);
    MovableObject object;
    object.kind = static_cast<Movable>(static_cast<int>(kind));
    if (!take_mask(object, grid.in_pixels(own_cells, box) & (own_kind == kind))) continue;
    object.box += pixels.tl();
    object.confidence = object.decayed_confidence = confidence_of(object, segmentation);
    object.median_depth = median_depth(object, depth, grid);
    objects.push_back(std::move(object));
  }
  return objects;
}

void draw_object(const MovableObject& object, cv::Mat& image, int value) {
  image(object.box).setTo(value, object.mask);
}

bool take_mask(MovableObject& object, const cv::Mat& image) {
  const cv::Rect box = cv::boundingRect(image);
  if (box.empty()) return false;
  object.box = box;
  object.mask = image(object.box).clone();
  return true;
}

bool is_seen_repeatedly(const MovableObject& object) {
  constexpr int kMinSeen = 2;
  return object.kind != Movable::kUnknown || object.times_seen >= kMinSeen;
}

int common_pixels(const MovableObject& a, const MovableObject& b) {
  const cv::Rect both = a.box & b.box;
  if (both.empty()) return 0;
  return cv::countNonZero(a.mask(both - a.box.tl()) & b.mask(both - b.box.tl()));
}

double overlap(const MovableObject& a, const MovableObject& b) {
  const int smaller = std::min(cv::countNonZero(a.mask), cv::countNonZero(b.mask));
  return smaller == 0 ? 0.0 : static_cast<double>(common_pixels(a, b)) / smaller;
}

float median_depth(const MovableObject& object, const cv::Mat& depth, const CellGrid& grid) {
  std::vector<float> known;
  const cv::Point begin = grid.cell_of(object.box.tl());
  const cv::Point end = grid.cell_of(object.box.br());
  for (int y = begin.y; y <= end.y; ++y) {
    for (int x = begin.x; x <= end.x; ++x) {
      const cv::Point pixel = grid.pixel_of({x, y});
      const float z = depth.at<float>(y, x);
      if (z <= 0.0F || !object.box.contains(pixel)) continue;
      if (object.mask.at<std::uint8_t>(pixel - object.box.tl()) != 0) known.push_back(z);
    }
  }
  return known.empty() ? 0.0F : upper_median(known);
}

}  // namespace roslam
