// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/geometry/trajectory.hpp"
#include "telemetry/view/view_subject.hpp"

namespace roslam::telemetry {

/// What a page shows of a run of earlier: all at once, and no changes.
class RecordedView : public ViewSubject {
 public:
  struct Point {
    Eigen::Vector3f position;  ///< world frame, metres
    cv::Vec3b colour;          ///< BGR
  };
  struct Contents {
    std::string run;     ///< id
    std::string source;  ///< as the user named it
    Trajectory path, keyframes;
    std::vector<Point> landmarks, dense;
    std::string image;               ///< JPEG; empty: none
    std::vector<std::string> notes;  ///< what is not there, in words
  };

  explicit RecordedView(const Contents& contents);

  ViewStatus status() const override { return status_; }
  std::shared_ptr<const MapSnapshot> snapshot() const override { return map_; }
  std::vector<ClosedLoop> loops() const override { return {}; }
  SurfaceChanges surface(SubmapId submap, std::uint64_t revision, std::size_t most_points) const override;
  std::string image(std::uint64_t& number) override;
  std::vector<LogEntry> log(std::uint32_t since) const override;
  std::string execute(ViewCommand) override { return "this is a run of earlier"; }

 private:
  void add_surfaces(const std::vector<Point>& points);

  ViewStatus status_;
  std::shared_ptr<const MapSnapshot> map_;
  std::vector<std::shared_ptr<const SurfaceBlock>> blocks_;  // revision: position, from 1
  std::string image_;
  std::vector<LogEntry> log_;
};

}  // namespace roslam::telemetry
