// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/score_grid.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/common/error.hpp"

namespace roslam {

ScoreGrid ScoreGrid::from_planes(const cv::Mat& scores) {
  if (scores.dims != 4 || scores.type() != CV_32F || scores.size[0] != 1)
    throw ModelError("the network gives no class scores; install the model that belongs to this version");
  const int channels = scores.size[1];
  const int rows = scores.size[2];
  const int columns = scores.size[3];
  const std::size_t points = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
  ScoreGrid grid;
  grid.memory.resize(scores.total());
  for (int c = 0; c < channels; ++c) {
    const float* plane = scores.ptr<float>(0, c);
    float* to = grid.memory.data() + c;
    for (std::size_t i = 0; i < points; ++i, to += channels) *to = plane[i];
  }
  const TensorView view{grid.memory.data(), rows,     columns,
                        channels,           channels, static_cast<std::ptrdiff_t>(columns) * channels};
  grid.scores = {view, 1, channels, channels};
  grid.best.resize(points);
  grid.probability.create(rows, columns, CV_32FC1);
  for (std::size_t i = 0; i < points; ++i) {
    const float* point = grid.memory.data() + i * static_cast<std::size_t>(channels);
    const float* best = std::max_element(point, point + channels);
    float sum = 0.0F;
    for (int c = 0; c < channels; ++c) sum += std::exp(point[c] - *best);
    grid.best[i] = static_cast<std::uint8_t>(best - point);
    grid.probability.ptr<float>()[i] = 1.0F / sum;
  }
  return grid;
}

}  // namespace roslam
