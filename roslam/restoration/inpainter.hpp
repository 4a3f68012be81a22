// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam {

inline constexpr int kCropSide = 256;  ///< pixels, side of an inpainter's input and output

/// Inpaints the background of a removed object where no image shows it. Not thread-safe.
class ROSLAM_EXPORT Inpainter {
 public:
  Inpainter() = default;
  Inpainter(const Inpainter&) = delete;
  Inpainter& operator=(const Inpainter&) = delete;
  virtual ~Inpainter() = default;

  /// crop: CV_8UC3 (BGR) of kCropSide. hole: CV_8UC1, nonzero where the crop is unknown. square: around the
  /// hole (eq. 18), pixels of the crop. kind: class of the removed object. Returns the whole generated crop,
  /// CV_8UC3 (BGR); the caller keeps the known pixels. Throws ModelError.
  virtual cv::Mat inpaint(const cv::Mat& crop, const cv::Mat& hole, const cv::Rect& square, Movable kind) = 0;

  /// What runs the networks, such as "own (AVX2)"; empty if there are none.
  virtual std::string backend() const { return {}; }

  /// Why a faster backend was not chosen, for the user; empty if it was.
  virtual std::string note() const { return {}; }
};

/// The GAN generator with region normalisation (section 3.3), with an encoder for each object class.
class ROSLAM_EXPORT GanInpainter : public Inpainter {
 public:
  /// folder: holds roslam-restorer-{person,car,bicycle,unknown}.onnx, from training/. Throws ModelError
  /// naming the file and what was expected.
  explicit GanInpainter(const std::filesystem::path& folder,
                        InferenceBackend backend = InferenceBackend::kAutomatic);

  cv::Mat inpaint(const cv::Mat& crop, const cv::Mat& hole, const cv::Rect& square, Movable kind) override;

  std::string backend() const override { return networks_[0].inference->backend(); }
  std::string note() const override { return networks_[0].inference->note(); }

 private:
  struct Network {
    std::filesystem::path file;
    std::unique_ptr<Inference> inference;
  };
  std::array<Network, 4> networks_;  // by Movable, without kNone
};

/// The folder of the installed weights; empty if any of them is missing.
ROSLAM_EXPORT std::filesystem::path find_restoration_models();

/// The networks of a folder, or without a name the installed ones; null if these are missing. Throws
/// ModelError.
inline std::shared_ptr<Inpainter> open_inpainter(const std::filesystem::path& folder = {},
                                                 InferenceBackend backend = InferenceBackend::kAutomatic) {
  const std::filesystem::path models = folder.empty() ? find_restoration_models() : folder;
  return models.empty() ? nullptr : std::make_shared<GanInpainter>(models, backend);
}

}  // namespace roslam
