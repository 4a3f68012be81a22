// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// Number of classes of the network: the 19 of Cityscapes, in the order of its train ids.
inline constexpr int kClasses = 19;
inline constexpr std::uint8_t kVoid = 255;  ///< class of a pixel is unknown

ROSLAM_EXPORT std::string_view class_name(int label);

/// Classes of movable objects in the paper's auxiliary descriptor (eq. 12). kUnknown: found moving by
/// geometry, without a label.
enum class Movable : std::uint8_t { kNone, kPerson, kCar, kBicycle, kUnknown };

/// person: person, rider; car: car, truck, bus, train, motorcycle; bicycle: bicycle. Labels outside 0..18 are
/// kNone.
ROSLAM_EXPORT Movable movable_of(int label);
ROSLAM_EXPORT std::string_view name_of(Movable movable);

/// The class of that name; nothing for another name.
ROSLAM_EXPORT std::optional<Movable> movable_from(std::string_view name);

/// A coarser set of classes in which labels can be written and evaluated.
struct ROSLAM_EXPORT LabelSet {
  std::string name;                               ///< as given on the command line
  std::vector<std::string> classes;               ///< by position
  std::vector<std::uint8_t> values;               ///< value in label images, by position
  std::array<std::uint8_t, kClasses> from_class;  ///< position of each of the 19 classes
};

/// cityscapes19 (values 0-18), groups8 (flat, building, pole, nature, sky, person, car, bicycle; 0-7),
/// camvid11 (sky, building, pole, road, pavement, tree, sign, fence, car, pedestrian, bicyclist; 0-10),
/// person (other 0, person 255). Nothing for another name.
ROSLAM_EXPORT std::optional<LabelSet> label_set_from(std::string_view name);

/// Names label_set_from knows.
ROSLAM_EXPORT std::vector<std::string> label_set_names();

/// Converts a label image of the 19 classes (CV_8UC1) to a coarser set; labels outside 0..18 become kVoid.
ROSLAM_EXPORT cv::Mat relabel(const cv::Mat& labels, const LabelSet& set);

/// CV_8UC1 of the labels' size: 255 where the class is movable, else 0.
ROSLAM_EXPORT cv::Mat movable_mask(const cv::Mat& labels);

/// Colour of a class in overlays (BGR), and the overlay: the image tinted by label, movable objects strongly
/// and outlined, static ones faintly. share: opacity of the tint of movable objects, 0 to 1.
ROSLAM_EXPORT cv::Vec3b class_colour(int label);
ROSLAM_EXPORT cv::Mat label_overlay(const cv::Mat& image, const cv::Mat& labels, double share = 0.55);

}  // namespace roslam
