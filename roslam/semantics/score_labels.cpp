// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/score_labels.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace roslam {

namespace {
using Row = std::array<float, kClasses>;

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

int best_of(const Row& scores) {
  return static_cast<int>(std::max_element(scores.begin(), scores.end()) - scores.begin());
}

Row mixed(const Row& a, const Row& b, float weight) {
  Row row;
  for (std::size_t c = 0; c < kClasses; ++c) row[c] = a[c] + (b[c] - a[c]) * weight;
  return row;
}

// Interpolated between two points of a column.
Row scores_between(const float* above, const float* below, float weight) {
  Row row;
  for (std::size_t c = 0; c < kClasses; ++c) row[c] = above[c] + (below[c] - above[c]) * weight;
  return row;
}

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

// Labels pixels begin..end of a row, all of them between the same two columns of the grid.
void label_span(const ScoreGrid& grid, const Axis& across, int above, int below, float down, int begin,
                int end, std::uint8_t* out) {
  const auto x = static_cast<std::size_t>(begin);
  const int left = across.first[x];
  const int right = across.second[x];
  const int best = grid.best[grid.index(above, left)];
  if (best == grid.best[grid.index(above, right)] && best == grid.best[grid.index(below, left)] &&
      best == grid.best[grid.index(below, right)]) {
    std::memset(out + begin, best, static_cast<std::size_t>(end - begin));
    return;
  }
  const Row before = scores_between(grid.scores.at(above, left), grid.scores.at(below, left), down);
  const Row after = scores_between(grid.scores.at(above, right), grid.scores.at(below, right), down);
  for (int i = begin; i < end; ++i) {
    out[i] =
        static_cast<std::uint8_t>(best_of(mixed(before, after, across.weight[static_cast<std::size_t>(i)])));
  }
}
}  // namespace

Segmentation labels_from_scores(const ScoreGrid& grid, const cv::Size& size) {
  const Axis across(size.width, grid.columns());
  const Axis along(size.height, grid.rows());
  std::vector<int> starts{0};  // where the pair of grid columns changes
  for (int x = 1; x < size.width; ++x) {
    const auto i = static_cast<std::size_t>(x);
    if (across.first[i] != across.first[i - 1]) starts.push_back(x);
  }
  starts.push_back(size.width);
  Segmentation result;
  result.labels.create(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y) {
    const auto i = static_cast<std::size_t>(y);
    for (std::size_t s = 0; s + 1 < starts.size(); ++s) {
      label_span(grid, across, along.first[i], along.second[i], along.weight[i], starts[s], starts[s + 1],
                 result.labels.ptr<std::uint8_t>(y));
    }
  }
  result.probability = grid.probability;
  result.confidence = means_by_class(grid);
  return result;
}

}  // namespace roslam
