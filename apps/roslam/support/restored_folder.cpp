// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/restored_folder.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/roslam/support/output.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

using namespace recording;

namespace {
namespace fs = std::filesystem;

constexpr const char* kProvenance = "provenance";
constexpr const char* kReport = "restoration.json";

void remove_result(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (error)
    throw OutputError(path.string() + ": left by an earlier run and cannot be removed; choose another --out");
}

fs::path prepared(const fs::path& folder) {
  RestoredFolder::require_usable(folder);
  make_folder(folder);
  for (const char* name : {"rgb", "depth", kProvenance, "before_after.jpg", "rgb.txt", "depth.txt"})
    remove_result(folder / name);
  for (const char* name : {"rgb", "depth", kProvenance}) make_folder(folder / name);
  write_file(folder / kReport, "{}\n");
  return folder;
}

// Of images with depth, whatever gave it.
Camera depth_camera(Camera camera) {
  constexpr double kMillimetres = 1000.0;
  camera.baseline = 0.0;
  if (!(camera.depth_units_per_metre > 0.0)) camera.depth_units_per_metre = kMillimetres;
  return camera;
}

bool lies_in(const fs::path& inner, const fs::path& outer) {
  const auto [end, at] = std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
  return end == outer.end();
}
}  // namespace

RestoredFolder::RestoredFolder(fs::path folder, const Camera& camera)
    : folder_(prepared(folder)),
      camera_(depth_camera(camera)),
      colours_(folder_ / "rgb.txt"),
      depths_(folder_ / "depth.txt") {
  write_file(folder_ / "camera.yaml", camera_to_yaml(camera_));
  colours_.line("# timestamp filename");
  depths_.line("# timestamp filename");
}

void RestoredFolder::require_usable(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / kReport, error)) return;
  for (const char* name :
       {"rgb.txt", "rgb", "depth.txt", "depth", "camera.yaml", "before_after.jpg", kProvenance, "run.json"}) {
    if (fs::exists(folder / name, error))
      throw OutputError(folder.string() +
                        ": holds a dataset or a run, which the result could replace; choose another --out");
  }
}

void RestoredFolder::require_apart(const fs::path& folder, const fs::path& source) {
  std::error_code error;
  const fs::path to = fs::weakly_canonical(folder, error);
  const fs::path from = fs::weakly_canonical(source, error);
  const bool is_same = to == from;
  const bool is_part =
      lies_in(from, to / "rgb") || lies_in(from, to / "depth") || lies_in(from, to / kProvenance);
  if (is_same || is_part)
    throw OutputError(folder.string() + ": holds the frames that are to be restored; choose another --out");
}

void RestoredFolder::remove_old(const fs::path& folder) {
  const auto report = nlohmann::json::parse(std::ifstream(folder / kReport), nullptr, false);
  if (report.is_object() && report.value("method", "") == kInFlight) remove_result(folder);
}

void RestoredFolder::add(const Frame& frame, const RestoredImage& restored, const std::string& name) {
  const std::string time = time_text(frame.timestamp);
  const std::string file = (names_.insert(name).second ? name : time) + ".png";
  write_image_fast(folder_ / "rgb" / file, restored.colour);
  write_image_fast(folder_ / kProvenance / file, restored.provenance);
  colours_.line(time + " rgb/" + file);
  if (!restored.depth.empty()) {
    write_image_fast(folder_ / "depth" / file, packed_depth(restored.depth, camera_.depth_units_per_metre));
    depths_.line(time + " depth/" + file);
    has_depth_ = true;
  }
  ++frames_;
  pixels_ += restored.colour.total();
  reprojected_ += restored.pixels_of(Provenance::kReprojected);
  inpainted_ += restored.pixels_of(Provenance::kInpainted);
  images_.add(frame.colour, restored);
}

void RestoredFolder::close(const std::string& report) {
  colours_.close();
  depths_.close();
  if (!has_depth_) {
    remove_result(folder_ / "depth.txt");
    remove_result(folder_ / "depth");
  }
  write_file(folder_ / kReport, report);
  if (const cv::Mat strip = images_.strip(); !strip.empty()) write_image(folder_ / "before_after.jpg", strip);
}

}  // namespace roslam::app
