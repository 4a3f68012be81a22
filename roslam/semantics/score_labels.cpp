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

// The network's scores, one plane per class, with the best class of each grid point.
struct Grid {
  int rows;
  int columns;
  std::array<const float*, kClasses> planes{};
  std::vector<float> highest;
  std::vector<int> best;

  explicit Grid(const cv::Mat& scores)
      : rows(scores.size[2]), columns(scores.size[3]), highest(points()), best(points(), 0) {
    for (int c = 0; c < kClasses; ++c) planes[static_cast<std::size_t>(c)] = scores.ptr<float>(0, c);
    std::copy_n(planes[0], points(), highest.begin());
    for (int c = 1; c < kClasses; ++c) {
      const float* plane = planes[static_cast<std::size_t>(c)];
      for (std::size_t i = 0; i < points(); ++i) {
        const bool is_better = plane[i] > highest[i];
        highest[i] = is_better ? plane[i] : highest[i];
        best[i] = is_better ? c : best[i];
      }
    }
  }

  std::size_t points() const { return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns); }

  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }

  // Interpolated between two points of a column.
  Row scores_between(std::size_t above, std::size_t below, float weight) const {
    Row row;
    for (std::size_t c = 0; c < kClasses; ++c) {
      row[c] = planes[c][above] + (planes[c][below] - planes[c][above]) * weight;
    }
    return row;
  }
};

// Softmax probability of each point's best class.
cv::Mat probabilities(const Grid& grid) {
  const cv::Mat highest(1, static_cast<int>(grid.points()), CV_32F, const_cast<float*>(grid.highest.data()));
  cv::Mat sum = cv::Mat::zeros(highest.size(), CV_32F);
  cv::Mat share;
  for (const float* plane : grid.planes) {
    cv::subtract(cv::Mat(highest.size(), CV_32F, const_cast<float*>(plane)), highest, share);
    cv::exp(share, share);
    sum += share;
  }
  return cv::Mat(1.0 / sum).reshape(1, grid.rows);
}

std::array<float, kClasses> means_by_class(const Grid& grid, const cv::Mat& probability) {
  const auto* of_point = probability.ptr<float>();
  std::array<double, kClasses> sums{};
  std::array<int, kClasses> counts{};
  for (std::size_t i = 0; i < grid.points(); ++i) {
    const auto c = static_cast<std::size_t>(grid.best[i]);
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
void label_span(const Grid& grid, const Axis& across, int above, int below, float down, int begin, int end,
                std::uint8_t* out) {
  const auto x = static_cast<std::size_t>(begin);
  const std::size_t corners[4] = {grid.at(above, across.first[x]), grid.at(above, across.second[x]),
                                  grid.at(below, across.first[x]), grid.at(below, across.second[x])};
  const int best = grid.best[corners[0]];
  if (best == grid.best[corners[1]] && best == grid.best[corners[2]] && best == grid.best[corners[3]]) {
    std::memset(out + begin, best, static_cast<std::size_t>(end - begin));
    return;
  }
  const Row left = grid.scores_between(corners[0], corners[2], down);
  const Row right = grid.scores_between(corners[1], corners[3], down);
  for (int i = begin; i < end; ++i) {
    out[i] =
        static_cast<std::uint8_t>(best_of(mixed(left, right, across.weight[static_cast<std::size_t>(i)])));
  }
}
}  // namespace

Segmentation labels_from_scores(const cv::Mat& scores, const cv::Size& size) {
  const Grid grid(scores);
  const Axis across(size.width, grid.columns);
  const Axis along(size.height, grid.rows);
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
  result.probability = probabilities(grid);
  result.confidence = means_by_class(grid, result.probability);
  return result;
}

}  // namespace roslam
