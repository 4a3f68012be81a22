// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/sources/simulated_city.hpp"
#include "roslam/sources/simulated_mesh.hpp"
#include "roslam/sources/simulated_paint.hpp"
#include "roslam/sources/simulated_tracer.hpp"

namespace roslam::simulation {

/// A drawn picture and the truth about each of its pixels (that of its centre).
struct Picture {
  cv::Mat colour;     ///< CV_32FC3, blue, green, red, 0 to 255
  cv::Mat depth;      ///< CV_32FC1, metres along the optical axis, 0 = sky
  cv::Mat labels;     ///< CV_8UC1
  cv::Mat instances;  ///< CV_16UC1
  cv::Mat parts;      ///< CV_32SC1, tells one part of an object from the next; where it changes is an edge
  cv::Mat touched;    ///< CV_8UC1, not 0 where something movable is seen or casts a shadow
};

/// Draws the city, and the movable things in it, by following rays of light back from the camera.
class Renderer {
 public:
  Renderer(const CityPlan& plan, const Camera& camera, std::uint32_t seed);

  /// Takes these for the movable things from now on.
  void set_movables(Mesh movables);

  Picture draw(const SE3& T_world_camera) const;

  /// The same picture without the movable things; only what they touched is drawn anew.
  Picture without_movables(const SE3& T_world_camera, const Picture& picture) const;

 private:
  /// Points of the picture, in pixels.
  struct Points {
    RayPacket::Lanes<float> x, y;
    int count = 0;
  };
  struct Sample {
    Vector3f colour;
    float depth;
    std::int32_t part;
    std::uint16_t instance;
    std::uint8_t label;
    bool touched;
  };
  using Samples = std::array<Sample, kPacket>;
  struct Eye;
  struct Hits;

  Eye eye_at(const SE3& T_world_camera) const;
  void sample(const Eye& eye, const Points& points, int group, bool movables, Samples& samples) const;
  void trace(const Eye& eye, const Points& points, bool movables, Hits& hits) const;
  void light(const Eye& eye, bool movables, Hits& hits) const;
  Vector3f shade(const Eye& eye, const Hits& hits, std::size_t i) const;
  void draw_centres(const Eye& eye, const std::vector<cv::Point>& pixels, bool movables,
                    Picture& picture) const;
  void smooth_edges(const Eye& eye, const std::vector<cv::Point>& pixels, bool movables,
                    Picture& picture) const;

  Camera camera_;
  CityPlan plan_;
  Mesh city_;
  Mesh movables_;
  Painter painter_;
  Tracer city_tracer_;
  Tracer movables_tracer_;
};

}  // namespace roslam::simulation
