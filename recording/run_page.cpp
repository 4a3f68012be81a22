// SPDX-License-Identifier: BSD-3-Clause
// report.html: the results of a run in tables and figures.
#include <algorithm>
#include <exception>
#include <utility>

#include "evaluation/plots/html_page.hpp"
#include "evaluation/trajectory_error.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "recording/map_render.hpp"
#include "recording/process_info.hpp"
#include "recording/run_folder.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/failure.hpp"

namespace roslam::recording {

using namespace evaluation;

namespace {
std::string percent(std::size_t part, std::size_t whole) {
  return percentage(static_cast<double>(part) / static_cast<double>(whole));
}

std::string megabytes(std::size_t bytes) { return fixed(static_cast<double>(bytes) / 1048576.0, 0) + " MB"; }

class RunPage {
 public:
  RunPage(const Slam& slam, const RunResults& summary, const FrameSource& source,
          const RunDescription& description, std::filesystem::path folder)
      : slam_(slam),
        summary_(summary),
        source_(source),
        description_(description),
        folder_(std::move(folder)),
        trajectory_(slam.trajectory()),
        page_("RO-SLAM: " + description.source) {}

  std::string html() {
    add_summary();
    add_trajectory();
    add_removal();
    if (summary_.dense) add_dense(*summary_.dense);
    add_times();
    add_settings();
    return page_.html();
  }

 private:
  void add_summary() {
    std::vector<TableRow> rows{{"", ""}};
    const auto row = [&](const std::string& name, const std::string& value) {
      rows.push_back({name, value});
    };
    row("run", description_.id);
    row("camera", description_.camera);
    row("mode", slam_.mode() == Mode::kDeterministic ? "deterministic" : "real time");
    row("frames", count_frames(slam_, summary_, source_).in_words());
    for (const auto& [warning, frames] : slam_.warnings()) row("warning", warning);
    for (const auto& [note, number] : source_.notes())
      row("note", note + (number > 1 ? " (" + std::to_string(number) + " times)" : ""));
    row("keyframes, landmarks",
        std::to_string(slam_.map().keyframe_count()) + ", " + std::to_string(slam_.map().landmark_count()));
    row("loops closed", std::to_string(slam_.loops().size()));
    if (summary_.dense) row("points of the dense map", std::to_string(summary_.dense->surface.points.size()));
    row("time", fixed(summary_.wall_seconds, 1) + " s");
    row("peak memory", megabytes(peak_memory()));
    page_.add_table(rows);
    if (summary_.interrupted) page_.add_text("The run was interrupted; these are the results so far.");
    if (summary_.failure) page_.add_text("The run ended early: " + message_of(summary_.failure));
  }

  void add_trajectory() {
    page_.add_heading("Trajectory");
    if (trajectory_.empty()) return page_.add_text("No frame was tracked.");
    if (!add_errors())
      page_.add_image(plot_trajectory(trajectory_, "RO-SLAM", WorldUp::kZ), "The trajectory.");
  }

  // False if there is no truth that the trajectory can be compared with.
  bool add_errors() {
    if (summary_.truth.empty()) return false;
    try {
      const TrajectoryError error = evaluate_trajectory(summary_.truth, trajectory_);
      page_.add_table(
          {{"after SE(3) alignment", "RMSE", "median", "maximum"},
           {"absolute error, m", fixed(error.ate.rmse, 4), fixed(error.ate.median, 4),
            fixed(error.ate.max, 4)},
           {"relative error over 1 s, m", fixed(error.rpe_span.translation.rmse, 4),
            fixed(error.rpe_span.translation.median, 4), fixed(error.rpe_span.translation.max, 4)}});
      page_.add_text("Over " + fixed(error.path_length, 1) + " m, " + std::to_string(error.pairs) +
                     " poses; the error is " + fixed(error.ate_percent, 2) + " % of the path length.");
      page_.add_image(plot_trajectory_errors(summary_.truth, {{"RO-SLAM", error}}, WorldUp::kZ),
                      "The trajectory from above, coloured by its error, and the error over time.");
      return true;
    } catch (const InputError&) {  // too few poses have a true one
      return false;
    }
  }

