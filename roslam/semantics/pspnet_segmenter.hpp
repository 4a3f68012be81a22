// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "roslam/error.hpp"
#include "roslam/semantics/inference.hpp"
#include "roslam/semantics/segmenter.hpp"

namespace roslam {

struct SegmenterOptions {
  int working_side =
      416;  ///< pixels, longer side of the picture the network sees; less is faster, more is finer

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Size of the picture the network sees: the longer side becomes working_side, both are multiples of 32.
cv::Size working_size(const cv::Size& image, int working_side);

/// The improved PSPNet (section 3.2) behind the Segmenter interface.
class PspnetSegmenter : public Segmenter {
 public:
  /// model: an ONNX file from training/ that takes RGB from 0 to 1 and gives scores of 19 classes. Throws
  /// ModelError naming the file and what was expected, or OptionsError.
  explicit PspnetSegmenter(const std::filesystem::path& model, const SegmenterOptions& options = {},
                           InferenceBackend backend = InferenceBackend::kAutomatic);

  Segmentation segment(const cv::Mat& image) override;

  const SegmenterOptions& options() const { return options_; }

 private:
  cv::Mat scores_for(const cv::Mat& blob);

  std::filesystem::path model_;
  SegmenterOptions options_;
  std::unique_ptr<Inference> inference_;
  cv::Mat seen_;  // kept, as fetching fresh memory for each picture takes longer than filling it
  cv::Mat blob_;
};

/// The weights that ship with the program: models/roslam-pspnet.onnx beside the program or its build folder,
/// or in share/roslam/models of an installation. Empty if there are none.
std::filesystem::path shipped_segmentation_model();

/// What to throw where they are needed and not there.
ModelError missing_segmentation_model();

}  // namespace roslam
