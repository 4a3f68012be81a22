// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "roslam/semantics/inference.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam {

inline constexpr int kCropSide = 256;  ///< pixels, of the pictures that an inpainter paints

/// Paints what is behind a removed thing where nobody saw it. Not safe to call from several threads at once.
class Inpainter {
 public:
  Inpainter() = default;
  Inpainter(const Inpainter&) = delete;
  Inpainter& operator=(const Inpainter&) = delete;
  virtual ~Inpainter() = default;

  /// crop: CV_8UC3 (BGR) of kCropSide. hole: CV_8UC1, nonzero where the picture shows nothing. square: around
  /// the hole (eq. 18), pixels of the crop. kind: what was removed. Returns the whole picture as painted,
  /// CV_8UC3; what was known of it is for the caller to keep. Throws ModelError.
  virtual cv::Mat paint(const cv::Mat& crop, const cv::Mat& hole, const cv::Rect& square, Movable kind) = 0;
};

/// The generator with region normalisation (section 3.3), with an encoder for each class of thing.
class GanInpainter : public Inpainter {
 public:
  /// folder: holds roslam-restorer-person.onnx and those of car, bicycle and unknown, from training/. Throws
  /// ModelError naming the file and what was expected.
  explicit GanInpainter(const std::filesystem::path& folder,
                        InferenceBackend backend = InferenceBackend::kAutomatic);

  cv::Mat paint(const cv::Mat& crop, const cv::Mat& hole, const cv::Rect& square, Movable kind) override;

 private:
  struct Network {
    std::filesystem::path file;
    std::unique_ptr<Inference> inference;
  };
  std::array<Network, 4> networks_;  // by Movable, without kNone
};

/// The folder of the weights that come with the program; empty if any of them is missing.
std::filesystem::path shipped_restoration_models();

}  // namespace roslam
