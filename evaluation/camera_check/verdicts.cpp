// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/verdicts.hpp"
#include "roslam/common/formatted.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace roslam::evaluation {

namespace {
constexpr const char* kNoEdges =
    "too few steps in depth were seen: record objects before a far background, with texture";

CameraFinding fits(std::string words) { return {Verdict::kFits, std::move(words), {}}; }
CameraFinding unknown(std::string words) { return {Verdict::kCannotTell, std::move(words), {}}; }
CameraFinding misfit(std::string words, std::string remedy) {
  return {Verdict::kDoesNotFit, std::move(words), std::move(remedy)};
}

// Whether an alignment is better by more than chance and by a share of the score that counts.
bool is_better(const Contrast& advantage, double least_share, double score) {
  constexpr double kSigmas = 3.0, kLeast = 0.03;
  return advantage.is_above(kSigmas) && advantage.mean > std::max(kLeast, least_share * score);
}

// Edges of depth lie on edges of the image at all.
bool is_aligned(const EdgeFit& edges) {
  constexpr double kLeastScore = 0.35;
  return edges.score > kLeastScore;
}

// How far depth is moved against colour, on average over the image, in pixels at a width of 640.
double displacement(const EdgeFit& edges, const Camera& camera) {
  constexpr double kMeanRadius = 0.3;  // image widths, of depth edges
  const double to_640 = 640.0 / camera.width;
  return std::hypot(std::hypot(edges.x.mean, edges.y.mean) * to_640,
                    640.0 * kMeanRadius * (edges.zoom.mean - 1.0));
}
}  // namespace

CameraFinding judge_timing(const CameraCheck& check) {
  constexpr double kTolerance = 0.5, kMisfit = 0.75;  // frames
  constexpr double kLeastShare = 0.05;                // of the score
  constexpr double kSigmas = 4.0;
  if (!check.edges) return unknown(kNoEdges);
  const EdgeFit& edges = *check.edges;
  const double lag = edges.lag.mean;
  const std::string figure =
      formatted("depth is %.0f ms (%.1f +- %.1f frames) %s", 1e3 * check.interval * std::abs(lag),
                std::abs(lag), edges.lag.sigma, lag < 0.0 ? "early" : "late");
  if (!is_aligned(edges))
    return unknown("edges of depth and colour do not coincide under any alignment that was tried");
  if (edges.best.lag != 0 && std::abs(lag) > kMisfit &&
      is_better(edges.over_in_time, kLeastShare, edges.score))
    return misfit(figure,
                  formatted("match depth images to colour images by %.3f s %s timestamps (the driver's "
                            "synchronisation, or the offset in the list of depth images)",
                            check.interval * std::abs(lag), lag < 0.0 ? "later" : "earlier"));
  if (edges.tells_lag < kSigmas || edges.best.lag != 0)
    return unknown(
        formatted("too little motion or too few steps in depth: images two frames earlier or later fit "
                  "as well (%.1f standard errors worse); turn the camera faster",
                  edges.tells_lag));
  if (std::abs(lag) + 2.0 * edges.lag.sigma > kMisfit || std::abs(lag) > kTolerance)
    return unknown(figure + ", which is too near to one frame to tell");
  return fits(figure);
}

CameraFinding judge_registration(const CameraCheck& check, const Camera& camera) {
  constexpr double kTolerance = 5.0, kMisfit = 7.0;  // pixels at a width of 640
  constexpr double kLeastShare = 0.18;               // of the score; where edges repeat it is less
  constexpr double kSigmas = 2.0;
  if (!check.edges) return unknown(kNoEdges);
  const EdgeFit& edges = *check.edges;
  const double moved = displacement(edges, camera);
  const std::string figure = formatted(
      "depth is shifted by (%.1f +- %.1f, %.1f +- %.1f) px and %.3f +- %.3f times as large as colour",
      -edges.x.mean, edges.x.sigma, -edges.y.mean, edges.y.sigma, 1.0 / edges.zoom.mean, edges.zoom.sigma);
  if (!is_aligned(edges))
    return unknown("edges of depth and colour do not coincide under any alignment that was tried");
  if (moved > kMisfit && is_better(edges.over_registered, kLeastShare, edges.score))
    return misfit(
        figure,
        "register depth to colour: align_depth of the RealSense driver, depth_registration of OpenNI, or "
        "a recording with the calibration of both cameras and the transform between them");
  if (moved > kTolerance) return unknown(figure + ", which is too little or too uncertain to count");
  if (edges.tells_registration < kSigmas)
    return unknown(
        formatted("too few steps in depth, or too similar ones: images that are moved by 8 px fit as well "
                  "(%.1f standard errors worse)",
                  edges.tells_registration));
  return fits(figure);
}

