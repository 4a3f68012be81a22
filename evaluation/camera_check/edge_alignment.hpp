// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "evaluation/camera_check/contrast.hpp"
#include "evaluation/camera_check/frame_run.hpp"

namespace roslam::evaluation {

/// Where depth images belong in the colour images: a pixel p of the depth image of frame i is the pixel
/// centre + zoom (p - centre) + shift of the colour image of frame i - lag.
struct Alignment {
  int lag = 0;     ///< frames that depth comes late by
  double x = 0.0;  ///< shift, pixels
  double y = 0.0;
  double zoom = 1.0;
};

/// How depth images fit colour images, by their edges. The score is the mean strength of image gradients at
/// steps in depth, in standard deviations of the image: 0 if unrelated.
struct EdgeFit {
  std::size_t runs = 0;
  double score = 0.0;  ///< of the best alignment
  double score_as_given = 0.0;
  Alignment best = {};            ///< of all
  Alignment best_in_time = {};    ///< of those without lag
  Contrast over_given = {};       ///< score of the best above that of the images as given
  Contrast over_in_time = {};     ///< above that of the best without lag
  Contrast over_registered = {};  ///< above that of the best without shift and zoom
  Contrast lag = {};              ///< between frames, frames, with its standard deviation
  Contrast x = {}, y = {};        ///< shift with its standard deviation, pixels
  Contrast zoom = {};
  /// Least significant of the advantages of the best over images that are two frames earlier or later, over
  /// those shifted by 8 pixels, in standard errors: how surely this recording tells lag and registration.
  double tells_lag = 0.0;
  double tells_registration = 0.0;
};

/// Aligns steps in depth with image gradients. Steps are found along rows and columns, and are compared with
/// the gradient along them. Not thread safe.
class EdgeAlignment {
 public:
  static constexpr int kMostLag = 3;  ///< frames

  /// size: of the images.
  explicit EdgeAlignment(const cv::Size& size);

  /// Adds a run of at least 2 kMostLag + 1 frames.
  void add(const FrameRun& run);

  /// Nothing if there are too few depth edges.
  std::optional<EdgeFit> fit() const;

 private:
  struct Edge {
    float x, y;  // from the image centre, working pixels
    bool is_along_row;
  };
  struct Gradients {
    std::array<cv::Mat, 2> fine, coarse;  // CV_8SC1, along columns and rows
  };
  struct Anchor {  // a depth image
    std::size_t run;
    std::size_t image;  // of the same frame
    std::vector<Edge> edges;
  };
  enum class Detail { kFine, kCoarse };
  struct Scored {
    Alignment at;
    double score;
  };

  struct Found {
    Scored best, in_time, registered;  // of all, without lag, without shift and zoom
  };

  static Gradients gradients(const cv::Mat& small);
  std::vector<Edge> edges(const cv::Mat& small) const;
  double score(const Anchor& anchor, const Alignment& at, Detail detail) const;
  double score(const Alignment& at, Detail detail) const;
  std::vector<double> score_by_run(const Alignment& at) const;
  Scored climb(const Alignment& from, bool moves_lag, bool moves_place) const;
  std::vector<Alignment> starts() const;
  Contrast above(const std::vector<double>& best, const Alignment& other) const;
  static Alignment moved(Alignment at, int lag, double x, double y, double zoom);
  Found search() const;
  void refine(EdgeFit& fit) const;
  template <typename Move>
  Contrast vertex(const Move& moved) const;

  cv::Size small_;
  double scale_;  // pixels of a working pixel
  std::size_t runs_ = 0;
  std::vector<Gradients> images_;
  std::vector<Anchor> anchors_;
};

}  // namespace roslam::evaluation
