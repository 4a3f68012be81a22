// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "recording/mavlink_json.hpp"
#include "recording/process_info.hpp"
#include "recording/run_folder.hpp"
#include "roslam/common/failure.hpp"

namespace roslam::recording {

namespace {
using Json = nlohmann::ordered_json;

double rounded(double value, int decimals) {
  const double factor = std::pow(10.0, decimals);
  return std::round(value * factor) / factor;
}

// The beginning of run.json: what runs.
Json head_json(const RunDescription& description, bool is_finished) {
  Json json{{"run", description.id},
            {"finished", is_finished},
            {"version", description.version},
            {"source", description.source}};
  if (!description.flight.empty()) json["flight"] = description.flight;
  return json;
}

// Bytes of file names that are not valid UTF-8 are replaced rather than refused.
std::string text_of(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json camera_json(const Camera& camera, const RunDescription& description) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T_body_camera = camera.T_body_camera.matrix();
  return {{"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"model", lens_model_name(camera.model)},
          {"distortion", camera.coefficients()},
          {"depth_units_per_metre", camera.depth_units_per_metre},
          {"fps", camera.fps},
          {"baseline", camera.baseline},
          {"T_body_camera", std::vector<double>(T_body_camera.data(), T_body_camera.data() + 16)},
          {"name", description.camera}};
}

Json counts_json(const std::map<std::string, std::size_t>& counts) {
  Json json = Json::object();
  for (const auto& [reason, count] : counts) json[reason] = count;
  return json;
}

Json noise_json(const MeasurementNoise& noise) {
  return {{"estimated", noise.estimate},
          {"pixel_sigma", rounded(noise.pixel_sigma, 2)},
          {"depth_constant_m", rounded(noise.depth_sigma, 5)},
          {"depth_growth_per_m", rounded(noise.depth_sigma_growth, 5)}};
}

Json gyroscope_json(const GyroscopeState& state) {
  const auto values = [](const Eigen::Vector3d& v) {
    return Json::array({rounded(v.x(), 5), rounded(v.y(), 5), rounded(v.z(), 5)});
  };
  return {{"agrees", state.agrees},
          {"bias_rad_per_s", values(state.bias)},
          {"bias_sigma_rad_per_s", values(state.bias_sigma)},
          {"samples", state.samples},
          {"skipped", state.skipped}};
}

// in_source = processed + dropped + all skipped, unless the run ended early.
Json frames_json(const Slam& slam, const RunResults& summary, const FrameSource& source) {
  std::size_t tracked = 0;
  Json by_state = Json::object();
  for (const auto& [state, count] : slam.frames_by_state()) {
    by_state[std::string(name_of(state))] = count;
    if (state == TrackingState::kTracking) tracked = count;
  }
  const FrameCounts counts = count_frames(slam, summary, source);
  return {{"in_source", counts.in_source},
          {"processed", counts.processed},
          {"tracked", tracked},
          {"tracked_share",
           static_cast<double>(tracked) / static_cast<double>(std::max<std::size_t>(counts.in_source, 1))},
          {"with_pose", counts.with_pose},
          {"complete", counts.is_complete()},
          {"dropped", counts.dropped},
          {"dropped_in_a_row", summary.longest_gap},
          {"by_state", by_state},
          {"skipped", counts_json(counts.skipped)},
          {"withdrawn_poses", slam.withdrawn_poses()},
          {"doubted_poses", counts_json(slam.doubted_poses())},
          {"clock_resets", slam.clock_resets()},
          {"without_depth", summary.without_depth},
          {"skipped_depth", counts_json(source.skipped_depth())},
          {"notes", counts_json(source.notes())}};
}

// Milliseconds.
void put_quantiles(const StageSummary& s, Json& json) {
  json["median"] = rounded(s.median_ms, 3);
  json["p95"] = rounded(s.p95_ms, 3);
  json["p99"] = rounded(s.p99_ms, 3);
  json["max"] = rounded(s.max_ms, 3);
}

Json times_json(const StageTimes& times) {
  Json json = Json::object();
  for (const auto& [stage, s] : times.summary()) {
    json[stage] = {{"count", s.count}, {"mean", rounded(s.mean_ms, 3)}};
    put_quantiles(s, json[stage]);
  }
  return json;
}

// Wall time, unlike processor_milliseconds.
Json latency_json(const Slam& slam) {
  const MapLockTimes locks = slam.lock_times();
  Json held = Json::object();
  for (const auto& [purpose, seconds] : locks.longest_held) held[purpose] = rounded(1e3 * seconds, 3);
  Json json{{"longest_wait_for_map", rounded(1e3 * locks.longest_wait, 3)},
            {"waited_for", locks.waited_for},
            {"longest_hold_of_map", held}};
  const auto summaries = slam.latency().summary();
  if (const auto found = summaries.find("latency"); found != summaries.end())
    put_quantiles(found->second, json);
  return json;
}

// Shares are of all points or pixels of the run, ages in frames.
Json dynamic_json(const Slam& slam, const RunResults& summary, const RunDescription& description) {
  Json json{{"mode", mode_of(slam.options().dynamic_objects)},
            {"model", description.segmentation_model},
            {"backends", slam.backends()},
            {"labelling_faults", counts_json(slam.labelling_faults())}};
  if (!summary.removal) return json;
  const RemovalTally& tally = *summary.removal;
  const auto frames = static_cast<double>(std::max<std::size_t>(tally.frames, 1));
  std::size_t removed = 0;
  for (const auto& [kind, count] : tally.removed_points) removed += count;
  const auto points = static_cast<double>(std::max<std::size_t>(tally.kept_points + removed, 1));
  std::vector<int> ages = tally.label_ages;
  std::sort(ages.begin(), ages.end());
  json["removed_area_share"] = rounded(tally.removed_area / frames, 4);
  json["removed_point_share"] = rounded(static_cast<double>(removed) / points, 4);
  json["removed_points"] = counts_json(tally.removed_points);
  json["frames_with_labels"] = ages.size();
  json["label_age_median"] = ages.empty() ? Json(nullptr) : Json(ages[ages.size() / 2]);
  json["label_age_max"] = ages.empty() ? Json(nullptr) : Json(ages.back());
  json["low_quality_frames"] = tally.low_quality;
  json["predicted_frames"] = tally.predicted;
  json["masks_dropped"] = tally.masks_dropped;
  json["lines_dropped"] = tally.lines_dropped;
  return json;
}

// Shares are of all points.
Json dense_json(const DenseMap& dense) {
  auto points = count_by_provenance(dense.surface);
  const auto all = static_cast<double>(std::max<std::size_t>(dense.surface.points.size(), 1));
  const auto share = [&](Provenance provenance) {
    return rounded(static_cast<double>(points[provenance]) / all, 4);
  };
  return {{"points", dense.surface.points.size()},
          {"triangles", dense.surface.triangles.size()},
          {"measured_share", share(Provenance::kMeasured)},
          {"reprojected_share", share(Provenance::kReprojected)},
          {"inpainted_share", share(Provenance::kInpainted)},
          {"voxel_size_metres", dense.voxel_size},
          {"times_coarsened", dense.times_coarsened},
          {"keyframes", dense.keyframes},
          {"dropped", dense.dropped},
          {"fused_anew", dense.moved},
          {"voxel_megabytes", rounded(static_cast<double>(dense.voxel_bytes) / 1048576.0, 1)},
          {"view_megabytes", rounded(static_cast<double>(dense.view_bytes) / 1048576.0, 1)},
          {"faults", counts_json(dense.faults)}};
}

Json loops_json(const Slam& slam) {
  Json json{{"closed", Json::array()},
            {"refused", slam.refused_loops()},
            {"faults", counts_json(slam.loop_faults())}};
  for (const auto& loop : slam.loops()) {
    json["closed"].push_back({{"keyframe", loop.keyframe.value},
                              {"matched_keyframe", loop.matched_keyframe.value},
                              {"moved_metres", rounded(loop.moved, 4)},
                              {"turned_degrees", rounded(loop.turned * 180.0 / M_PI, 3)},
                              {"matches", loop.matches},
                              {"merges_submaps", loop.merges_submaps}});
  }
  return json;
}

Json map_json(const Slam& slam, const RunDescription& description) {
  std::size_t in_other_submaps = 0;
  for (const auto& [submap, frames] : slam.frames_in_other_submaps()) in_other_submaps += frames;
  return {{"from", description.map.empty() ? Json(nullptr) : Json(description.map)},
          {"recognised", description.map.empty() ? Json(nullptr) : Json(slam.found_in_loaded_map())},
          {"localise_only", !slam.options().keyframes.enabled},
          {"submaps", slam.map().submaps().size()},
          {"submaps_dropped", slam.submaps_on_objects().size()},
          {"frames_in_other_submaps", in_other_submaps}};
}

double path_length(const Trajectory& trajectory) {
  double length = 0.0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length +=
        (trajectory[i].T_world_camera.translation() - trajectory[i - 1].T_world_camera.translation()).norm();
  }
  return length;
}
}  // namespace

std::size_t FrameCounts::all_skipped() const {
  return std::accumulate(skipped.begin(), skipped.end(), std::size_t{0},
                         [](std::size_t sum, const auto& entry) { return sum + entry.second; });
}

double FrameCounts::pose_share() const {
  return static_cast<double>(with_pose) / static_cast<double>(std::max<std::size_t>(in_source, 1));
}

std::string FrameCounts::in_words() const {
  char share[16];
  std::snprintf(share, sizeof(share), "%.1f", 100.0 * pose_share());
  std::string words = "tracked " + std::to_string(with_pose) + " of " + std::to_string(in_source) +
                      " frames of the source (" + share + " %)";
  if (processed > with_pose) words += ", " + std::to_string(processed - with_pose) + " not tracked";
  if (dropped > 0) words += ", " + std::to_string(dropped) + " dropped as the tracker was busy";
  if (all_skipped() > 0) {
    words += ", " + std::to_string(all_skipped()) + " skipped (";
    for (const auto& [reason, number] : skipped)
      words += (words.back() == '(' ? "" : "; ") + std::to_string(number) + " x " + reason;
    words += ")";
  }
  const std::size_t seen = processed + dropped + all_skipped();
  if (seen < in_source) words += ", " + std::to_string(in_source - seen) + " not read";
  return words;
}

FrameCounts count_frames(const Slam& slam, const RunResults& summary, const FrameSource& source) {
  FrameCounts counts;
  counts.processed = slam.frames();
  counts.with_pose = slam.trajectory().size();
  counts.dropped = summary.dropped;
  counts.skipped = source.skipped();
  for (const auto& [reason, count] : rejected_by_reason(slam)) counts.skipped[reason] += count;
  counts.in_source = source.size().value_or(counts.processed + counts.dropped + counts.all_skipped());
  return counts;
}

std::string unfinished_report(const RunDescription& description, const Camera& camera) {
  Json json = head_json(description, false);
  json["camera"] = camera_json(camera, description);
  return text_of(json);
}

std::string run_report(const Slam& slam, const RunResults& summary, const FrameSource& source,
                       const RunDescription& description) {
  const double per_second =
      summary.wall_seconds > 0.0 ? static_cast<double>(slam.frames()) / summary.wall_seconds : 0.0;
  Json json = head_json(description, true);
  json["mode"] = slam.mode() == Mode::kDeterministic ? "deterministic" : "real-time";
  json["interrupted"] = summary.interrupted;
  json["error"] = summary.failure ? Json(message_of(summary.failure)) : Json(nullptr);
  json["frames"] = frames_json(slam, summary, source);
  json["gave_way"] = counts_json(slam.gave_way());
  json["warnings"] = counts_json(slam.warnings());
  json["not_saved_during_run"] = counts_json(summary.saving_faults);
  json["noise"] = noise_json(slam.measurement_noise());
  if (const auto gyroscope = slam.gyroscope()) json["gyroscope"] = gyroscope_json(*gyroscope);
  json["dynamic"] = dynamic_json(slam, summary, description);
  if (slam.restores())
    json["restoration"] = {{"dropped", slam.unrestored()},
                           {"faults", counts_json(slam.restoration_faults())}};
  if (summary.dense) json["dense"] = dense_json(*summary.dense);
  if (summary.mavlink) json["mavlink"] = mavlink_json(*summary.mavlink);
  json["loops"] = loops_json(slam);
  json["map"] = map_json(slam, description);
  json["keyframes"] = slam.map().keyframe_count();
  json["landmarks"] = slam.map().landmark_count();
  json["path_length_metres"] = rounded(path_length(slam.trajectory()), 3);
  json["wall_seconds"] = rounded(summary.wall_seconds, 3);
  json["frames_per_second"] = rounded(per_second, 2);
  json["first_pose_seconds"] = rounded(summary.first_pose_seconds, 3);
  json["start_up_seconds"] = rounded(summary.start_up_seconds, 2);
  json["peak_memory_megabytes"] = rounded(static_cast<double>(peak_memory()) / 1048576.0, 1);
  json["processor_milliseconds"] = times_json(slam.times());
  json["latency_milliseconds"] = latency_json(slam);
  json["camera"] = camera_json(slam.camera(), description);
  json["options"] = Json::parse(options_to_json(slam.options()));
  return text_of(json);
}

}  // namespace roslam::recording
