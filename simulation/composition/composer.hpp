// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "simulation/composition/composed_person.hpp"
#include "simulation/composition/composed_walk.hpp"
#include "simulation/composition/composer_options.hpp"
#include "simulation/composition/person_cutout.hpp"

namespace roslam::simulation {

/// A frame with people composed into it, and its ground truth. All images as large as the camera's.
struct ComposedFrame {
  cv::Mat colour;        ///< CV_8UC3, BGR
  cv::Mat depth;         ///< CV_32FC1, metres, 0 = unknown
  cv::Mat instances;     ///< CV_16UC1, number of the actor, from 1; 0 = none
  cv::Mat labels;        ///< CV_8UC1, 11 (person) where an actor is visible, else 255 (unknown)
  double covered = 0.0;  ///< share of the image that shows actors, 0 to 1
};

/// Composes walking people into the frames of a static sequence. Nearer surfaces occlude them, and their
/// depth has the noise and the projector shadow of a structured-light camera. Pixels without an actor or a
/// shadow keep their colour and depth exactly. Deterministic in frame and options.
class Composer {
 public:
  /// One of the people put into the frames.
  struct Actor {
    std::string name;  ///< of the cutout
    ComposedPerson person;
    Walk walk;
  };

  /// poses: ground truth of the whole sequence, at least one; people walk in view of them. people: not empty
  /// unless options.actors is 0; fewer people than actors are repeated.
  /// Throws OptionsError, CalibrationError.
  Composer(const Camera& camera, const std::vector<PersonCutout>& people, const Trajectory& poses,
           const ComposerOptions& options);

  /// frame: with depth and true pose, of the camera's image size.
  ComposedFrame compose(const Frame& frame) const;

  const std::vector<Actor>& actors() const { return actors_; }
  const WalkingGround& ground() const { return ground_; }

 private:
  struct Canvas;
  void draw(std::size_t actor, const Frame& frame, Canvas& canvas) const;
  void cast_shadow(const Canvas& canvas, cv::Mat& depth) const;

  ComposerOptions options_;
  PixelRays rays_;
  WalkingGround ground_;
  std::vector<Actor> actors_;
};

/// Chooses the people of a folder who become actors, each at most once. count: number of people, at least 1.
/// Returns indices below count: one an actor, or fewer where people have to be repeated.
std::vector<std::size_t> chosen_people(std::size_t count, const ComposerOptions& options);

}  // namespace roslam::simulation
