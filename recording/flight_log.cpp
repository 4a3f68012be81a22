// SPDX-License-Identifier: BSD-3-Clause
#include "recording/flight_log.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <exception>
#include <initializer_list>
#include <string_view>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/thread_priority.hpp"
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

void append(std::string& line, double value, std::chars_format format, int precision) {
  std::array<char, 400> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, format, precision);
  line += ',';
  line.append(digits.data(), end.ptr);
}

void append(std::string& line, const SE3& pose) {
  const auto& p = pose.translation();
  Eigen::Quaterniond q = pose.rotation();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  for (const double value : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()})
    append(line, value, std::chars_format::fixed, 9);
}

void append(std::string& line, const Eigen::Vector3d& vector) {
  for (int k = 0; k < 3; ++k) append(line, vector(k), std::chars_format::fixed, 6);
}

void append_upper_triangle(std::string& line, const Matrix6d& matrix) {
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      append(line, matrix(row, column), std::chars_format::general, 6);
  }
}
}  // namespace

std::string odometry_header() {
  std::string header = "#timestamp,state,reset,quality,px,py,pz,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz";
  constexpr std::array<std::string_view, 6> kPose{"px", "py", "pz", "rx", "ry", "rz"};
  constexpr std::array<std::string_view, 6> kVelocity{"vx", "vy", "vz", "wx", "wy", "wz"};
  for (const auto& names : {kPose, kVelocity}) {
    for (std::size_t row = 0; row < names.size(); ++row) {
      for (std::size_t column = row; column < names.size(); ++column)
        header.append(",cov_").append(names[row]).append("_").append(names[column]);
    }
  }
  return header + ",map_px,map_py,map_pz,map_qx,map_qy,map_qz,map_qw,reason\n";
}

std::string odometry_line(const FrameResult& result) {
  std::string line = time_text(result.timestamp);
  line.append(",").append(name_of(result.state));
  constexpr std::size_t kNumbers = 15 + 2 * 21 + 7;  // after the state; none for a frame without a pose
  if (!result.odometry) {
    line.append(kNumbers, ',').append(",").append(describe(result.no_pose)).append("\n");
    return line;
  }
  const Odometry& odometry = *result.odometry;
  line.append(",").append(std::to_string(odometry.resets));
  append(line, odometry.quality, std::chars_format::fixed, 3);
  append(line, odometry.T_odom_body);
  append(line, odometry.linear_velocity);
  append(line, odometry.angular_velocity);
  append_upper_triangle(line, odometry.covariance);
  append_upper_triangle(line, odometry.velocity_covariance);
  append(line, odometry.T_map_odom);
  line += ",\n";
  return line;
}

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
      tick_.wait_for(lock, stop, kFlush, [] { return false; });
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
      map_due = Clock::now() + checkpoint;
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
  if (has_odometry && has_path) return;
  const std::scoped_lock lock(mutex_);
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
// tracker waiting, and written at the lowest.
void FlightLog::save_map_file() {
  const SavedMap saved = slam_.saved_map();
  std::exception_ptr failure;
  std::jthread([&] {
    lower_thread_priority(ThreadPriority::kLowest);
    try {
      save_map(settings_.folder / "map.roslam", saved);
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
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
