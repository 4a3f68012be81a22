// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/depth_completion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/common/upper_median.hpp"

namespace roslam {

void DepthCompletionOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("depth_completion.") + message);
  };
  require(cell >= 1 && cell <= 64, "cell must be 1 to 64 pixels");
  require(guard >= 0 && guard <= 64, "guard must be 0 to 64 pixels");
  require(plane_tolerance > 0.0 && plane_tolerance < 1.0, "plane_tolerance must be above 0 and below 1");
  require(max_planes >= 0 && max_planes <= 64, "max_planes must be 0 to 64");
  require(min_votes >= 0.0 && min_votes <= 1.0, "min_votes must be 0 to 1");
}

namespace {
constexpr int kDirections = 16;
constexpr int kTrials = 80;          // RANSAC samples of three cells, for each plane
constexpr int kNeighbourhood = 12;   // cells within which the three lie
constexpr int kMinCells = 8;         // of a plane
constexpr int kUnknownSurface = -1;  // without depth

// Coefficients (a, b, c) of the inverse depth a x + b y + c at pixel (x, y).
using Plane = Eigen::Vector3d;

double inverse_depth(const Plane& plane, double x, double y) {
  return plane.x() * x + plane.y() * y + plane.z();
}

struct Cell {
  double x, y;  // of its centre, pixels
  double inverse;
};

// The image in cells: CV_32FC1 median inverse depth, 0 = unknown, and CV_8UC1, nonzero where a cell is mostly
// hole.
struct Cells {
  cv::Mat inverse;
  cv::Mat is_hole;
  int side;

  Cell at(int x, int y) const {
    return {(x + 0.5) * side - 0.5, (y + 0.5) * side - 0.5, static_cast<double>(inverse.at<float>(y, x))};
  }
};

Cells cells_of(const cv::Mat& depth, const cv::Mat& hole, const DepthCompletionOptions& options) {
  cv::Mat guarded;
  cv::dilate(hole, guarded, cv::Mat(), {-1, -1}, options.guard);
  const cv::Size size((depth.cols + options.cell - 1) / options.cell,
                      (depth.rows + options.cell - 1) / options.cell);
  Cells cells{cv::Mat::zeros(size, CV_32FC1), cv::Mat::zeros(size, CV_8UC1), options.cell};
  std::vector<float> known;
  for (int cy = 0; cy < size.height; ++cy) {
    for (int cx = 0; cx < size.width; ++cx) {
      const cv::Rect box = cv::Rect(cx * options.cell, cy * options.cell, options.cell, options.cell) &
                           cv::Rect({0, 0}, depth.size());
      known.clear();
      int guarded_pixels = 0;
      for (int y = box.y; y < box.br().y; ++y) {
        for (int x = box.x; x < box.br().x; ++x) {
          if (guarded.at<std::uint8_t>(y, x) != 0) {
            ++guarded_pixels;
          } else if (depth.at<float>(y, x) > 0.0F) {
            known.push_back(depth.at<float>(y, x));
          }
        }
      }
      if (2 * guarded_pixels > box.area()) cells.is_hole.at<std::uint8_t>(cy, cx) = 255;
      if (2 * static_cast<int>(known.size()) <= box.area() - guarded_pixels || known.empty()) continue;
      cells.inverse.at<float>(cy, cx) = 1.0F / upper_median(known);
    }
  }
  return cells;
}

std::optional<Plane> fitted(const std::vector<Cell>& cells) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Cell& cell : cells) {
    // Relative residuals: weights by the inverse depth.
    const Eigen::Vector3d row = Eigen::Vector3d(cell.x, cell.y, 1.0) / cell.inverse;
    normal += row * row.transpose();
    right += row;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  if (solver.info() != Eigen::Success || solver.rcond() < 1e-12) return std::nullopt;
  return Plane(solver.solve(right));
}

bool lies_on(const Cell& cell, const Plane& plane, double tolerance) {
  return std::abs(inverse_depth(plane, cell.x, cell.y) - cell.inverse) <= tolerance * cell.inverse;
}

std::vector<Cell> cells_on(const std::vector<Cell>& cells, const Plane& plane, double tolerance) {
  std::vector<Cell> on;
  std::copy_if(cells.begin(), cells.end(), std::back_inserter(on),
               [&](const Cell& cell) { return lies_on(cell, plane, tolerance); });
  return on;
}

