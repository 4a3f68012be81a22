// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam::evaluation {

// Errors of an image within a mask. Images: CV_8UC3 of one size; where: CV_8UC1 of that size, nonzero on the
// pixels that are compared. NaN if there are none.

/// Mean of the squared differences of the channels, grey levels squared.
double mean_square_error(const cv::Mat& truth, const cv::Mat& estimate, const cv::Mat& where);

/// Mean of the absolute differences of the channels, grey levels.
double mean_absolute_error(const cv::Mat& truth, const cv::Mat& estimate, const cv::Mat& where);

/// Peak signal-to-noise ratio of a mean square error, dB; at most 100.
double psnr(double mean_square_error);

/// Structural similarity of the grey images with a Gaussian window of 1.5 pixels (Wang, Bovik, Sheikh,
/// Simoncelli: "Image Quality Assessment: From Error Visibility to Structural Similarity", TIP 2004), mean
/// over the pixels.
double ssim(const cv::Mat& truth, const cv::Mat& estimate, const cv::Mat& where);

}  // namespace roslam::evaluation
