// SPDX-License-Identifier: BSD-3-Clause
// In place of dense_worker.cpp in a library without the component dense.
#include "roslam/common/error.hpp"
#include "roslam/workers/dense_worker.hpp"

namespace roslam {

struct DenseWorker::Impl {};

DenseWorker::DenseWorker(const Camera&, const Options&, Mode, PoseLookup, LoadControl*) {
  throw OptionsError(
      "dense.enabled: this library was built without the dense map (ROSLAM_DENSE); use --no-dense");
}

DenseWorker::~DenseWorker() = default;
void DenseWorker::submit(KeyframeId, DenseInput) {}
void DenseWorker::restored(KeyframeId, const RestoredImage*) {}
void DenseWorker::follow_soon() {}
void DenseWorker::drain() {}
void DenseWorker::cancel() {}
std::shared_ptr<const OccupancyGrid> DenseWorker::occupancy() { return nullptr; }
SurfaceChanges DenseWorker::surface_changes(SubmapId, std::uint64_t, std::size_t) { return {}; }
std::shared_ptr<const DenseMap> DenseWorker::checkpoint(SubmapId) { return nullptr; }
std::optional<DenseMap> DenseWorker::result(SubmapId, const std::stop_token&) const { return std::nullopt; }
StageTimes DenseWorker::times() const { return {}; }

}  // namespace roslam
