// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/sources/composed_person.hpp"
#include "roslam/sources/composed_walk.hpp"
#include "roslam/sources/composer_options.hpp"
#include "roslam/sources/frame_source.hpp"
#include "roslam/sources/person_cutout.hpp"

namespace roslam {

/// A frame with people in it, and the truth about them. All images as large as the camera's.
struct ComposedFrame {
  cv::Mat colour;        ///< CV_8UC3, BGR
  cv::Mat depth;         ///< CV_32FC1, metres, 0 = unknown
  cv::Mat instances;     ///< CV_16UC1, number of the actor, from 1; 0 = none
  cv::Mat labels;        ///< CV_8UC1, 11 (person) where an actor is seen, else 255 (unknown)
  double covered = 0.0;  ///< share of the picture that shows actors, 0 to 1
};

/// Puts people who walk about into the frames of a static sequence. They are hidden by what stands nearer,
/// and their depth has the noise and the shadow of a depth camera. Where no actor is seen and no shadow
/// falls, colour and depth stay exactly as they were. The same frames and options give the same pictures.
class Composer {
 public:
  /// One of the people put into the frames.
  struct Actor {
    std::string name;  ///< of the cutout
    ComposedPerson person;
    Walk walk;
  };

  /// poses: the true ones of the whole sequence, at least one; what lies in view of them is where people
  /// walk. people: not empty unless options.actors is 0; where they are fewer than actors, they come again.
  /// Throws OptionsError, CalibrationError.
  Composer(const Camera& camera, const std::vector<PersonCutout>& people, const Trajectory& poses,
           const ComposerOptions& options);

  /// frame: with depth and true pose, as large as the camera says.
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

/// Which of the people in a folder become actors: without repeats as long as they suffice. count: of the
/// people, at least 1. The result holds indices below count, one an actor or fewer where people come again.
std::vector<std::size_t> chosen_people(std::size_t count, const ComposerOptions& options);

}  // namespace roslam
