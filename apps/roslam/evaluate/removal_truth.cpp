// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/evaluate/removal_truth.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "roslam/semantics/label_set.hpp"
#include "roslam/sensors/image_file.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam::app {

using namespace evaluation;
using namespace simulation;

namespace {
namespace fs = std::filesystem;

// labels: classes; empty if they are not known.
MovingTruth truth_of(const cv::Mat& instances, const cv::Mat& labels) {
  MovingTruth truth{instances != 0, {}};
  if (!labels.empty()) truth.at_rest = movable_mask(labels) & ~truth.actors;
  return truth;
}

class FlightTruth : public RemovalTruth {
 public:
  explicit FlightTruth(const SimulatorOptions& options) : simulator_(options) {}

  std::optional<RemovalTruthFrame> next() override {
    if (index_ >= simulator_.size()) return std::nullopt;
    const SimulatedView view = simulator_.render(index_++);
    return RemovalTruthFrame{view.frame.timestamp, view.frame.colour,
                             truth_of(view.instances, view.frame.labels)};
  }

  std::size_t size() const override { return simulator_.size(); }

 private:
  Simulator simulator_;
  std::size_t index_ = 0;
};

std::vector<fs::path> images_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".png") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Actor numbers: most pixels are 0 (no actor), while class 0 is road. With classes 255 (no class) occurs
// beside other values; in a mask it is the only other value.
bool are_actors(const std::vector<fs::path>& files) {
  constexpr std::size_t kSample = 30;
  std::array<std::size_t, 256> pixels{};
  const std::size_t count = std::min(kSample, files.size());
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Mat labels = read_label_image(files[i * files.size() / count]).image;
    std::for_each(labels.begin<std::uint8_t>(), labels.end<std::uint8_t>(),
                  [&](std::uint8_t value) { ++pixels[value]; });
  }
  const std::size_t other = std::accumulate(pixels.begin() + 1, pixels.end() - 1, std::size_t{0});
  const std::size_t most = pixels.back();
  return pixels.front() > other + most && (most == 0 || other == 0);
}

class RecordedTruth : public RemovalTruth {
 public:
  RecordedTruth(std::unique_ptr<TumSource> source, MovingTruthFolder folder)
      : source_(std::move(source)), folder_(std::move(folder)) {}

  std::optional<RemovalTruthFrame> next() override {
    const auto frame = source_->next();
    if (!frame) return std::nullopt;
    std::optional<MovingTruth> truth = folder_.read(source_->colour_file(frame->index).stem().string());
    if (truth && truth->actors.size() != frame->colour.size()) truth.reset();
    return RemovalTruthFrame{frame->timestamp, frame->colour, truth};
  }

  std::size_t size() const override { return source_->size().value_or(0); }
  std::map<std::string, std::size_t> skipped() const override { return source_->skipped(); }

 private:
  std::unique_ptr<TumSource> source_;
  MovingTruthFolder folder_;
};
}  // namespace

std::optional<MovingTruthFolder> MovingTruthFolder::open(const fs::path& folder) {
  MovingTruthFolder truth;
  // Labels with a labels.json are estimates of roslam segment, not truth.
  const auto labels =
      fs::exists(folder / "labels/labels.json") ? std::vector<fs::path>{} : images_in(folder / "labels");
  if (!labels.empty()) truth.labels_ = folder / "labels";
  if (!images_in(folder / "instances").empty()) {
    truth.instances_ = folder / "instances";
  } else if (labels.empty()) {
    return std::nullopt;
  } else {
    truth.labels_are_classes_ = !are_actors(labels);
  }
  return truth;
}

std::optional<MovingTruth> MovingTruthFolder::read(const std::string& name) const {
  cv::Mat labels;
  if (!labels_.empty()) {
    labels = read_label_image(labels_ / (name + ".png")).image;
    if (labels.empty()) return std::nullopt;
  }
  if (!instances_.empty()) {
    const cv::Mat instances = read_depth_image(instances_ / (name + ".png")).image;
    if (instances.empty() || (!labels.empty() && labels.size() != instances.size())) return std::nullopt;
    return truth_of(instances, labels);
  }
  return MovingTruth{labels_are_classes_ ? movable_mask(labels) : cv::Mat(labels != 0), {}};
}

std::unique_ptr<RemovalTruth> open_removal_truth(const SourceArguments& arguments) {
  if (const auto flight = simulated_flight(arguments)) return std::make_unique<FlightTruth>(*flight);
  auto recording = open_folder(arguments);
  const auto folder = MovingTruthFolder::open(arguments.name);
  if (!folder) return nullptr;
  return std::make_unique<RecordedTruth>(std::move(recording), *folder);
}

}  // namespace roslam::app
