// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/export_dense.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <string_view>

#include "apps/roslam/output.hpp"
#include "roslam/cloud/occupancy.hpp"
#include "roslam/cloud/surface_file.hpp"
#include "roslam/error.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

Surface read_points(const fs::path& map, const DenseExport& what) {
  Surface surface = read_surface_ply(map);
  if (surface.points.empty()) {
    throw InputError(map.string() +
                     ": the map is empty, as nothing was fused into it; fly where things are "
                     "nearer than dense.max_depth and check the camera's depth units");
  }
  if (!what.no_invented) return surface;
  surface = without_invented(surface);
  if (surface.points.empty())
    throw InputError(map.string() + ": all of the map was invented; leave out --no-invented");
  return surface;
}

// Occupied where points are; free as a file beside the map tells, which the run wrote from what cameras saw.
Occupancy occupancy_of_points(const fs::path& map, const Surface& surface, const DenseExport& what) {
  const fs::path seen_file = fs::path(map).replace_extension(".bt");
  std::optional<Occupancy> seen;
  if (fs::exists(seen_file)) {
    seen = Occupancy::read(seen_file);
  } else {
    std::cerr << "note: " << seen_file.string()
              << ": no such file, so that only occupied cells are known and none is free\n";
  }
  const double usual = seen ? seen->resolution() : usual_resolution(surface.spacing);
  Occupancy result(what.resolution.value_or(usual));
  result.add_surface(surface);
  if (seen) result.free_from(*seen);
  return result;
}

void say(const fs::path& file, const std::string& content) {
  std::printf("wrote %s: %s\n", content.c_str(), file.c_str());
}
}  // namespace

bool is_dense_map(const fs::path& file) {
  if (file.extension() == ".ply") return true;
  std::array<char, 3> begin{};
  std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
  return std::string_view(begin.data(), begin.size()) == "ply";
}

void export_dense(const fs::path& map, const DenseExport& what) {
  const Surface surface = read_points(map, what);
  if (!what.mesh.empty() && surface.triangles.empty()) {
    throw InputError(
        map.string() +
        ": has points but no triangles; leave out --mesh, or give the dense.ply that a run wrote");
  }
  const std::string points = std::to_string(surface.points.size()) + " points";
  if (!what.ply.empty()) {
    write_surface_ply(what.ply, surface, false);
    say(what.ply, points);
  }
  if (!what.mesh.empty()) {
    write_surface_ply(what.mesh, surface, true);
    say(what.mesh, points + " and " + std::to_string(surface.triangles.size()) + " triangles");
  }
  if (!what.pcd.empty()) {
    write_surface_pcd(what.pcd, surface);
    say(what.pcd, points);
  }
  if (!what.octomap.empty()) {
    const Occupancy occupancy = occupancy_of_points(map, surface, what);
    occupancy.write(what.octomap);
    std::array<char, 96> content{};
    std::snprintf(content.data(), content.size(), "cells of %g m, %.4g m3 occupied and %.4g m3 free",
                  occupancy.resolution(), occupancy.occupied_volume(), occupancy.free_volume());
    say(what.octomap, content.data());
  }
  require_written_output();
}

}  // namespace roslam::app
