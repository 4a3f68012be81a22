// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

#include "roslam/dense/live_surface.hpp"
#include "roslam/slam/map_snapshot.hpp"
#include "telemetry/view/revised.hpp"

namespace roslam::telemetry {

/// The changes of the map as the page reads them: little endian, a header of 24 bytes
///   u32 flags       1: forget what was there before, 2: there is more, ask again at once
///   u32 revision    to ask from the next time
///   u32 count       of records
///   u32 submap      that is shown
///   f32 side        of a block in metres (surfaces), else 0
///   u32 total       poses in the path, else 0
/// and records without gaps:
///   keyframe  u32 id, u32 submap, f32 x y z, f32 qw qx qy qz                   36 bytes
///   point     u32 id, u32 submap, f32 x y z, u8 r g b, u8 is_gone              24 bytes
///   pose      u32 index, f32 x y z                                             16 bytes
///   block     i32 x y z, u32 n, then n times u8 x y z (256ths of the side), u8 r g b
/// Keyframes that are gone have the submap 0xffffffff; blocks that are gone have no points. Poses
/// T_world_camera. Threads: any.
class MapFeed {
 public:
  /// Takes over the map as it is now.
  void update(const MapSnapshot& map);

  std::string keyframes(std::uint32_t since) const;
  std::string points(std::uint32_t since) const;
  std::string path(std::uint32_t since) const;

  /// Rises with every change.
  std::uint64_t revision() const;

 private:
  struct Keyframe {
    std::uint32_t submap = 0;
    std::array<float, 7> pose{};
    bool operator==(const Keyframe&) const = default;
  };
  struct Point {
    std::uint32_t submap = 0;
    std::array<float, 3> position{};
    std::array<std::uint8_t, 3> colour{};
    bool operator==(const Point& other) const;
  };
  struct Pose {
    std::array<float, 3> position{};
    bool operator==(const Pose& other) const;
  };

  mutable std::mutex mutex_;
  Revised<Keyframe> keyframes_;
  Revised<Point> points_;
  Revised<Pose> path_;
  std::uint32_t submap_ = SubmapId::kNone;
  std::uint32_t path_length_ = 0;
};

/// Surfaces in the format above.
std::string encode(const SurfaceChanges& changes);

}  // namespace roslam::telemetry
