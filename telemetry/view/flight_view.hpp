// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "roslam/sensors/frame_source.hpp"
#include "roslam/slam/slam.hpp"
#include "telemetry/view/view_subject.hpp"

namespace roslam::telemetry {

/// What a page shows of a flight in progress. Images, snapshots of the map and surfaces are only made while
/// somebody asks for them.
class FlightView : public ViewSubject {
 public:
  struct Setup {
    std::string run;                   ///< id
    std::string source;                ///< as the user named it
    std::size_t in_source = 0;         ///< frames, if known
    std::function<void()> save, stop;  ///< called on a thread of the server; empty: cannot be done
    std::function<void(bool is_paused)> pause;
  };

  /// slam must outlive the view.
  FlightView(const Slam& slam, Setup setup);

  /// Takes note of a frame. On the tracker's thread: copies a few numbers, and points of the image if
  /// somebody looks at images.
  void add(const Frame& frame, const FrameResult& result);

  void set_phase(RunPhase phase);

  ViewStatus status() const override;
  std::shared_ptr<const MapSnapshot> snapshot() const override { return slam_.snapshot(); }
  std::vector<ClosedLoop> loops() const override;
  SurfaceChanges surface(SubmapId submap, std::uint64_t revision, std::size_t most_points) const override {
    return slam_.surface_changes(submap, revision, most_points);
  }
  std::string image(std::uint64_t& number) override;
  std::vector<LogEntry> log(std::uint32_t since) const override;
  std::string execute(ViewCommand command) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct Picture {
    std::uint64_t number = 0;
    cv::Mat colour, mask;
    std::vector<cv::Point2f> points, removed_points;
  };
  // Counts of a second, for rates.
  struct Second {
    Clock::time_point begun;
    std::size_t processed = 0, dropped = 0;
  };

  void take_picture(const Frame& frame, const FrameResult& result);
  void note(const FrameResult& result);
  void write(double timestamp, bool is_warning, std::string text) const;

  const Slam& slam_;
  Setup setup_;
  mutable std::mutex mutex_;  // guards what follows
  ViewStatus status_;
  Clock::time_point newest_, state_since_;
  std::array<Second, 6> seconds_;  // a ring
  std::size_t second_ = 0;         // the newest of it
  bool has_seen_submap_ = false;
  mutable std::deque<LogEntry> log_;
  mutable std::uint32_t log_number_ = 0;
  mutable std::size_t known_loops_ = 0;
  std::atomic<Clock::rep> looked_at_ = 0;  // when somebody asked for an image
  Clock::time_point pictured_;             // used by the tracker's thread
  std::uint64_t pictures_ = 0;             // likewise
  std::shared_ptr<const Picture> picture_;
  std::shared_ptr<const Picture> encoded_;  // of jpeg_
  std::string jpeg_;
  std::mutex encoding_;  // held while an image is encoded; taken before mutex_
};

}  // namespace roslam::telemetry
