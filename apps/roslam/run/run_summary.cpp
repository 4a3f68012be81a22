// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/run/run_summary.hpp"

#include <cmath>
#include <cstdio>

#include "apps/roslam/support/output.hpp"
#include "recording/mavlink_json.hpp"

namespace roslam::app {

using namespace recording;

namespace {
void print_map(const Slam& slam, bool has_map) {
  if (has_map && !slam.found_in_loaded_map()) {
    std::printf("note: the camera was not localised in the loaded map; poses are in a frame of their own\n");
  }
  for (const auto& loop : slam.loops()) {
    std::printf("loop: keyframe %u matched keyframe %u and was corrected by %.3f m, %.2f degrees%s\n",
                loop.keyframe.value, loop.matched_keyframe.value, loop.moved, loop.turned * 180.0 / M_PI,
                loop.merges_submaps ? "; two submaps were merged" : "");
  }
  const auto on_objects = slam.submaps_on_objects();
  for (const auto& [submap, frames] : slam.frames_in_other_submaps()) {
    std::printf("note: %zu frames are in a submap that was %s; trajectory.txt lacks them\n", frames,
                on_objects.count(submap) > 0 ? "mapped on movable objects and dropped"
                                             : "not merged with the main one");
  }
  std::printf("map: %zu keyframes, %zu landmarks\n", slam.map().keyframe_count(),
              slam.map().landmark_count());
}

void print_dense(const DenseMap& dense) {
  std::printf("dense map: %zu points, voxels of %g m, %zu keyframes", dense.surface.points.size(),
              dense.voxel_size, dense.keyframes);
  if (dense.dropped > 0) std::printf(", %zu dropped", dense.dropped);
  std::printf("\n");
  if (dense.surface.points.empty())
    std::printf("note: the dense map is empty: %s\n", std::string(why_empty(dense)).c_str());
  if (dense.times_coarsened > 0)
    std::printf("note: voxels are %d times as large as configured, to stay within dense.max_memory\n",
                1 << dense.times_coarsened);
  for (const auto& [fault, count] : dense.faults)
    std::printf("note: keyframe not fused into the dense map: %s (%zu times)\n", fault.c_str(), count);
}

void print_frames(const Slam& slam, const RunResults& summary, const FrameSource& source) {
  const FrameCounts counts = count_frames(slam, summary, source);
  constexpr double kFew = 0.9;
  const bool is_few = counts.pose_share() < kFew && !summary.interrupted;
  std::printf("%s%s%s\n", is_few ? "WARNING: " : "", counts.in_words().c_str(),
              summary.interrupted ? ", interrupted" : "");
  for (const auto& [warning, frames] : slam.warnings())
    std::printf("WARNING: %s%s\n", warning.c_str(),
                frames > 1 ? (" (" + std::to_string(frames) + " frames)").c_str() : "");
  print_counts("note: ", source.notes());
}

}  // namespace

void print_restoration(const Flight& flight) {
  std::printf("restored: %zu keyframes, %zu dropped\n", flight.restored, flight.slam->unrestored());
  for (const auto& [fault, count] : flight.slam->restoration_faults())
    std::printf("note: keyframe not restored: %s (%zu times)\n", fault.c_str(), count);
}

void print_summary(const Flight& flight, const FlightArguments& arguments) {
  const Slam& slam = *flight.slam;
  const RunResults& summary = flight.summary;
  const auto times = slam.times().summary();
  print_frames(slam, summary, *flight.source);
  if (summary.removal && summary.removal->frames > 0) {
    const RemovalTally& tally = *summary.removal;
    std::printf("removed: %.1f %% of the image area on average",
                100.0 * tally.removed_area / static_cast<double>(tally.frames));
    if (tally.predicted > 0)
      std::printf("; %zu frames predicted while the static scene was hidden", tally.predicted);
    std::printf("\n");
  }
  for (const auto& [fault, count] : slam.labelling_faults()) {
    std::printf("note: %s (%zu times)\n", fault.c_str(), count);
  }
  for (const auto& [fault, count] : summary.saving_faults)
    std::printf("note: not saved during the run: %s (%zu times)\n", fault.c_str(), count);
  if (slam.clock_resets() > 0)
    std::printf("note: the clock of the source restarted (%zu times)\n", slam.clock_resets());
  for (const auto& [fault, count] : slam.loop_faults())
    std::printf("note: loop closing was switched off after it failed: %s\n", fault.c_str());
  print_map(slam, !arguments.map.empty());
  if (summary.dense) print_dense(*summary.dense);
  if (const auto found = times.find("tracking"); found != times.end()) {
    std::printf("tracking: median %.1f ms, p95 %.1f ms of processor time per frame\n",
                found->second.median_ms, found->second.p95_ms);
  }
  const auto latencies = slam.latency().summary();
  if (const auto found = latencies.find("latency"); found != latencies.end()) {
    std::printf("latency: median %.1f ms, p95 %.1f ms, p99 %.1f ms from the image to its pose\n",
                found->second.median_ms, found->second.p95_ms, found->second.p99_ms);
  }
  if (summary.mavlink) std::printf("%s\n", recording::in_words(*summary.mavlink).c_str());
  if (!flight.recorded.empty()) std::printf("%s\n", flight.recorded.c_str());
  std::printf("results: %s\n", arguments.out.c_str());
}

}  // namespace roslam::app
