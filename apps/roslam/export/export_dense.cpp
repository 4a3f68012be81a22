// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/export/export_dense.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <string_view>

#include "apps/roslam/support/output.hpp"
#include "roslam/common/error.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/occupancy/occupancy_map.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

SurfaceMap read_points(const fs::path& map, const DenseExport& what) {
  SurfaceMap surface = read_surface_ply(map);
  if (surface.points.empty()) {
    throw InputError(map.string() +
                     ": the map is empty, nothing was fused into it; fly where surfaces are "
                     "nearer than dense.max_depth and check the camera's depth units");
  }
  if (!what.no_inpainted) return surface;
  surface = without_inpainted(surface);
  if (surface.points.empty())
    throw InputError(map.string() + ": all points of the map are inpainted; leave out --no-inpainted");
  return surface;
}

// Occupied cells come from the points, free cells from the dense.bt beside the map, which the run wrote by
// ray casting from the camera positions.
OccupancyMap occupancy_of_points(const fs::path& map, const SurfaceMap& surface, const DenseExport& what) {
  const fs::path of_run_file = fs::path(map).replace_extension(".bt");
  std::optional<OccupancyMap> of_run;
  if (fs::exists(of_run_file)) {
    of_run = OccupancyMap::read(of_run_file);
  } else {
    std::cerr << "note: " << of_run_file.string()
              << ": no such file; only occupied cells are known, all others are unknown\n";
  }
  const double usual = of_run ? of_run->resolution() : usual_resolution(surface.spacing);
  OccupancyMap result(what.resolution.value_or(usual));
  result.add_surface(surface);
  if (of_run) result.free_from(*of_run);
  return result;
}

void report(const fs::path& file, const std::string& content) {
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
  const SurfaceMap surface = read_points(map, what);
  if (!what.mesh.empty() && surface.triangles.empty()) {
    throw InputError(
        map.string() +
        ": has points but no triangles; leave out --mesh, or give the dense.ply that a run wrote");
  }
  const std::string points = std::to_string(surface.points.size()) + " points";
  if (!what.ply.empty()) {
    write_surface_ply(what.ply, surface, false);
    report(what.ply, points);
  }
  if (!what.mesh.empty()) {
    write_surface_ply(what.mesh, surface, true);
    report(what.mesh, points + " and " + std::to_string(surface.triangles.size()) + " triangles");
  }
  if (!what.pcd.empty()) {
    write_surface_pcd(what.pcd, surface);
    report(what.pcd, points);
  }
  if (!what.octomap.empty()) {
    const OccupancyMap occupancy = occupancy_of_points(map, surface, what);
    occupancy.write(what.octomap);
    std::array<char, 96> content{};
    std::snprintf(content.data(), content.size(), "cells of %g m, %.4g m3 occupied and %.4g m3 free",
                  occupancy.resolution(), occupancy.occupied_volume(), occupancy.free_volume());
    report(what.octomap, content.data());
  }
  require_written_output();
}

}  // namespace roslam::app