CameraFinding judge_distortion(const CameraCheck& check, const Camera& camera) {
  constexpr double kTolerance = 2.5, kMisfit = 6.0;  // pixels, at the outermost points
  constexpr double kSigmas = 5.0, kMostSigma = 1.5;
  constexpr double kLessError = 0.95;  // ratio of errors that counts
  constexpr double kMostError = 2.0;   // pixels, where motion is rigid
  constexpr std::size_t kFewestPairs = 6, kFewestPoints = 500;
  constexpr double kOutermost = 0.6;
  const LensFit& given = check.as_given;
  if (given.pairs < kFewestPairs || given.points < kFewestPoints)
    return unknown(
        formatted("only %zu points in %zu pairs of images have texture, depth and a motion that fits",
                  given.points, given.pairs));
  if (given.outermost < kOutermost)
    return unknown(
        formatted("the corners were not seen: 95 %% of the points are within %.0f %% of the way to them",
                  100.0 * given.outermost));
  if (std::min({given.free_error, check.inverse.free_error, check.none.free_error}) > kMostError)
    return unknown(
        formatted("no rigid motion explains the images under any lens (mean error %.1f px): too much moves "
                  "in them, or depth does not belong to them",
                  given.free_error));
  const double share = std::pow(given.outermost, 3);
  const Contrast left{share * given.corner.mean, share * given.corner.sigma};
  std::string figure = formatted("mean error %.2f px as given", given.error);
  if (camera.has_distortion())
    figure += formatted(", %.2f without, %.2f with the inverse sign", check.none.error, check.inverse.error);
  figure += formatted(
      "; left over: k1 %.3f +- %.3f, which moves points by %.1f +- %.1f px at %.0f %% of the way to the "
      "corners",
      given.k1.mean, given.k1.sigma, left.mean, left.sigma, 100.0 * given.outermost);
  if (camera.has_distortion()) {
    const bool is_inverse = check.inverse.error < check.none.error;
    const LensFit& other = is_inverse ? check.inverse : check.none;
    if (other.error < kLessError * given.error && std::abs(other.corner.mean) < std::abs(given.corner.mean))
      return misfit(figure,
                    is_inverse
                        ? "negate the coefficients: they are those of the inverse model, or of the other sign"
                        : "leave out the distortion: the images are undistorted already");
  }
  const bool is_sure = std::abs(left.mean) > kSigmas * left.sigma;
  if (is_sure && std::abs(left.mean) > kMisfit && given.free_error < kLessError * given.error)
    return misfit(
        figure,
        camera.has_distortion()
            ? "calibrate the lens: the coefficients are not those of these images"
            : formatted(
                  "add the distortion of the lens, by its camera_info or a calibration; about [%.3f, 0]",
                  given.k1.mean));
  if (left.sigma > kMostSigma)
    return unknown(figure + "; too uncertain: record textured, near surfaces while turning the camera");
  if (std::abs(left.mean) > kTolerance)
    return unknown(figure + "; some distortion may be missing, a calibration would tell");
  return fits(figure);
}

