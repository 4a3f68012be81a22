// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "roslam/dynamic_objects/movable_object.hpp"

namespace roslam {

/// The paper's auxiliary descriptor of a frame, as printed (eq. 12):
///
///   l1 u1 u2 l2
///   v1  p  c v2
///   v3  b  n v4
///   l3 u3 u4 l4
///
/// p, c, b, n are 1 where the frame shows a person, a car, a bicycle, an unlabelled moving object, else 0.
/// Around each flag stand the centre (u, v) of its region in pixels and the region's side l, the larger of
/// its height and width in pixels; all 0 where the flag is. Of several regions of a class the one with most
/// pixels is used.
Eigen::Matrix4i auxiliary_descriptor(const std::vector<MovableObject>& objects);

}  // namespace roslam
