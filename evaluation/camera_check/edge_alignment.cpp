// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/edge_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

namespace roslam::evaluation {

namespace {
constexpr int kWidth = 320;               // working pixels
constexpr float kUnits = 40.0F;           // of a gradient map, a standard deviation
constexpr std::size_t kFewestEdges = 60;  // of a depth image
constexpr std::size_t kMostEdges = 500;
constexpr int kAnchorStep = 3;  // frames

// Standardised rank of the gradients: mean 0, standard deviation 1 of the image, times kUnits.
cv::Mat ranked(const cv::Mat& gradient, double blur) {
  constexpr int kBins = 2048;
  constexpr float kLargest = 1021.0F;  // of a Sobel filter on 8 bits
  std::vector<int> lower(kBins + 1, 0);
  const auto bin = [](float value) {
    return static_cast<std::size_t>(std::min(std::abs(value) / kLargest * kBins, kBins - 1.0F));
  };
  for (auto it = gradient.begin<float>(); it != gradient.end<float>(); ++it) ++lower[bin(*it) + 1];
  for (std::size_t i = 1; i < lower.size(); ++i) lower[i] += lower[i - 1];
  cv::Mat rank(gradient.size(), CV_32FC1);
  for (int y = 0; y < rank.rows; ++y) {
    const auto* in = gradient.ptr<float>(y);
    auto* out = rank.ptr<float>(y);
    for (int x = 0; x < rank.cols; ++x)
      out[x] = 0.5F * static_cast<float>(lower[bin(in[x])] + lower[bin(in[x]) + 1]);
  }
  cv::GaussianBlur(rank, rank, {}, blur);
  cv::Scalar mean, deviation;
  cv::meanStdDev(rank, mean, deviation);
  cv::Mat result;
  const double factor = kUnits / std::max(deviation[0], 1e-6);
  rank.convertTo(result, CV_8SC1, factor, -mean[0] * factor);
  return result;
}

bool is_known(float depth) { return std::isfinite(depth) && depth > 0.0F; }
}  // namespace

EdgeAlignment::EdgeAlignment(const cv::Size& size)
    : small_(kWidth, std::max(1, size.height * kWidth / std::max(size.width, 1))),
      scale_(static_cast<double>(size.width) / kWidth) {}

EdgeAlignment::Gradients EdgeAlignment::gradients(const cv::Mat& small) {
  constexpr double kFineBlur = 1.0, kCoarseBlur = 2.5;  // working pixels
  Gradients result;
  for (const int along_row : {0, 1}) {
    cv::Mat gradient;
    cv::Sobel(small, gradient, CV_32F, along_row, 1 - along_row);
    const auto i = static_cast<std::size_t>(along_row);
    result.fine.at(i) = ranked(gradient, kFineBlur);
    result.coarse.at(i) = ranked(gradient, kCoarseBlur);
  }
  return result;
}

// Pixels on the near side of a step in depth; a few unknown pixels between are a shadow.
std::vector<EdgeAlignment::Edge> EdgeAlignment::edges(const cv::Mat& small) const {
  constexpr int kLargestGap = 8;                       // working pixels from one known to the next
  constexpr float kStep = 1.15F;                       // ratio of depths
  const double aside = 0.5 * (scale_ - 1.0) / scale_;  // a pixel taken of several is the first of them
  std::vector<Edge> found;
  const auto scan = [&](int lines, int length, bool is_along_row) {
    for (int line = 0; line < lines; ++line) {
      int last = -kLargestGap - 1;
      const auto depth_at = [&](int i) {
        return is_along_row ? small.at<float>(line, i) : small.at<float>(i, line);
      };
      const auto add = [&](int i, double half) {
        const double along = i + half, x = is_along_row ? along : line, y = is_along_row ? line : along;
        found.push_back({static_cast<float>(x - 0.5 * (small.cols - 1) - aside),
                         static_cast<float>(y - 0.5 * (small.rows - 1) - aside), is_along_row});
      };
      for (int i = 0; i < length; ++i) {
        const float depth = depth_at(i);
        if (!is_known(depth)) continue;
        if (i - last <= kLargestGap) {
          const float before = depth_at(last);
          if (depth > kStep * before) add(last, 0.5);
          if (before > kStep * depth) add(i, -0.5);
        }
        last = i;
      }
    }
  };
  scan(small.rows, small.cols, true);
  scan(small.cols, small.rows, false);
  return found;
}

void EdgeAlignment::add(const FrameRun& run) {
  const std::size_t first = images_.size();
  for (const CheckFrame& frame : run) {
    cv::Mat small;
    cv::resize(frame.grey, small, small_, 0, 0, cv::INTER_AREA);
    images_.push_back(gradients(small));
  }
  std::mt19937 random(static_cast<std::mt19937::result_type>(runs_));
  for (std::size_t i = kMostLag; i + kMostLag < run.size(); i += kAnchorStep) {
    cv::Mat small;
    cv::resize(run[i].depth, small, small_, 0, 0, cv::INTER_NEAREST);
    std::vector<Edge> found = edges(small);
    if (found.size() < kFewestEdges) continue;
    for (std::size_t j = 0; j < std::min(found.size(), kMostEdges); ++j)  // a random choice
      std::swap(found[j], found[j + random() % (found.size() - j)]);
    found.resize(std::min(found.size(), kMostEdges));
    anchors_.push_back({runs_, first + i, std::move(found)});
  }
  ++runs_;
}

// What falls outside the image counts as unrelated.
double EdgeAlignment::score(const Anchor& anchor, const Alignment& at, Detail detail) const {
  const Gradients& image = images_[static_cast<std::size_t>(static_cast<int>(anchor.image) - at.lag)];
  const auto& maps = detail == Detail::kFine ? image.fine : image.coarse;
  const auto zoom = static_cast<float>(at.zoom);
  const auto x0 = static_cast<float>(0.5 * (small_.width - 1) + at.x / scale_);
  const auto y0 = static_cast<float>(0.5 * (small_.height - 1) + at.y / scale_);
  float sum = 0.0F;
  for (const Edge& edge : anchor.edges) {
    const float x = x0 + zoom * edge.x, y = y0 + zoom * edge.y;
    if (!(x >= 0.0F && y >= 0.0F)) continue;
    const int u = static_cast<int>(x), v = static_cast<int>(y);
    if (u + 1 >= small_.width || v + 1 >= small_.height) continue;
    const float a = x - static_cast<float>(u), b = y - static_cast<float>(v);
    const auto* upper = maps[edge.is_along_row ? 1 : 0].ptr<std::int8_t>(v) + u;
    const auto* below = upper + small_.width;
    sum += (1.0F - b) * ((1.0F - a) * upper[0] + a * upper[1]) + b * ((1.0F - a) * below[0] + a * below[1]);
  }
  return sum / (kUnits * static_cast<float>(anchor.edges.size()));
}

double EdgeAlignment::score(const Alignment& at, Detail detail) const {
  const std::size_t step = detail == Detail::kFine ? 1 : std::max<std::size_t>(1, anchors_.size() / 24);
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < anchors_.size(); i += step, ++count) sum += score(anchors_[i], at, detail);
  return sum / static_cast<double>(count);
}