// The plane with the most inliers (RANSAC), refitted to them; nothing below kMinCells.
std::optional<Plane> largest_plane(const std::vector<Cell>& cells, int side, double tolerance,
                                   cv::RNG& random) {
  std::optional<Plane> best;
  std::size_t most = kMinCells - 1;
  std::vector<Cell> near;
  for (int trial = 0; trial < kTrials && cells.size() > most; ++trial) {
    const Cell& first = cells[static_cast<std::size_t>(random.uniform(0, static_cast<int>(cells.size())))];
    near.clear();
    const double reach = kNeighbourhood * side;
    auto cell = std::partition_point(cells.begin(), cells.end(),  // they are in the order of their rows
                                     [&](const Cell& other) { return other.y < first.y - reach; });
    for (; cell != cells.end() && cell->y <= first.y + reach; ++cell)
      if (std::abs(cell->x - first.x) <= reach) near.push_back(*cell);
    std::vector<Cell> three{first};
    for (int i = 0; i < 2; ++i)
      three.push_back(near[static_cast<std::size_t>(random.uniform(0, static_cast<int>(near.size())))]);
    const auto plane = fitted(three);
    if (!plane) continue;
    const auto on = static_cast<std::size_t>(std::count_if(
        cells.begin(), cells.end(), [&](const Cell& other) { return lies_on(other, *plane, tolerance); }));
    if (on <= most) continue;
    if (const auto better = fitted(cells_on(cells, *plane, tolerance))) {
      most = on;
      best = better;
    }
  }
  return best;
}

// The surfaces around one hole.
class Surroundings {
 public:
  // box: of the hole and what is around it, cells.
  Surroundings(const Cells& cells, const cv::Rect& box, const DepthCompletionOptions& options)
      : cells_(cells), surface_(cells.inverse.size(), CV_32SC1, cv::Scalar(kUnknownSurface)) {
    std::vector<Cell> free;
    for (int y = box.y; y < box.br().y; ++y)
      for (int x = box.x; x < box.br().x; ++x)
        if (cells.inverse.at<float>(y, x) > 0.0F) free.push_back(cells.at(x, y));
    cv::RNG random(1);
    for (int i = 0; i < options.max_planes; ++i) {
      const auto plane = largest_plane(free, cells.side, options.plane_tolerance, random);
      if (!plane) break;
      std::erase_if(free, [&](const Cell& cell) { return lies_on(cell, *plane, options.plane_tolerance); });
      planes_.push_back(*plane);
    }
    assign(box, options.plane_tolerance);
  }

  // The surfaces that may be visible in a cell of the hole: those hit often enough, and the one hit most.
  struct Candidates {
    std::vector<int> often;
    int most = kUnknownSurface;
  };