  void add_removal() {
    if (!summary_.removal || summary_.removal->frames == 0) return;
    const RemovalTally& tally = *summary_.removal;
    page_.add_heading("Dynamic objects");
    page_.add_text("On average " + percentage(tally.removed_area / static_cast<double>(tally.frames)) +
                   " of the image area is removed.");
    std::size_t all = tally.kept_points;
    for (const auto& [kind, count] : tally.removed_points) all += count;
    std::vector<TableRow> rows{{"ORB points", "number", "share"},
                               {"kept", std::to_string(tally.kept_points), percent(tally.kept_points, all)}};
    for (const auto& [kind, count] : tally.removed_points)
      rows.push_back({"removed: " + kind, std::to_string(count), percent(count, all)});
    page_.add_table(rows);
    page_.add_image_file(folder_ / "removal.jpg",
                         "Frames of the run: points kept and removed, masks of dynamic objects.");
    page_.add_image_file(folder_ / "restoration.jpg",
                         "Keyframes as taken, restored, and their provenance: green reprojected from "
                         "other images, magenta inpainted.");
  }

  void add_dense(const DenseMap& dense) {
    page_.add_heading("Dense map");
    if (dense.surface.points.empty())
      return page_.add_text("It is empty: " + std::string(why_empty(dense)) + ".");
    auto points = count_by_provenance(dense.surface);
    const std::size_t all = dense.surface.points.size();
    const auto row = [&](const char* name, Provenance provenance) {
      return TableRow{name, std::to_string(points[provenance]), percent(points[provenance], all)};
    };
    page_.add_table({{"points", "number", "share"},
                     row("measured", Provenance::kMeasured),
                     row("reprojected", Provenance::kReprojected),
                     row("inpainted", Provenance::kInpainted)});
    page_.add_text("Voxels of " + fixed(dense.voxel_size, 2) + " m from " + std::to_string(dense.keyframes) +
                   " keyframes, " + megabytes(dense.voxel_bytes) + ", and " + megabytes(dense.view_bytes) +
                   " of depth keyframes to fuse again after a correction.");
    add_map_images(dense);
  }

  // As figure 8 of the paper: with dynamic objects, with the holes they leave, restored.
  void add_map_images(const DenseMap& dense) {
    std::vector<bool> is_measured;
    for (const SurfacePoint& point : dense.surface.points)
      is_measured.push_back(point.provenance == Provenance::kMeasured);
    const SurfaceMap with_holes = filter_points(dense.surface, is_measured);
    SurfaceMap with_dynamic = with_holes;
    with_dynamic.points.insert(with_dynamic.points.end(), dense.removed.begin(), dense.removed.end());
    const cv::Size size(1000, 600);
    const auto draw = [&](const SurfaceMap& surface, const Viewpoint& view, MapColour colour,
                          const char* caption) {
      page_.add_image(draw_surface(surface, view, colour, dense.voxel_size), caption);
    };
    if (!trajectory_.empty()) {
      const Viewpoint front = front_view(trajectory_.front().T_world_camera, size);
      if (!dense.removed.empty()) {
        draw(with_dynamic, front, MapColour::kRgb,
             "With the dynamic objects, which are removed from the map.");
        draw(with_holes, front, MapColour::kRgb, "With the holes that they leave.");
      }
      draw(dense.surface, front, MapColour::kRgb, "The map.");
      draw(dense.surface, front, MapColour::kProvenance,
           "Provenance: grey measured, green reprojected from other images, magenta inpainted.");
    }
    const Viewpoint top = top_view(dense.surface, size);
    if (!dense.removed.empty()) draw(with_holes, top, MapColour::kRgb, "From above, with holes.");
    draw(dense.surface, top, MapColour::kRgb, "From above.");
    draw(dense.surface, top, MapColour::kHeight, "From above, by height.");
    draw(dense.surface, top, MapColour::kClass, "From above, by class; black is unlabelled.");
  }

  void add_times() {
    page_.add_heading("Processor time");
    std::vector<TableRow> rows{{"stage", "count", "median, ms", "95th percentile, ms", "maximum, ms"}};
    for (const auto& [stage, s] : slam_.times().summary()) {
      rows.push_back(
          {stage, std::to_string(s.count), fixed(s.median_ms, 2), fixed(s.p95_ms, 2), fixed(s.max_ms, 2)});
    }
    page_.add_table(rows);
  }

  void add_settings() {
    page_.add_heading("Settings");
    page_.add_text("Version " + description_.version + ". All other results are in run.json.");
    page_.add_hidden("Options", options_to_yaml(slam_.options()));
    page_.add_hidden("Camera", camera_to_yaml(slam_.camera()));
  }

  const Slam& slam_;
  const RunResults& summary_;
  const FrameSource& source_;
  const RunDescription& description_;
  std::filesystem::path folder_;
  Trajectory trajectory_;
  HtmlPage page_;
};
}  // namespace

std::string run_page(const Slam& slam, const RunResults& summary, const FrameSource& source,
                     const RunDescription& description, const std::filesystem::path& folder) {
  return RunPage(slam, summary, source, description, folder).html();
}

}  // namespace roslam::recording
