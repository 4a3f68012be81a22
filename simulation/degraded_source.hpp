// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "simulation/wrapped_source.hpp"

namespace roslam::simulation {

/// What a slow computer or a poor camera does to a recording.
enum class Degradation {
  kNone,
  kEvery2,  ///< only each second image
  kEvery3,
  kEvery4,
  kEvery5,
  kBlur,      ///< motion blur of a fortieth of the image width in a third of the images
  kExposure,  ///< brightness steps between 0.5 and 1.6 times
  kBursts     ///< bursts of images are missing: 0.2, 0.5 and 1 s in turn, one every three seconds
};

/// "none", "every-2" to "every-5", "blur", "exposure", "bursts".
std::string_view name_of(Degradation degradation);
std::optional<Degradation> degradation_from(std::string_view name);
std::vector<std::string> degradation_names();

/// A source whose images are degraded. The same source gives the same images each time.
class DegradedSource : public WrappedSource {
 public:
  DegradedSource(std::unique_ptr<FrameSource> source, Degradation degradation)
      : WrappedSource(*source), owned_(std::move(source)), degradation_(degradation) {}

  std::optional<Frame> next() override;
  std::optional<std::size_t> size() const override;

 private:
  bool is_missing(const Frame& frame);

  std::unique_ptr<FrameSource> owned_;
  Degradation degradation_;
  std::optional<double> begin_;  // seconds, time of the first image
};

}  // namespace roslam::simulation