  Candidates candidates_for(const cv::Point& cell, double min_votes) const {
    std::vector<double> votes(planes_.size() + 1, 0.0);  // the last: no depth
    double all = 0.0;
    for (int d = 0; d < kDirections; ++d) {
      const double angle = 2.0 * M_PI * d / kDirections;
      const auto [surface, distance] = first_hit(cell, {std::cos(angle), std::sin(angle)});
      if (distance == 0) continue;
      votes[surface == kUnknownSurface ? planes_.size() : static_cast<std::size_t>(surface)] +=
          1.0 / distance;
      all += 1.0 / distance;
    }
    Candidates candidates;
    double most = votes.back();
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      if (votes[i] > 0.0 && votes[i] >= min_votes * all) candidates.often.push_back(static_cast<int>(i));
      if (votes[i] <= most) continue;
      most = votes[i];
      candidates.most = static_cast<int>(i);
    }
    return candidates;
  }

  // Inverse depth at a pixel: of the surfaces hit often the nearest; 0 = none.
  double at(int x, int y, const Candidates& candidates) const {
    double nearest = 0.0;
    for (const int surface : candidates.often) nearest = std::max(nearest, plausible_inverse(surface, x, y));
    return nearest > 0.0 || candidates.most == kUnknownSurface ? nearest
                                                               : plausible_inverse(candidates.most, x, y);
  }

 private:
  // A cell on no plane becomes a fronto-parallel surface of its own.
  void assign(const cv::Rect& box, double tolerance) {
    for (int y = box.y; y < box.br().y; ++y) {
      for (int x = box.x; x < box.br().x; ++x) {
        const Cell cell = cells_.at(x, y);
        if (!(cell.inverse > 0.0)) continue;
        largest_ = std::max(largest_, cell.inverse);
        int& surface = surface_.at<int>(y, x);
        for (std::size_t i = 0; i < planes_.size() && surface == kUnknownSurface; ++i)
          if (lies_on(cell, planes_[i], tolerance)) surface = static_cast<int>(i);
        if (surface != kUnknownSurface) continue;
        surface = static_cast<int>(planes_.size());
        planes_.emplace_back(0.0, 0.0, cell.inverse);
      }
    }
  }

  double plausible_inverse(int surface, int x, int y) const {
    const double inverse = inverse_depth(planes_[static_cast<std::size_t>(surface)], x, y);
    return inverse <= 1.5 * largest_ ? std::max(inverse, 0.0) : 0.0;
  }

  struct Hit {
    int surface;
    int distance;  // cells; 0 = none before the border of the image
  };

  Hit first_hit(const cv::Point& cell, const cv::Point2d& direction) const {
    const cv::Rect image({0, 0}, surface_.size());
    for (int step = 1;; ++step) {
      const cv::Point at(cvRound(cell.x + step * direction.x), cvRound(cell.y + step * direction.y));
      if (!image.contains(at)) return {kUnknownSurface, 0};
      if (cells_.is_hole.at<std::uint8_t>(at) == 0) return {surface_.at<int>(at), step};
    }
  }

  const Cells& cells_;
  cv::Mat surface_;  // CV_32SC1 of cells
  std::vector<Plane> planes_;
  double largest_ = 0.0;  // inverse depth around the hole
};

cv::Rect around(const cv::Rect& box, int side, const cv::Size& image) {
  const int by = std::max(64, 3 * std::max(box.width, box.height) / 4);
  const cv::Rect wide(box.x - by, box.y - by, box.width + 2 * by, box.height + 2 * by);
  const cv::Rect inside = wide & cv::Rect({0, 0}, image);
  const cv::Point first(inside.x / side, inside.y / side);
  const cv::Point last((inside.br().x - 1) / side + 1, (inside.br().y - 1) / side + 1);
  return {first, last};
}

// The cells that a box of pixels touches, each with its pixels in the box.
template <typename Visit>
void for_each_cell(const cv::Rect& box, int side, const Visit& visit) {
  for (int y = box.y / side; y * side < box.br().y; ++y)
    for (int x = box.x / side; x * side < box.br().x; ++x)
      visit(cv::Point(x, y), cv::Rect(x * side, y * side, side, side) & box);
}
}  // namespace

cv::Mat completed_depth(const cv::Mat& depth, const cv::Mat& hole, const DepthCompletionOptions& options) {
  CV_Assert(depth.type() == CV_32FC1 && hole.type() == CV_8UC1 && depth.size() == hole.size());
  cv::Mat result = cv::Mat::zeros(depth.size(), CV_32FC1);
  const Cells cells = cells_of(depth, hole, options);
  // Neighbouring holes share their surroundings.
  cv::Mat joined, parts;
  cv::dilate(hole, joined, cv::Mat(), {-1, -1}, 2 * options.cell);
  const int count = cv::connectedComponents(joined, parts);
  for (int part = 1; part < count; ++part) {
    const cv::Mat of_part = (parts == part) & hole;
    const cv::Rect box = cv::boundingRect(of_part);
    const Surroundings surroundings(cells, around(box, options.cell, depth.size()), options);
    for_each_cell(box, options.cell, [&](const cv::Point& cell, const cv::Rect& pixels) {
      if (cv::countNonZero(of_part(pixels)) == 0) return;
      const auto candidates = surroundings.candidates_for(cell, options.min_votes);
      for (int y = pixels.y; y < pixels.br().y; ++y) {
        for (int x = pixels.x; x < pixels.br().x; ++x) {
          if (of_part.at<std::uint8_t>(y, x) == 0) continue;
          const double inverse = surroundings.at(x, y, candidates);
          if (inverse > 0.0) result.at<float>(y, x) = static_cast<float>(1.0 / inverse);
        }
      }
    });
  }
  return result;
}

}  // namespace roslam