// Of the runs that have depth edges.
std::vector<double> EdgeAlignment::score_by_run(const Alignment& at) const {
  std::vector<double> sums(runs_, 0.0), counts(runs_, 0.0), result;
  for (const Anchor& anchor : anchors_) {
    sums[anchor.run] += score(anchor, at, Detail::kFine);
    counts[anchor.run] += 1.0;
  }
  for (std::size_t run = 0; run < runs_; ++run)
    if (counts[run] > 0.0) result.push_back(sums[run] / counts[run]);
  return result;
}

Contrast EdgeAlignment::above(const std::vector<double>& best, const Alignment& other) const {
  std::vector<double> differences = score_by_run(other);
  for (std::size_t i = 0; i < best.size(); ++i) differences[i] = best[i] - differences[i];
  return contrast_of(differences);
}

// Coordinate ascent with halved steps.
EdgeAlignment::Scored EdgeAlignment::climb(const Alignment& from, bool moves_lag, bool moves_place) const {
  Scored best{from, score(from, Detail::kFine)};
  const auto try_at = [&](const Alignment& at) {
    const double value = score(at, Detail::kFine);
    if (value <= best.score) return false;
    best = {at, value};
    return true;
  };
  for (double step = 1.0; step > 0.2; step *= 0.5) {
    for (int round = 0; round < 20; ++round) {
      bool has_moved = false;
      for (const int sign : {-1, 1}) {
        Alignment at = best.at;
        at.lag += sign;
        if (moves_lag && step == 1.0 && std::abs(at.lag) <= kMostLag) has_moved |= try_at(at);
        if (!moves_place) continue;
        at = best.at;
        at.x += sign * step * scale_;
        has_moved |= try_at(at);
        at = best.at;
        at.y += sign * step * scale_;
        has_moved |= try_at(at);
        at = best.at;
        at.zoom *= 1.0 + sign * 0.02 * step;
        has_moved |= try_at(at);
      }
      if (!has_moved) break;
    }
  }
  return best;
}

// Where climbing begins: the best shift for each lag, and the best zooms with their shift.
std::vector<Alignment> EdgeAlignment::starts() const {
  constexpr double kMostShift = 40.0, kShiftStep = 4.0;  // pixels at a width of 640
  constexpr int kZooms = 13;
  constexpr double kZoomStep = 1.045;
  const double unit = 0.5 * scale_;
  const auto best_shift = [&](Alignment at) {
    Scored best{at, score(at, Detail::kCoarse)};
    for (double y = -kMostShift; y <= kMostShift; y += kShiftStep) {
      for (double x = -kMostShift; x <= kMostShift; x += kShiftStep) {
        at.x = unit * x;
        at.y = unit * y;
        const double value = score(at, Detail::kCoarse);
        if (value > best.score) best = {at, value};
      }
    }
    return best;
  };
  std::vector<Alignment> result;
  result.push_back({});
  for (int lag = -kMostLag; lag <= kMostLag; ++lag) result.push_back(best_shift({lag, 0.0, 0.0, 1.0}).at);
  std::vector<Scored> zooms;
  for (int i = -kZooms; i <= kZooms; ++i)
    if (i != 0) zooms.push_back(best_shift({0, 0.0, 0.0, std::pow(kZoomStep, i)}));
  std::sort(zooms.begin(), zooms.end(), [](const Scored& a, const Scored& b) { return a.score > b.score; });
  for (std::size_t i = 0; i < 3; ++i) result.push_back(zooms[i].at);
  for (int lag = -kMostLag; lag <= kMostLag; ++lag)
    if (lag != 0) result.push_back(best_shift({lag, 0.0, 0.0, zooms.front().at.zoom}).at);
  return result;
}

