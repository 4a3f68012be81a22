// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/camera_check.hpp"

#include <utility>
#include <vector>

#include "evaluation/camera_check/depth_units.hpp"
#include "evaluation/camera_check/tracked_pair.hpp"
#include "evaluation/camera_check/verdicts.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/upper_median.hpp"

namespace roslam::evaluation {

std::string_view name_of(Verdict verdict) {
  if (verdict == Verdict::kFits) return "fits";
  return verdict == Verdict::kDoesNotFit ? "does not fit" : "cannot tell";
}

bool CameraCheck::fits() const {
  for (const CameraFinding* finding : {&distortion, &depth_scale, &registration, &timing})
    if (finding->verdict == Verdict::kDoesNotFit) return false;
  return true;
}

namespace {
void require_depth(const FrameRunSampler& sampler, const std::string& name) {
  if (sampler.frames_read() == 0) throw InputError(name + ": has no frame that can be read");
  if (sampler.frames_with_depth() == 0)
    throw InputError(name + ": has no depth images; a camera check compares colour with depth");
  throw InputError(name + ": has no " + std::to_string(sampler.length()) +
                   " consecutive frames with depth, which a camera check needs");
}
}  // namespace

CameraCheck check_camera(FrameSource& source, const std::string& name, const CameraCheckOptions& options,
                         const std::function<void(std::size_t, std::size_t)>& progress,
                         const std::stop_token& stop) {
  const Camera camera = source.camera();
  FrameRunSampler sampler(source, options.runs, progress);
  EdgeAlignment alignment({camera.width, camera.height});
  DepthUnits units(camera.depth_units_per_metre, camera.fx);
  std::vector<TrackedPair> pairs;
  std::vector<double> intervals;
  CameraCheck check;
  while (const auto run = sampler.next(stop)) {
    alignment.add(*run);
    units.add(*run);
    for (const auto direction : {TrackDirection::kForward, TrackDirection::kBackward})
      if (auto pair = track_run(*run, check.runs, direction)) pairs.push_back(std::move(*pair));
    for (std::size_t i = 1; i < run->size(); ++i)
      intervals.push_back((*run)[i].timestamp - (*run)[i - 1].timestamp);
    ++check.runs;
  }
  if (stop.stop_requested()) throw InputError(name + ": the check was interrupted");
  if (check.runs == 0) require_depth(sampler, name);
  check.frames_read = sampler.frames_read();
  check.interval = upper_median(intervals);
  check.edges = alignment.fit();
  check.timing = judge_timing(check);
  check.registration = judge_registration(check, camera);
  // A misfit of depth is taken out before the lens is looked at.
  Alignment applied;
  if (check.timing.verdict == Verdict::kDoesNotFit || check.registration.verdict == Verdict::kDoesNotFit)
    applied = check.edges->best;
  check.as_given = fit_lens(camera, LensReading::kAsGiven, pairs, applied, stop);
  check.none = check.inverse = check.as_given;
  if (camera.has_distortion()) {
    check.none = fit_lens(camera, LensReading::kNone, pairs, applied, stop);
    check.inverse = fit_lens(camera, LensReading::kInverse, pairs, applied, stop);
  }
  check.distortion = judge_distortion(check, camera);
  check.near = units.near();
  check.median = units.median();
  check.far = units.far();
  check.baseline = units.sensor().baseline();
  check.step_factor = units.sensor().step_factor();
  check.multiples_of_five = units.multiples_of_five();
  check.scale = scale_by_truth(pairs, check.as_given);
  check.depth_scale = judge_depth_scale(check, camera);
  if (stop.stop_requested()) throw InputError(name + ": the check was interrupted");
  return check;
}

}  // namespace roslam::evaluation
