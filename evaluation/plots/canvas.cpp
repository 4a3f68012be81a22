// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/plots/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace roslam::evaluation {

namespace {
constexpr int kOversampling = 2;
constexpr int kFractionBits = 4;  // OpenCV takes coordinates as integers with this many binary places
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kCapitalHeight = 21.0;  // of the font at scale 1, pixels
constexpr double kDash = 9.0;            // pixels
constexpr double kDashGap = 6.0;

Colour ink() { return {40, 40, 40}; }

cv::Point fixed_point(const cv::Point2d& point, const cv::Point& origin) {
  constexpr double kUnit = 1 << kFractionBits;
  const auto coordinate = [](double value, int offset) {
    // Far outside the image the exact position does not matter, but integer overflow would.
    return static_cast<int>(std::lround(std::clamp(value * kOversampling - offset, -1e6, 1e6) * kUnit));
  };
  return {coordinate(point.x, origin.x), coordinate(point.y, origin.y)};
}

// Size is the height of a capital letter; bold is a thicker pen.
double font_scale(double size) { return size * kOversampling / kCapitalHeight; }
int pen(double size, bool bold) {
  return std::max(1, static_cast<int>(std::lround(size * kOversampling * (bold ? 0.17 : 0.105))));
}

// Splits a polyline into dashes of equal length along its way, bends included.
std::vector<std::vector<cv::Point2d>> dashes(const std::vector<cv::Point2d>& points) {
  std::vector<std::vector<cv::Point2d>> pieces;
  double left = kDash;
  bool drawing = true;
  pieces.push_back({points.front()});
  for (std::size_t i = 1; i < points.size(); ++i) {
    cv::Point2d at = points[i - 1];
    double length = cv::norm(points[i] - at);
    while (length > left) {
      at += (points[i] - at) * (left / length);
      length -= left;
      if (drawing) pieces.back().push_back(at);
      drawing = !drawing;
      if (drawing) pieces.push_back({at});
      left = drawing ? kDash : kDashGap;
    }
    left -= length;
    if (drawing) pieces.back().push_back(points[i]);
  }
  return pieces;
}
}  // namespace

Canvas::Canvas(int width, int height)
    : drawing_(height * kOversampling, width * kOversampling, CV_8UC3, cv::Scalar::all(255)),
      clip_(0, 0, drawing_.cols, drawing_.rows) {}

void Canvas::line(const std::vector<cv::Point2d>& points, const LineStyle& style) {
  if (points.size() < 2) return;
  const int width = std::max(1, static_cast<int>(std::lround(style.width * kOversampling)));
  cv::Mat view = drawing_(clip_);
  for (const auto& piece : style.dashed ? dashes(points) : std::vector<std::vector<cv::Point2d>>{points}) {
    std::vector<cv::Point> fixed;
    fixed.reserve(piece.size());
    for (const auto& point : piece) fixed.push_back(fixed_point(point, clip_.tl()));
    cv::polylines(view, fixed, false, style.colour, width, cv::LINE_AA, kFractionBits);
  }
}

void Canvas::rectangle(const cv::Rect2d& area, const Colour& fill) {
  cv::Mat view = drawing_(clip_);
  const cv::Point2d far_corner(area.x + area.width, area.y + area.height);
  const auto whole = [&](const cv::Point2d& p) {
    return cv::Point(cvRound(p.x * kOversampling), cvRound(p.y * kOversampling)) - clip_.tl();
  };
  cv::rectangle(view, whole(area.tl()), whole(far_corner) - cv::Point(1, 1), fill, cv::FILLED);
}

void Canvas::disc(const cv::Point2d& centre, double radius, const Colour& fill) {
  cv::Mat view = drawing_(clip_);
  const int fixed_radius = cvRound(radius * kOversampling * (1 << kFractionBits));
  cv::circle(view, fixed_point(centre, clip_.tl()), fixed_radius, fill, cv::FILLED, cv::LINE_AA,
             kFractionBits);
}

double Canvas::text_width(const std::string& words, double size, bool bold) {
  int baseline = 0;
  return static_cast<double>(
             cv::getTextSize(words, kFont, font_scale(size), pen(size, bold), &baseline).width) /
         kOversampling;
}

void Canvas::text(const std::string& words, const cv::Point2d& at, double size, Anchor anchor, bool bold) {
  const double width = text_width(words, size, bold);
  const double shift = anchor == Anchor::kLeft ? 0.0 : anchor == Anchor::kCentre ? 0.5 * width : width;
  const cv::Point origin(cvRound((at.x - shift) * kOversampling),
                         cvRound((at.y + 0.5 * size) * kOversampling));
  cv::Mat view = drawing_(clip_);
  cv::putText(view, words, origin - clip_.tl(), kFont, font_scale(size), ink(), pen(size, bold), cv::LINE_AA);
}

void Canvas::text_upwards(const std::string& words, const cv::Point2d& at, double size) {
  // Drawn horizontally on a strip, rotated and combined by minimum, so the strip's white covers nothing.
  Canvas strip(static_cast<int>(std::ceil(text_width(words, size))) + 4,
               static_cast<int>(std::ceil(2.0 * size)));
  const cv::Point2d middle(0.5 * strip.drawing_.cols / kOversampling,
                           0.5 * strip.drawing_.rows / kOversampling);
  strip.text(words, middle, size, Anchor::kCentre);
  cv::Mat turned;
  cv::rotate(strip.drawing_, turned, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect place(cvRound(at.x * kOversampling) - turned.cols / 2,
                       cvRound(at.y * kOversampling) - turned.rows / 2, turned.cols, turned.rows);
  const cv::Rect visible = place & clip_;
  if (visible.empty()) return;
  cv::Mat view = drawing_(visible);
  cv::min(view, turned(visible - place.tl()), view);
}

void Canvas::clip_to(const cv::Rect2d& area) {
  const cv::Rect scaled(cvRound(area.x * kOversampling), cvRound(area.y * kOversampling),
                        cvRound(area.width * kOversampling), cvRound(area.height * kOversampling));
  clip_ = scaled & cv::Rect(0, 0, drawing_.cols, drawing_.rows);
}

void Canvas::unclip() { clip_ = cv::Rect(0, 0, drawing_.cols, drawing_.rows); }

cv::Mat Canvas::image() const {
  cv::Mat reduced;
  cv::resize(drawing_, reduced, cv::Size(drawing_.cols / kOversampling, drawing_.rows / kOversampling), 0, 0,
             cv::INTER_AREA);
  return reduced;
}

}  // namespace roslam::evaluation
