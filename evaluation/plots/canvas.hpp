// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace roslam::evaluation {

using Colour = cv::Scalar;  ///< blue, green, red; 0 to 255

/// Where the given point of a text is put.
enum class Anchor { kLeft, kCentre, kRight };

struct LineStyle {
  Colour colour{0, 0, 0};
  double width = 2.0;  ///< pixels of the finished image
  bool dashed = false;
};

/// A white image drawn at twice its size and then reduced: smoother lines and letters than with OpenCV's own
/// anti-aliasing. All coordinates and sizes are in pixels of the finished image.
class Canvas {
 public:
  Canvas(int width, int height);

  void line(const std::vector<cv::Point2d>& points, const LineStyle& style);
  void rectangle(const cv::Rect2d& area, const Colour& fill);
  void disc(const cv::Point2d& centre, double radius, const Colour& fill);
  /// One line of text, centred vertically on the point. ASCII only: OpenCV's fonts have no other characters.
  void text(const std::string& words, const cv::Point2d& at, double size, Anchor anchor, bool bold = false);
  /// The same, read from bottom to top and centred on the point.
  void text_upwards(const std::string& words, const cv::Point2d& at, double size);
  /// Width of a text of this size.
  static double text_width(const std::string& words, double size, bool bold = false);

  /// Nothing is drawn outside this area until it is set again; the whole image at first.
  void clip_to(const cv::Rect2d& area);
  void unclip();

  cv::Mat image() const;

 private:
  cv::Mat drawing_;
  cv::Rect clip_;
};

}  // namespace roslam::evaluation
