// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/mask_refinement.hpp"

#include <limits>
#include <opencv2/imgproc.hpp>

#include "roslam/common/widened.hpp"

namespace roslam {

namespace {
constexpr float kStep = 0.05F;  // metres
constexpr float kShareOfDepth = 0.02F;

struct DepthRange {
  cv::Mat least;    // CV_32FC1 of cells; infinite where no interior is near
  cv::Mat largest;  // CV_32FC1 of cells; negative where no interior is near
};

// Depth range of the mask's interior near each cell.
DepthRange inside_depth(const cv::Mat& mask_cells, const cv::Mat& depth_cells, int reach) {
  cv::Mat inside;
  cv::erode(mask_cells, inside, cv::Mat());
  if (cv::countNonZero(inside) < cv::countNonZero(mask_cells) / 4) inside = mask_cells;  // a thin object
  cv::Mat unknown = (inside == 0) | (depth_cells <= 0.0F);
  DepthRange range{depth_cells.clone(), depth_cells.clone()};
  range.least.setTo(std::numeric_limits<float>::infinity(), unknown);
  range.largest.setTo(-1.0F, unknown);
  const cv::Mat window = cv::getStructuringElement(cv::MORPH_RECT, {2 * reach + 1, 2 * reach + 1});
  cv::erode(range.least, range.least, window);
  cv::dilate(range.largest, range.largest, window);
  return range;
}
}  // namespace

cv::Mat dilated(const cv::Mat& mask, int pixels) {
  if (pixels <= 0) return mask.clone();
  cv::Mat result;
  cv::dilate(mask, result, cv::getStructuringElement(cv::MORPH_RECT, {2 * pixels + 1, 2 * pixels + 1}));
  return result;
}

cv::Mat dilated_apart(const cv::Mat& part, const cv::Mat& mask, int pixels) {
  return dilated(part, pixels) & ~dilated(mask & ~part, pixels);
}

cv::Mat refine_mask(const cv::Mat& mask, const cv::Mat& depth, const cv::Mat& depth_cells,
                    const cv::Mat& barrier, const CellGrid& grid, int band, const cv::Point& origin) {
  cv::Mat result = mask.clone();
  if (band <= 0 || depth.empty()) return result;
  const cv::Rect box = cv::boundingRect(mask);
  if (box.empty()) return result;
  const cv::Rect around = widened(box, band) & cv::Rect({0, 0}, mask.size());
  const cv::Rect cells = grid.cells_of(cv::Rect(origin, mask.size()));
  const DepthRange range =
      inside_depth(grid.mask_cells(mask, cells), depth_cells(cells), band / grid.side() + 1);
  cv::Mat smaller;
  const cv::Mat window = cv::getStructuringElement(cv::MORPH_RECT, {2 * band + 1, 2 * band + 1});
  cv::erode(mask(around), smaller, window, {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  const cv::Mat larger = dilated(mask(around), band);
  for (int y = 0; y < around.height; ++y) {
    const int row = around.y + y;
    const int cell_row = row / grid.side();
    const auto* inner = smaller.ptr<std::uint8_t>(y);
    const auto* outer = larger.ptr<std::uint8_t>(y);
    const auto* z_row = depth.ptr<float>(origin.y + row) + origin.x;
    const auto* least = range.least.ptr<float>(cell_row);
    const auto* largest = range.largest.ptr<float>(cell_row);
    const auto* is_static = barrier.ptr<std::uint8_t>(cells.y + cell_row) + cells.x;
    auto* out = result.ptr<std::uint8_t>(row);
    for (int x = 0; x < around.width; ++x) {
      if (outer[x] == inner[x]) continue;  // not within the band
      const int column = around.x + x;
      const int cell = column / grid.side();
      const float z = z_row[column];
      if (!(z > 0.0F) || largest[cell] < 0.0F) continue;
      const float tolerance = kStep + kShareOfDepth * z;
      const bool belongs = z >= least[cell] - tolerance && z <= largest[cell] + tolerance;
      if (belongs && out[column] == 0 && is_static[cell] != 0) continue;
      out[column] = belongs ? 255 : 0;
    }
  }
  return result;
}

}  // namespace roslam
