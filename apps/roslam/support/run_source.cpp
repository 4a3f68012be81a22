// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/run_source.hpp"

#include <filesystem>

#include "apps/roslam/support/live_camera.hpp"
#include "apps/roslam/support/sources.hpp"
#include "roslam/common/error.hpp"
#include "roslam/datasets/dataset.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/ros/recording_source.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam::app {

using namespace simulation;

std::unique_ptr<FrameSource> open_source_of(const recording::RunSource& run) {
  if (is_live_camera(run.name))
    throw InputError("the run is of the camera " + run.name +
                     ", which gives other images now; record it with roslam run --record");
  const bool is_simulated = run.name.starts_with("simulated:");
  std::error_code error;
  if (is_simulated ? run.flight.empty() : !std::filesystem::exists(run.name, error)) {
    throw InputError(
        "the run is of " + run.name +
        (is_simulated ? ", but an earlier version did not record the options of the flight; repeat the run"
                      : ", which is not there; repeat this in the folder that roslam run was run in"));
  }
  const SourceArguments arguments = flight_from_words(run.name, run.flight);
  if (is_simulated) return std::make_unique<SimulatedSource>(*simulated_flight(arguments));
  if (is_recorded(run.name)) return std::make_unique<RecordingSource>(run.name, arguments.topics, run.camera);
  // The camera of a run on stereo pairs is that of the rectified ones.
  if (is_other_dataset(run.name))
    return open_dataset(run.name, run.camera.is_stereo() ? std::nullopt : std::optional(run.camera));
  return std::make_unique<TumSource>(run.name, run.camera);
}

}  // namespace roslam::app
