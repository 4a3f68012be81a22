// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/score_labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace roslam {

namespace {
using Row = std::array<float, kClasses>;

// The grid points on both sides of each pixel along one axis, and the weight of the second.
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

// Scores by grid point, so that the classes of one point lie together.
struct Grid {
  int rows;
  int columns;
  std::vector<Row> scores;
  std::vector<std::uint8_t> best;

  explicit Grid(const cv::Mat& planes) : rows(planes.size[2]), columns(planes.size[3]) {
    const std::size_t points = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
    scores.resize(points);
    best.resize(points);
    for (int c = 0; c < kClasses; ++c) {
      const float* plane = planes.ptr<float>(0, c);
      for (std::size_t i = 0; i < points; ++i) scores[i][static_cast<std::size_t>(c)] = plane[i];
    }
    for (std::size_t i = 0; i < points; ++i) best[i] = static_cast<std::uint8_t>(best_of(scores[i]));
  }

  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
};

// Probability of the best class: its share in the softmax.
float probability(const Row& scores, int best) {
  float sum = 0.0F;
  for (const float score : scores) {
    const float difference = score - scores[static_cast<std::size_t>(best)];
    if (difference > -12.0F) sum += std::exp(difference);
  }
  return 1.0F / sum;
}

std::array<float, kClasses> mean_probabilities(const Grid& grid) {
  std::array<double, kClasses> sums{};
  std::array<int, kClasses> counts{};
  for (std::size_t i = 0; i < grid.best.size(); ++i) {
    sums[grid.best[i]] += probability(grid.scores[i], grid.best[i]);
    ++counts[grid.best[i]];
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
  const std::uint8_t best = grid.best[corners[0]];
  if (best == grid.best[corners[1]] && best == grid.best[corners[2]] && best == grid.best[corners[3]]) {
    std::memset(out + begin, best, static_cast<std::size_t>(end - begin));
    return;
  }
  const Row left = mixed(grid.scores[corners[0]], grid.scores[corners[2]], down);
  const Row right = mixed(grid.scores[corners[1]], grid.scores[corners[3]], down);
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
  result.confidence = mean_probabilities(grid);
  return result;
}

}  // namespace roslam
