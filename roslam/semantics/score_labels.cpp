// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/score_labels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace roslam {

namespace {
// Linear interpolation along one axis: the grid points before and after each pixel, weight of the second.
struct Axis {
  std::vector<int> first;
  std::vector<int> second;
  std::vector<float> weight;

  Axis(int pixels, int points) {
    const double scale = static_cast<double>(points) / pixels;
    for (int i = 0; i < pixels; ++i) {
      const double position = std::max((i + 0.5) * scale - 0.5, 0.0);
      const int before = std::min(static_cast<int>(position), points - 1);
      first.push_back(before);
      second.push_back(std::min(before + 1, points - 1));
      weight.push_back(static_cast<float>(position - before));
    }
  }
};

std::array<float, kClasses> means_by_class(const ScoreGrid& grid) {
  const auto* of_point = grid.probability.ptr<float>();
  std::array<double, kClasses> sums{};
  std::array<int, kClasses> counts{};
  for (std::size_t i = 0; i < grid.best.size(); ++i) {
    const std::size_t c = grid.best[i];
    sums[c] += static_cast<double>(of_point[i]);
    ++counts[c];
  }
  std::array<float, kClasses> means{};
  for (std::size_t c = 0; c < kClasses; ++c) {
    if (counts[c] > 0) means[c] = static_cast<float>(sums[c] / counts[c]);
  }
  return means;
}

// Where the pair of grid points that pixels lie between changes along an axis, and the end.
std::vector<int> spans_of(const Axis& axis) {
  std::vector<int> starts{0};
  const int pixels = static_cast<int>(axis.first.size());
  for (int i = 1; i < pixels; ++i) {
    const auto p = static_cast<std::size_t>(i);
    if (axis.first[p] != axis.first[p - 1] || axis.second[p] != axis.second[p - 1]) starts.push_back(i);
  }
  starts.push_back(pixels);
  return starts;
}

// A cell between four grid points, and the pixels in it.
struct Cell {
  const float* corners[4];  // above left, above right, below left, below right
  cv::Rect pixels;
};

// The classes that can win anywhere in a cell: within it each score lies between those at the corners, so
// that a class whose highest is below the lowest of another never does. Returns how many.
int candidates_of(const Cell& cell, std::array<int, kClasses>& candidates) {
  std::array<float, kClasses> highest;
  float bound = std::numeric_limits<float>::lowest();
  for (std::size_t c = 0; c < kClasses; ++c) {
    const auto [low, high] =
        std::minmax({cell.corners[0][c], cell.corners[1][c], cell.corners[2][c], cell.corners[3][c]});
    highest[c] = high;
    bound = std::max(bound, low);
  }
  bound -= 1e-4F * (1.0F + std::abs(bound));  // interpolation rounds
  int count = 0;
  for (int c = 0; c < kClasses; ++c) {
    if (highest[static_cast<std::size_t>(c)] >= bound) candidates[static_cast<std::size_t>(count++)] = c;
  }
  if (count == 0) candidates[static_cast<std::size_t>(count++)] = 0;  // of scores that are not numbers
  return count;
}

// Labels the pixels of a cell whose corners differ, by interpolation down and then across.
void label_cell(const Cell& cell, const Axis& across, const Axis& along, cv::Mat& labels) {
  std::array<int, kClasses> candidates;
  const int count = candidates_of(cell, candidates);
  std::array<float, kClasses> left;
  std::array<float, kClasses> right;
  for (int y = cell.pixels.y; y < cell.pixels.br().y; ++y) {
    const float down = along.weight[static_cast<std::size_t>(y)];
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const int c = candidates[k];
      left[k] = cell.corners[0][c] + (cell.corners[2][c] - cell.corners[0][c]) * down;
      right[k] = cell.corners[1][c] + (cell.corners[3][c] - cell.corners[1][c]) * down;
    }
    auto* out = labels.ptr<std::uint8_t>(y);
    for (int x = cell.pixels.x; x < cell.pixels.br().x; ++x) {
      const float weight = across.weight[static_cast<std::size_t>(x)];
      std::size_t best = 0;
      float most = left[0] + (right[0] - left[0]) * weight;
      for (std::size_t k = 1; k < static_cast<std::size_t>(count); ++k) {
        const float score = left[k] + (right[k] - left[k]) * weight;
        if (score > most) {
          most = score;
          best = k;
        }
      }
      out[x] = static_cast<std::uint8_t>(candidates[best]);
    }
  }
}
}  // namespace

Segmentation labels_from_scores(const ScoreGrid& grid, const cv::Size& size) {
  const Axis across(size.width, grid.columns());
  const Axis along(size.height, grid.rows());
  const std::vector<int> columns = spans_of(across);
  const std::vector<int> rows = spans_of(along);
  Segmentation result;
  result.labels.create(size, CV_8UC1);
  for (std::size_t r = 0; r + 1 < rows.size(); ++r) {
    const int above = along.first[static_cast<std::size_t>(rows[r])];
    const int below = along.second[static_cast<std::size_t>(rows[r])];
    const auto* best_above = &grid.best[grid.index(above, 0)];
    const auto* best_below = &grid.best[grid.index(below, 0)];
    // All pixels of the first row get the label of a corner, and the other rows are copies of it; then the
    // cells whose corners differ are labelled pixel by pixel.
    auto* first = result.labels.ptr<std::uint8_t>(rows[r]);
    for (int x = 0; x < size.width; ++x) first[x] = best_above[across.first[static_cast<std::size_t>(x)]];
    for (int y = rows[r] + 1; y < rows[r + 1]; ++y)
      std::memcpy(result.labels.ptr<std::uint8_t>(y), first, static_cast<std::size_t>(size.width));
    for (std::size_t s = 0; s + 1 < columns.size(); ++s) {
      const int left = across.first[static_cast<std::size_t>(columns[s])];
      const int right = across.second[static_cast<std::size_t>(columns[s])];
      const int best = best_above[left];
      if (best == best_above[right] && best == best_below[left] && best == best_below[right]) continue;
      const Cell cell{{grid.scores.at(above, left), grid.scores.at(above, right), grid.scores.at(below, left),
                       grid.scores.at(below, right)},
                      {columns[s], rows[r], columns[s + 1] - columns[s], rows[r + 1] - rows[r]}};
      label_cell(cell, across, along, result.labels);
    }
  }
  result.probability = grid.probability;
  result.confidence = means_by_class(grid);
  return result;
}

}  // namespace roslam
