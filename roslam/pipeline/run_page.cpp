// SPDX-License-Identifier: BSD-3-Clause
// report.html: what a run came to, to look at.
#include <algorithm>
#include <exception>
#include <utility>

#include "roslam/cloud/map_picture.hpp"
#include "roslam/error.hpp"
#include "roslam/evaluation/html_page.hpp"
#include "roslam/evaluation/trajectory_error.hpp"
#include "roslam/evaluation/trajectory_plot.hpp"
#include "roslam/failure.hpp"
#include "roslam/pipeline/run_folder.hpp"

namespace roslam {

namespace {
std::string percent(std::size_t part, std::size_t whole) {
  return percentage(static_cast<double>(part) / static_cast<double>(whole));
}

std::string megabytes(std::size_t bytes) { return fixed(static_cast<double>(bytes) / 1048576.0, 0) + " MB"; }

class RunPage {
 public:
  RunPage(const Slam& slam, const RunSummary& summary, const RunDescription& description,
          std::filesystem::path folder)
      : slam_(slam),
        summary_(summary),
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
    row("camera", description_.camera);
    row("mode", slam_.mode() == Mode::kDeterministic ? "deterministic" : "real time");
    row("frames tracked", std::to_string(trajectory_.size()) + " of " + std::to_string(slam_.frames()) +
                              " (" + percent(trajectory_.size(), slam_.frames()) + ")");
    if (slam_.mode() == Mode::kRealTime) row("frames dropped", std::to_string(summary_.dropped));
    row("keyframes, landmarks",
        std::to_string(slam_.map().keyframe_count()) + ", " + std::to_string(slam_.map().landmark_count()));
    row("loops closed", std::to_string(slam_.loops().size()));
    if (summary_.dense) row("points of the dense map", std::to_string(summary_.dense->surface.points.size()));
    row("time", fixed(summary_.wall_seconds, 1) + " s");
    row("memory at its peak", megabytes(peak_memory()));
    page_.add_table(rows);
    if (summary_.interrupted) page_.add_text("The run was interrupted; this is what was there by then.");
    if (summary_.failure) page_.add_text("The run ended early: " + words_of(summary_.failure));
  }

  void add_trajectory() {
    page_.add_heading("Trajectory");
    if (trajectory_.empty()) return page_.add_text("No frame was tracked.");
    if (!add_errors()) page_.add_picture(plot_trajectory(trajectory_, "RO-SLAM", WorldUp::kZ), "The path.");
  }

  // False if no truth is known that the path can be compared with.
  bool add_errors() {
    if (summary_.truth.empty()) return false;
    try {
      const TrajectoryError error = evaluate_trajectory(summary_.truth, trajectory_);
      page_.add_table(
          {{"after SE(3) alignment", "RMSE", "median", "largest"},
           {"absolute error, m", fixed(error.ate.rmse, 4), fixed(error.ate.median, 4),
            fixed(error.ate.max, 4)},
           {"relative error over 1 s, m", fixed(error.rpe_span.translation.rmse, 4),
            fixed(error.rpe_span.translation.median, 4), fixed(error.rpe_span.translation.max, 4)}});
      page_.add_text("Over " + fixed(error.path_length, 1) + " m, " + std::to_string(error.pairs) +
                     " poses; the error is " + fixed(error.ate_percent, 2) + " % of the way.");
      page_.add_picture(plot_trajectory_errors(summary_.truth, {{"RO-SLAM", error}}, WorldUp::kZ),
                        "The path from above, coloured by its error, and the error over time.");
      return true;
    } catch (const InputError&) {  // too few poses have a truth
      return false;
    }
  }

