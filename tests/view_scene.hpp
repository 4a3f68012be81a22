// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "telemetry/view/view_server.hpp"

namespace roslam::telemetry {

/// A run of which tests say how it is.
class StagedRun : public ViewSubject {
 public:
  StagedRun() {
    status_.run = "first";
    status_.source = "simulated:street";
    status_.phase = RunPhase::kFlying;
    status_.state = TrackingState::kTracking;
    status_.quality = 0.9;
    status_.can_save = status_.can_stop = true;
  }

  ViewStatus status() const override {
    const std::scoped_lock lock(mutex_);
    return status_;
  }
  std::shared_ptr<const MapSnapshot> snapshot() const override {
    ++snapshots;
    const std::scoped_lock lock(mutex_);
    return map_;
  }
  std::vector<ClosedLoop> loops() const override { return {}; }
  SurfaceChanges surface(SubmapId, std::uint64_t, std::size_t) const override { return {}; }
  std::string image(std::uint64_t& number) override {
    ++images;
    number = 1;
    return image_;
  }
  std::vector<LogEntry> log(std::uint32_t) const override { return log_; }
  std::string execute(ViewCommand command) override {
    const std::scoped_lock lock(mutex_);
    commands_.push_back(command);
    return {};
  }

  mutable std::mutex mutex_;
  ViewStatus status_;
  std::shared_ptr<const MapSnapshot> map_;
  std::vector<LogEntry> log_;
  std::vector<ViewCommand> commands_;
  std::string image_;
  mutable std::atomic<int> snapshots = 0, images = 0;
};

/// Options of a server at a free port of this computer.
inline ViewServer::Options at_free_port() {
  ViewServer::Options options;
  options.endpoint.port = 0;
  return options;
}

/// A number in bytes, little endian.
template <typename T>
T number_at(const std::string& bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

}  // namespace roslam::telemetry
