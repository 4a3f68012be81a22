// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/export.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/semantics/segmenter.hpp"
#include "roslam/semantics/segmenter_options.hpp"

namespace roslam {

/// Size of the input image of the network: the longer side becomes working_side, both are multiples of 32.
ROSLAM_EXPORT cv::Size working_size(const cv::Size& image, int working_side);

/// The improved PSPNet of the paper (section 3.2).
class ROSLAM_EXPORT PspnetSegmenter : public Segmenter {
 public:
  /// model: an ONNX file from training/ that takes RGB from 0 to 1 and outputs scores of 19 classes. Throws
  /// ModelError naming the file and what was expected, or OptionsError.
  explicit PspnetSegmenter(const std::filesystem::path& model, const SegmenterOptions& options = {},
                           InferenceBackend backend = InferenceBackend::kAutomatic);

  Segmentation segment(const cv::Mat& image) override;

  const SegmenterOptions& options() const { return options_; }

  std::string backend() const override;
  std::string note() const override;

 private:
  void check_scores(const cv::Size& scores, int classes, const cv::Size& image) const;

  std::filesystem::path model_;
  SegmenterOptions options_;
  std::unique_ptr<Inference> inference_;
  cv::Mat input_image_;  // reused between calls: allocating it for each image takes longer than filling it
};

/// The weights supplied with the program: models/roslam-pspnet.onnx beside the program or its build folder,
/// or in share/roslam/models of an installation. Empty if there are none.
ROSLAM_EXPORT std::filesystem::path find_segmentation_model();

/// The error to throw if they are needed but missing.
ROSLAM_EXPORT ModelError missing_segmentation_model();

}  // namespace roslam