  void add_removal() {
    if (!summary_.removal || summary_.removal->frames == 0) return;
    const RemovalTally& tally = *summary_.removal;
    page_.add_heading("What was removed");
    page_.add_text("On average " + percentage(tally.removed_area / static_cast<double>(tally.frames)) +
                   " of the picture.");
    std::size_t all = tally.kept_points;
    for (const auto& [kind, count] : tally.removed_points) all += count;
    std::vector<TableRow> rows{{"ORB points", "number", "share"},
                               {"kept", std::to_string(tally.kept_points), percent(tally.kept_points, all)}};
    for (const auto& [kind, count] : tally.removed_points)
      rows.push_back({"removed: " + kind, std::to_string(count), percent(count, all)});
    page_.add_table(rows);
    page_.add_picture_file(folder_ / "removal.jpg", "Frames of the run: points kept and removed, masks.");
    page_.add_picture_file(folder_ / "restoration.jpg",
                           "Keyframes as taken, restored, and where that comes from: green was seen at "
                           "another time, magenta is invented.");
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
                     row("seen at another time", Provenance::kReprojected),
                     row("invented", Provenance::kInvented)});
    page_.add_text("Voxels of " + fixed(dense.voxel_size, 2) + " m from " + std::to_string(dense.keyframes) +
                   " keyframes, " + megabytes(dense.voxel_bytes) + ", and " + megabytes(dense.view_bytes) +
                   " of views to follow the keyframes with.");
    add_map_pictures(dense);
  }

  // As figure 8 of the paper: with what moves, with the holes it leaves, restored.
  void add_map_pictures(const DenseMap& dense) {
    std::vector<bool> is_measured;
    for (const SurfacePoint& point : dense.surface.points)
      is_measured.push_back(point.provenance == Provenance::kMeasured);
    const Surface with_holes = kept(dense.surface, is_measured);
    Surface with_movers = with_holes;
    with_movers.points.insert(with_movers.points.end(), dense.removed.begin(), dense.removed.end());
    const cv::Size size(1000, 600);
    const auto draw = [&](const Surface& surface, const MapView& view, MapColour colour,
                          const char* caption) {
      page_.add_picture(draw_surface(surface, view, colour, dense.voxel_size), caption);
    };
    if (!trajectory_.empty()) {
      const MapView front = front_view(trajectory_.front().T_world_camera, size);
      if (!dense.removed.empty()) {
        draw(with_movers, front, MapColour::kRgb,
             "With all that moved while it was flown, which is removed.");
        draw(with_holes, front, MapColour::kRgb, "With the holes that this leaves.");
      }
      draw(dense.surface, front, MapColour::kRgb, "The map.");
      draw(dense.surface, front, MapColour::kProvenance,
           "Where it comes from: grey was measured, green seen at another time, magenta is invented.");
    }
    const MapView top = top_view(dense.surface, size);
    if (!dense.removed.empty()) draw(with_holes, top, MapColour::kRgb, "From above, with holes.");
    draw(dense.surface, top, MapColour::kRgb, "From above.");
    draw(dense.surface, top, MapColour::kHeight, "From above, by height.");
    draw(dense.surface, top, MapColour::kClass, "From above, by class; black was not labelled.");
  }

  void add_times() {
    page_.add_heading("Processor time");
    std::vector<TableRow> rows{{"stage", "times", "median, ms", "95th percentile", "largest"}};
    for (const auto& [stage, s] : slam_.times().summary()) {
      rows.push_back(
          {stage, std::to_string(s.count), fixed(s.median_ms, 2), fixed(s.p95_ms, 2), fixed(s.max_ms, 2)});
    }
    page_.add_table(rows);
  }

  void add_settings() {
    page_.add_heading("Settings");
    page_.add_text("Version " + description_.version + ". Everything else is in run.json.");
    page_.add_hidden("Options", options_to_yaml(slam_.options()));
    page_.add_hidden("Camera", camera_to_yaml(slam_.camera()));
  }

  const Slam& slam_;
  const RunSummary& summary_;
  const RunDescription& description_;
  std::filesystem::path folder_;
  Trajectory trajectory_;
  HtmlPage page_;
};
}  // namespace

std::string run_page(const Slam& slam, const RunSummary& summary, const RunDescription& description,
                     const std::filesystem::path& folder) {
  return RunPage(slam, summary, description, folder).html();
}

}  // namespace roslam
