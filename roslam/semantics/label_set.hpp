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

namespace roslam {

/// The classes the network tells apart: the 19 of Cityscapes, in the order of its train ids.
inline constexpr int kClasses = 19;
inline constexpr std::uint8_t kVoid = 255;  ///< nothing is known about a pixel

std::string_view class_name(int label);

/// What the paper's auxiliary descriptor tells apart among things that may move (eq. 12). What geometry finds
/// moving without a label is unknown.
enum class Movable : std::uint8_t { kNone, kPerson, kCar, kBicycle, kUnknown };

/// person: person, rider; car: car, truck, bus, train, motorcycle; bicycle: bicycle. Labels outside 0..18 are
/// kNone.
Movable movable_of(int label);
std::string_view name_of(Movable movable);

/// The class of that name; nothing for another name.
std::optional<Movable> movable_from(std::string_view name);

/// A coarser set of classes that labels can be written and scored in.
struct LabelSet {
  std::string name;                               ///< as on the command line
  std::vector<std::string> classes;               ///< by position
  std::vector<std::uint8_t> values;               ///< value in label images, by position
  std::array<std::uint8_t, kClasses> from_class;  ///< position of each of the 19 classes
};

/// cityscapes19 (values 0-18), groups8 (flat, building, pole, nature, sky, person, car, bicycle; 0-7),
/// camvid11 (sky, building, pole, road, pavement, tree, sign, fence, car, pedestrian, bicyclist; 0-10),
/// person (other 0, person 255). Nothing for another name.
std::optional<LabelSet> label_set_from(std::string_view name);

/// Names label_set_from knows.
std::vector<std::string> label_set_names();

/// A label image of the 19 classes (CV_8UC1) written in a coarser set; labels outside 0..18 become kVoid.
cv::Mat relabel(const cv::Mat& labels, const LabelSet& set);

/// CV_8UC1 of the labels' size: 255 where the class is one that may move, else 0.
cv::Mat movable_mask(const cv::Mat& labels);

/// Colour of a class in pictures (BGR), and the pictures themselves: labels over the image, movable things
/// strongly tinted and outlined, static ones faintly. share: opacity of the tint of movable things, 0 to 1.
cv::Vec3b class_colour(int label);
cv::Mat label_overlay(const cv::Mat& image, const cv::Mat& labels, double share = 0.55);

}  // namespace roslam
