// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_flight.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "roslam/geometry/mount.hpp"
#include "simulation/simulated_corridor.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kStep = 0.01;    // metres of path between two waypoints
constexpr double kCorner = 12.0;  // metres of path over which a corner of 90 degrees is flown
constexpr double kBlockX = 64.0;  // from crossing to crossing along x, and along y
constexpr double kBlockY = 44.0;
constexpr double kCrossing = -6.0;                // x of the crossing behind the start
constexpr double kTurnRate = 20.0 * kPi / 180.0;  // of the hovering drone, radians a second

// From 0 to 1 with no velocity and no acceleration at either end.
double ease(double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); }

Vector2d direction(double heading) { return {std::cos(heading), std::sin(heading)}; }

// How far a corner of 90 degrees, flown over that length, reaches along each of its streets.
double reach_of_corner(double length) {
  constexpr int kPieces = 1200;
  double reach = 0.0;
  for (int i = 0; i < kPieces; ++i) {
    reach += std::cos(kPi / 2 * ease((i + 0.5) / kPieces)) * length / kPieces;
  }
  return reach;
}

// Slow sway: a sum of three sines of random phase, about 1 at most.
double waver(double time, double slowest_hz, std::uint32_t seed) {
  double sum = 0.0;
  double hertz = slowest_hz;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const double phase = 2 * kPi * static_cast<double>(unit(mix(seed, i)));
    sum += std::sin(2 * kPi * hertz * time + phase) * (i == 0 ? 0.55 : i == 1 ? 0.3 : 0.15);
    hertz *= 1.73;
  }
  return sum;
}

}  // namespace

Flight::Flight(const SimulatorOptions& options) : options_(options) {
  if (options.path == FlightPath::kCorridor) {
    options_.altitude = 1.5;
    options_.aside = 0.0;
    options_.pitch_down = 0.1;
  }
  const double quarter = kPi / 2;
  const double reach = reach_of_corner(kCorner);
  switch (options.path) {
    case FlightPath::kStreet:
      track_.push_back({{0, 0}, 0});
      go(50.0, 0);
      break;
    case FlightPath::kLoop: {
      const double start = 3.0;
      track_.push_back({{start, 0}, 0});
      const double along_x = kBlockX - 2 * reach;
      const double along_y = kBlockY - 2 * reach;
      go(kCrossing + kBlockX - reach - start, 0);
      go(kCorner, quarter);
      go(along_y, 0);
      go(kCorner, quarter);
      go(along_x, 0);
      go(kCorner, quarter);
      go(along_y, 0);
      go(kCorner, quarter);
      go(start - (kCrossing + reach) + 7.0, 0);  // 7 m of the first street once more
      break;
    }
    case FlightPath::kTurn:
      track_.push_back({{kCrossing + kBlockX - reach - 22.0, 0}, 0});
      go(22.0, 0);
      go(kCorner, quarter);
      go(20.0, 0);
      break;
    case FlightPath::kHover:
      track_.push_back({{12, 0}, 0});
      break;
    case FlightPath::kCorridor: {
      constexpr double kNarrow = 2.5;  // metres of path over which its corner is flown
      track_.push_back({{0, 0}, 0});
      go(static_cast<double>(CorridorPlan().corner) - reach_of_corner(kNarrow), 0);
      go(kNarrow, quarter);
      go(12.0, 0);
      break;
    }
  }
  duration_ = options.path == FlightPath::kHover
                  ? 2 * 2 * kPi / kTurnRate
                  : kStep * static_cast<double>(track_.size() - 1) / options.speed;
}

// Extends the track from the last waypoint. The heading turns smoothly; the position is its integral.
void Flight::go(double length, double turn) {
  const Waypoint from = track_.back();
  const auto heading_at = [&](double way) { return from.heading + turn * ease(std::min(way / length, 1.0)); };
  const auto steps = static_cast<std::size_t>(std::llround(length / kStep));
  const double step = length / static_cast<double>(steps);
  Vector2d position = from.position;
  for (std::size_t i = 0; i < steps; ++i) {
    const double way = static_cast<double>(i) * step;
    position += step / 6 *
                (direction(heading_at(way)) + 4 * direction(heading_at(way + step / 2)) +
                 direction(heading_at(way + step)));
    track_.push_back({position, heading_at(way + step)});
  }
}

// Beyond its ends the track goes on straight, as the motion before and after an image is asked for as well.
Flight::Waypoint Flight::at(double way) const {
  const double last = static_cast<double>(track_.size() - 1);
  const double step = std::clamp(way / kStep, 0.0, last);
  if (track_.size() > 1 && (way < 0.0 || way > kStep * last)) {
    const Waypoint& end = way < 0.0 ? track_.front() : track_.back();
    const double beyond = way < 0.0 ? way : way - kStep * last;
    return {end.position + beyond * direction(end.heading), end.heading};
  }
  const auto i = std::min(static_cast<std::size_t>(step), track_.size() - 1);
  if (i + 1 >= track_.size()) return track_.back();
  const double t = step - static_cast<double>(i);
  const Waypoint& a = track_[i];
  const Waypoint& b = track_[i + 1];
  return {a.position + t * (b.position - a.position), a.heading + t * (b.heading - a.heading)};
}

SE3 Flight::T_world_camera(double time) const {
  const auto channel = [&](std::uint32_t i, double slowest) {
    return options_.sway * waver(time, slowest, mix(options_.seed, 0xf11U, i));
  };
  // Gusts are faster: half a turn of the sum of sines lasts a second or two.
  const auto gust = [&](std::uint32_t i) {
    constexpr double kSlowest = 0.25;  // Hz
    return options_.gusts * waver(time, kSlowest, mix(options_.seed, 0x9057U, i));
  };
  Waypoint waypoint = at(options_.speed * time);
  double drift = 0.03;
  if (options_.path == FlightPath::kHover) {
    waypoint.heading += kTurnRate * time;
    drift = 0.12;
  }
  const Vector2d along = direction(waypoint.heading);
  const Vector2d left(-along.y(), along.x());
  const Vector2d position = waypoint.position + drift * channel(0, 0.05) * along +
                            ((drift + 0.02) * channel(1, 0.07) + 0.25 * gust(0) + options_.aside) * left;
  const double height = options_.altitude + 0.04 * channel(2, 0.09) + 0.12 * gust(1);
  const double degree = kPi / 180.0;
  const double yaw = waypoint.heading + 1.0 * degree * channel(3, 0.11) + 25.0 * degree * gust(2);
  const double pitch = options_.pitch_down + 0.9 * degree * channel(4, 0.15) + 4.0 * degree * gust(3);
  const double roll = 0.9 * degree * channel(5, 0.13) + 6.0 * degree * gust(4);
  const Eigen::Matrix3d R_body_camera = forward_camera().rotation().toRotationMatrix();
  const Eigen::Matrix3d R_world_body =
      (Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll, Vector3d::UnitX()))
          .toRotationMatrix();
  return {Eigen::Matrix3d(R_world_body * R_body_camera), Vector3d(position.x(), position.y(), height)};
}

SE3 Flight::T_body_camera() const {
  return mounted_camera({0.0, 0.0, 0.0, 0.0, options_.pitch_down * 180.0 / kPi, 0.0});
}

}  // namespace roslam::simulation