// The vertex of the parabola through the scores at moved(-1), moved(0) and moved(1), in those steps.
template <typename Move>
Contrast EdgeAlignment::vertex(const Move& moved) const {
  const auto before = score_by_run(moved(-1)), at = score_by_run(moved(0)), after = score_by_run(moved(1));
  return jackknife(at.size(), [&](std::size_t left_out) {
    double slope = 0.0, bend = 0.0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (i == left_out) continue;
      slope += 0.5 * (after[i] - before[i]);
      bend += 2.0 * at[i] - before[i] - after[i];
    }
    return bend > 0.0 ? std::clamp(slope / bend, -1.0, 1.0) : 0.0;
  });
}

EdgeAlignment::Found EdgeAlignment::search() const {
  const Scored given{{}, score(Alignment{}, Detail::kFine)};
  Found found{given, given, given};
  const auto keep = [](Scored& kept, const Scored& other) { kept = other.score > kept.score ? other : kept; };
  for (int lag = -kMostLag; lag <= kMostLag; ++lag)
    keep(found.registered, climb({lag, 0.0, 0.0, 1.0}, true, false));
  for (const Alignment& start : starts()) {
    keep(found.best, climb(start, true, true));
    if (start.lag == 0) keep(found.in_time, climb(start, false, true));
  }
  const Alignment& at = found.best.at;
  keep(found.in_time, climb({0, at.x, at.y, at.zoom}, false, true));
  keep(found.best, found.in_time);
  keep(found.best, found.registered);
  return found;
}

void EdgeAlignment::refine(EdgeFit& fit) const {
  constexpr double kStep = 4.0;  // pixels at a width of 640
  constexpr double kZoomStep = 0.03;
  const double unit = 0.5 * scale_ * kStep;
  const auto refined = [](double at, double step, const Contrast& vertex) {
    return Contrast{at + step * vertex.mean, step * vertex.sigma};
  };
  const Alignment& best = fit.best;
  if (std::abs(best.lag) < kMostLag)
    fit.lag = refined(best.lag, 1.0, vertex([&](int i) { return moved(best, i, 0.0, 0.0, 1.0); }));
  else
    fit.lag = {static_cast<double>(best.lag), 0.5};
  fit.x = refined(best.x, unit, vertex([&](int i) { return moved(best, 0, i * unit, 0.0, 1.0); }));
  fit.y = refined(best.y, unit, vertex([&](int i) { return moved(best, 0, 0.0, i * unit, 1.0); }));
  fit.zoom = refined(best.zoom, kZoomStep,
                     vertex([&](int i) { return moved(best, 0, 0.0, 0.0, 1.0 + i * kZoomStep); }));
}

Alignment EdgeAlignment::moved(Alignment at, int lag, double x, double y, double zoom) {
  at.lag = std::clamp(at.lag + lag, -kMostLag, kMostLag);
  at.x += x;
  at.y += y;
  at.zoom *= zoom;
  return at;
}

std::optional<EdgeFit> EdgeAlignment::fit() const {
  constexpr std::size_t kFewestAnchors = 12;
  const double far = 8.0 * 0.5 * scale_;  // pixels
  if (anchors_.size() < kFewestAnchors) return std::nullopt;
  const Found found = search();
  EdgeFit fit;
  fit.runs = runs_;
  fit.best = found.best.at;
  fit.best_in_time = found.in_time.at;
  fit.score = found.best.score;
  fit.score_as_given = score(Alignment{}, Detail::kFine);
  const std::vector<double> scores = score_by_run(fit.best);
  fit.over_given = above(scores, Alignment{});
  fit.over_in_time = above(scores, found.in_time.at);
  fit.over_registered = above(scores, found.registered.at);
  const auto sureness = [&](int lag, double x, double y, double zoom) {
    const Contrast advantage = above(scores, moved(fit.best, lag, x, y, zoom));
    return advantage.mean / std::max(advantage.sigma, 1e-9);
  };
  fit.tells_lag = std::min(sureness(-2, 0.0, 0.0, 1.0), sureness(2, 0.0, 0.0, 1.0));
  fit.tells_registration =
      std::min({sureness(0, far, 0.0, 1.0), sureness(0, -far, 0.0, 1.0), sureness(0, 0.0, far, 1.0),
                sureness(0, 0.0, -far, 1.0), sureness(0, 0.0, 0.0, 1.08), sureness(0, 0.0, 0.0, 0.92)});
  refine(fit);
  return fit;
}

}  // namespace roslam::evaluation