namespace {
// factor: how many times depth is too large.
std::string scale_remedy(const Contrast& scale, const Camera& camera) {
  const double factor = scale.mean, uncertainty = std::max(0.15, 2.5 * scale.sigma / scale.mean);
  if (camera.depth_units_per_metre <= 0.0)
    return formatted("%s depth by %.3g", factor > 1.0 ? "divide" : "multiply",
                     std::max(factor, 1.0 / factor));
  const double units = camera.depth_units_per_metre * factor;
  double best = units, least = uncertainty;
  for (const double usual : {100.0, 256.0, 1000.0, 4000.0, 5000.0, 10000.0, 65535.0}) {
    const double apart = std::abs(std::log(units / usual));
    if (apart < least) best = usual, least = apart;
  }
  return formatted(best == units ? "set depth_units_per_metre about %.3g" : "set depth_units_per_metre %.0f",
                   best);
}

std::string scale_in_words(double factor) {
  return factor > 1.0 ? formatted("depth is %.2f times too large", factor)
                      : formatted("depth is %.2f times too small", 1.0 / factor);
}

std::optional<CameraFinding> by_truth(const CameraCheck& check, const Camera& camera) {
  constexpr double kTolerance = 0.25, kMisfit = 0.35;  // of the logarithm
  constexpr double kSigmas = 5.0, kMostSigma = 0.1;
  if (!check.scale) return std::nullopt;
  const double factor = check.scale->mean, deviation = std::abs(std::log(factor)),
               sigma = check.scale->sigma / factor;
  const std::string figure = formatted("motions by depth are %.3f +- %.3f times as long as the true ones",
                                       factor, check.scale->sigma);
  if (deviation > kMisfit && check.distortion.verdict == Verdict::kDoesNotFit)
    return unknown(figure + ", by the wrong lens: correct the distortion and check again");
  if (deviation > kMisfit && deviation > kSigmas * sigma)
    return misfit(scale_in_words(factor) + ": " + figure, scale_remedy(*check.scale, camera));
  if (deviation < kTolerance && sigma < kMostSigma) return fits(figure);
  return std::nullopt;
}

// By the steps of depth and the shadows of a triangulating sensor, see DepthScale. Their ratio is 0.01 to
// 0.3 1/metre squared for the sensors that are known, and grows with the square of the factor.
std::optional<CameraFinding> by_sensor(const CameraCheck& check) {
  constexpr double kTooSmall = 0.005, kLeast = 0.015, kMost = 0.25, kTooLarge = 0.55;
  constexpr double kLongestBaseline = 0.16, kFar = 15.0;  // metres
  if (!check.baseline || !check.step_factor) return std::nullopt;
  const double ratio = *check.baseline / *check.step_factor;
  const std::string figure = formatted(
      "steps of depth and shadows are those of a sensor with a baseline of %.3f m and "
      "disparity in steps of %.3f px",
      *check.baseline, *check.baseline * *check.step_factor);
  if (ratio > kTooLarge && *check.baseline > kLongestBaseline && check.far / 5.0 < kFar)
    return misfit("depth is several times too large: " + figure,
                  "give depth_units_per_metre; " + std::string(usual_depth_units()));
  if (ratio < kTooSmall)
    return misfit("depth is several times too small: " + figure,
                  "give depth_units_per_metre; " + std::string(usual_depth_units()));
  if (ratio > kLeast && ratio < kMost)
    return fits(figure + ", which is plausible to a factor of about three");
  return std::nullopt;
}
}  // namespace

CameraFinding judge_depth_scale(const CameraCheck& check, const Camera& camera) {
  constexpr double kAllNear = 0.6, kHalfNear = 0.25;  // metres; nearer than depth sensors measure
  constexpr double kMultiples = 0.999;
  constexpr double kFar = 5.0;  // metres, median, beyond which sensors that write millimetres are poor
  const std::string range =
      formatted("depth is %.2f to %.2f m, half of it within %.2f m", check.near, check.far, check.median);
  if (check.far <= 0.0) return unknown("no depth is known");
  if (auto finding = by_truth(check, camera)) return *finding;
  if (check.far < kAllNear || check.median < kHalfNear)
    return misfit("depth is implausibly small: " + range,
                  "depth_units_per_metre is probably too large; " + std::string(usual_depth_units()));
  const bool has_fives = check.multiples_of_five > kMultiples;
  if (has_fives && std::abs(camera.depth_units_per_metre - 1000.0) < 1.0 && check.median > kFar)
    return misfit(
        "depth is 5 times too large: every value is a multiple of 5, as of millimetres that were "
        "written with 5000 units a metre; " +
            range,
        "set depth_units_per_metre 5000");
  if (auto finding = by_sensor(check)) return *finding;
  return unknown(
      "no true poses with enough motion, and no steps of depth and shadows that tell the sensor; " + range);
}

}  // namespace roslam::evaluation
