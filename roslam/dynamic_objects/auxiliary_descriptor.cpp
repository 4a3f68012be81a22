// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/auxiliary_descriptor.hpp"

#include <algorithm>
#include <array>

namespace roslam {

namespace {
struct Corner {
  Movable kind;
  int row;     // of the corner of the matrix that belongs to the class: 0 or 3
  int column;  // 0 or 3
};

constexpr std::array<Corner, 4> kCorners{
    {{Movable::kPerson, 0, 0}, {Movable::kCar, 0, 3}, {Movable::kBicycle, 3, 0}, {Movable::kUnknown, 3, 3}}};

int inwards(int index) { return index == 0 ? 1 : 2; }
}  // namespace

Eigen::Matrix4i auxiliary_descriptor(const std::vector<MovableObject>& objects) {
  Eigen::Matrix4i matrix = Eigen::Matrix4i::Zero();
  for (const auto& [kind, row, column] : kCorners) {
    const MovableObject* largest = nullptr;
    int most = 0;
    for (const auto& object : objects) {
      const int pixels = object.kind == kind ? cv::countNonZero(object.mask) : 0;
      if (pixels <= most) continue;
      most = pixels;
      largest = &object;
    }
    if (largest == nullptr) continue;
    const cv::Rect& box = largest->box;
    matrix(inwards(row), inwards(column)) = 1;
    matrix(row, column) = std::max(box.width, box.height);
    matrix(row, inwards(column)) = box.x + box.width / 2;   // u
    matrix(inwards(row), column) = box.y + box.height / 2;  // v
  }
  return matrix;
}

}  // namespace roslam
