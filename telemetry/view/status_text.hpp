// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "telemetry/view/view_subject.hpp"

namespace roslam::telemetry {

/// How well a run goes, for programs that supervise it.
struct Health {
  std::string status;                ///< ok, degraded, lost or ended
  std::vector<std::string> reasons;  ///< in words; none: ok
};

Health health_of(const ViewStatus& status);

/// The reply to /health.
std::string health_json(const ViewStatus& status);

/// Counts of the server itself.
struct ViewCounts {
  std::size_t viewers = 0;
  std::size_t viewers_refused = 0, viewers_dropped = 0, requests_refused = 0;
  double cpu_seconds = 0.0;
  std::uint64_t map_revision = 0;
  std::size_t loops = 0;
};

/// The reply to /metrics: Prometheus text format 0.0.4.
std::string metrics_text(const ViewStatus& status, const ViewCounts& counts);

/// An event of /events, without the frame of server-sent events. On one line.
std::string event_json(const ViewStatus& status, const ViewCounts& counts);

/// The reply to /log.
std::string log_json(const std::vector<LogEntry>& entries);

/// The reply to /loops.
std::string loops_json(const std::vector<ClosedLoop>& loops);

}  // namespace roslam::telemetry
