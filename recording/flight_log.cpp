// SPDX-License-Identifier: BSD-3-Clause
#include "recording/flight_log.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "recording/odometry_file.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/thread_priority.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/map_io/map_file.hpp"

namespace roslam::recording {

namespace {
using Clock = std::chrono::steady_clock;
constexpr const char* kOdometry = "odometry.csv";
constexpr auto kFlush = std::chrono::milliseconds(500);
constexpr auto kPathInterval = std::chrono::seconds(5);  // between two versions of the whole path
constexpr std::size_t kMostPoses = 100000;               // that may wait for the disk
constexpr std::size_t kMostWaiting = 8U << 20U;          // bytes of lines that may wait for the disk

// On a thread of its own, as a priority once lowered cannot be raised again.
template <typename Step>
void at_low_priority(const Step& step) {
  std::exception_ptr failure;
  std::jthread([&] {
    lower_thread_priority(ThreadPriority::kLowest);
    try {
      step();
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
}
}  // namespace

template <typename Step>
void FlightLog::attempt(const Step& step) {
  try {
    step();
  } catch (const std::exception& error) {
    const std::scoped_lock lock(mutex_);
    ++faults_[error.what()];
  }
}

FlightLog::FlightLog(const Settings& settings, const Slam& slam) : settings_(settings), slam_(slam) {
  attempt([&] { odometry_.emplace(settings.folder / kOdometry, odometry_header()); });
  attempt([&] { trajectory_.emplace(settings.folder / "trajectory.txt", trajectory_header()); });
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

FlightLog::~FlightLog() = default;

void FlightLog::add(const FrameResult& result) {
  const std::scoped_lock lock(mutex_);
  if (odometry_lines_.size() < kMostWaiting) {
    odometry_lines_ += odometry_line(result);
  } else {
    ++faults_["lines of odometry.csv were lost, as the disk could not take them"];
  }
  if (result.withdrawn > 0) is_path_old_ = true;
  if (!result.T_world_camera) return;
  if (!submap_) submap_ = result.submap;
  if (result.submap != *submap_) {
    is_path_old_ = true;
  } else if (poses_.size() < kMostPoses) {
    poses_.push_back({result.timestamp, *result.T_world_camera});
  }
}

void FlightLog::work(const std::stop_token& stop) {
  const auto begun = Clock::now();
  const auto checkpoint =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(settings_.checkpoint));
  auto map_due = settings_.checkpoint > 0.0 ? begun + checkpoint : Clock::time_point::max();
  auto path_due = begun + kPathInterval;
  while (!stop.stop_requested()) {
    bool is_path_old = false;
    {
      std::unique_lock lock(mutex_);
      tick_.wait_for(lock, stop, kFlush, [this] { return wants_flush_; });
      wants_flush_ = false;
      if (std::exchange(wants_save_, false)) map_due = Clock::now();
      is_path_old = is_path_old_;
    }
    append();
    const auto now = Clock::now();
    if (stop.stop_requested()) break;
    if (now >= map_due || (is_path_old && now >= path_due)) {
      attempt([&] { save_path(); });
      path_due = Clock::now() + kPathInterval;
    }
    if (now >= map_due) {
      if (settings_.saves_map) attempt([&] { save_map_file(); });
      if (settings_.saves_dense) attempt([&] { save_dense_map(); });
      map_due = settings_.checkpoint > 0.0 ? Clock::now() + checkpoint : Clock::time_point::max();
    }
  }
}

// Lines that the disk does not take wait for the next time.
void FlightLog::append() {
  std::string odometry;
  Trajectory poses;
  {
    const std::scoped_lock lock(mutex_);
    odometry.swap(odometry_lines_);
    poses.swap(poses_);
  }
  std::string path;
  for (const StampedPose& pose : poses) path += trajectory_line(pose);
  const bool has_odometry = odometry.empty() || (odometry_ && odometry_->append(odometry));
  const bool has_path = path.empty() || !trajectory_ || trajectory_->append(path);
  const bool is_safe = (!odometry_ || odometry_->sync()) && (!trajectory_ || trajectory_->sync());
  if (has_odometry && has_path && is_safe) return;
  const std::scoped_lock lock(mutex_);
  if (!is_safe) ++faults_["odometry.csv and trajectory.txt could not be flushed to the disk"];
  if (!has_odometry) odometry_lines_.insert(0, odometry);
  if (!has_path) poses_.insert(poses_.begin(), poses.begin(), poses.end());
}

// All poses as the map has them now. What was added until then is among them; what is added later is
// appended.
void FlightLog::save_path() {
  {
    const std::scoped_lock lock(mutex_);
    is_path_old_ = false;
  }
  const SubmapId submap = slam_.main_submap();
  const Trajectory path = slam_.trajectory();
  std::string content = trajectory_header();
  for (const StampedPose& pose : path) content += trajectory_line(pose);
  try {
    if (trajectory_) trajectory_->replace(content);
  } catch (...) {
    const std::scoped_lock lock(mutex_);
    is_path_old_ = true;
    throw;
  }
  const std::scoped_lock lock(mutex_);
  submap_ = submap;
  if (!path.empty())
    std::erase_if(poses_, [&](const StampedPose& pose) { return pose.timestamp <= path.back().timestamp; });
}

// The map is copied at normal priority, as a thread that is preempted while it holds the map would keep the
// tracker waiting.
void FlightLog::save_map_file() {
  const SavedMap saved = slam_.saved_map();
  at_low_priority([&] { save_map(settings_.folder / "map.roslam", saved); });
}

void FlightLog::save_dense_map() {
  const auto map = slam_.dense_checkpoint();
  if (map && !map->surface.points.empty())
    at_low_priority([&] { write_surface_ply(settings_.folder / "dense.ply", map->surface, true); });
}

void FlightLog::flush() {
  const std::scoped_lock lock(mutex_);
  wants_flush_ = true;
  tick_.notify_all();
}

void FlightLog::save() {
  const std::scoped_lock lock(mutex_);
  wants_flush_ = wants_save_ = true;
  tick_.notify_all();
}

void FlightLog::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void FlightLog::finish() {
  append();
  const std::scoped_lock lock(mutex_);
  if (odometry_lines_.empty()) return;
  throw OutputError((settings_.folder / kOdometry).string() +
                    ": cannot be written in full; check the free space on the disk");
}

std::map<std::string, std::size_t> FlightLog::faults() const {
  const std::scoped_lock lock(mutex_);
  return faults_;
}

}  // namespace roslam::recording
