// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/scene/restoration_benchmark.hpp"

#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/roslam/benchmark/benchmark_steps.hpp"
#include "apps/roslam/evaluate/removal_truth.hpp"
#include "apps/roslam/evaluate/restoration_evaluation.hpp"
#include "apps/roslam/evaluate/restoration_images.hpp"
#include "apps/roslam/support/output.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;

constexpr std::size_t kImages = 4;  // rows of the figure
constexpr int kImageWidth = 320;    // pixels

class Measurement {
 public:
  Measurement(const BenchmarkSequence& sequence, const RestorationBenchmarkSettings& settings,
              const std::stop_token& stop)
      : sequence_(sequence),
        settings_(settings),
        out_(settings.common.out),
        steps_(out_, sequence.name, settings.common.quiet, stop) {}

  RestoredSequence measure() {
    RestoredSequence result{sequence_, {}, "", ""};
    try {
      if (sequence_.is_simulated()) render();
      steps_.call({"run", sequence_.source, "--camera", sequence_.camera, "--out", folder("run").string(),
                   "--no-dense", "--quiet"},
                  "run");
      for (const auto& method : settings_.methods) result.results.push_back(measure_method(method));
      result.figure = draw();
    } catch (const OutputError&) {
      throw;
    } catch (const std::exception& error) {
      if (!steps_.stop().stop_requested()) result.failure = error.what();
    }
    return result;
  }

 private:
  fs::path folder(const std::string& step) const { return steps_.folder(step); }

  // Renders a simulated flight as a recording with a known background.
  void render() {
    const auto& flight = settings_.common.settings;
    steps_.simulate(sequence_, flight, flight.traffic, "d455", "rendered");
    sequence_.source = folder("rendered").string();
    sequence_.camera = (folder("rendered") / "camera.yaml").string();
  }

  RestorationResult measure_method(const std::string& method) {
    const fs::path restored = folder(method);
    steps_.call({"restore", folder("run").string(), "--method", method, "--every",
                 std::to_string(settings_.every), "--out", restored.string(), "--quiet"},
                method);
    const auto report = nlohmann::json::parse(std::ifstream(restored / "restoration.json"));
    const auto& time = report.at("processor_milliseconds_a_frame");
    RestorationResult result{method, evaluate(restored, {}), std::nullopt,
                             time.is_null() ? std::numeric_limits<double>::quiet_NaN() : time.get<double>()};
    if (write_actor_masks(restored)) result.behind = evaluate(restored, folder("actors"));
    return result;
  }

  fs::path truth() const {
    return settings_.truth.empty() ? fs::path(sequence_.source) : fs::path(settings_.truth);
  }

  RestorationError evaluate(const fs::path& restored, const fs::path& masks) {
    RestorationEvaluationSettings evaluation;
    evaluation.truth = truth();
    evaluation.estimate = restored;
    evaluation.masks = masks;
    evaluation.truth_depth_units = settings_.depth_units;
    if (!segmenter_ && !find_segmentation_model().empty())
      segmenter_ = std::make_unique<PspnetSegmenter>(find_segmentation_model());
    evaluation.segmenter = segmenter_.get();
    evaluation.stop = steps_.stop();
    evaluation.quiet = true;
    RestorationError error = evaluate_restoration(evaluation);
    if (steps_.stop().stop_requested()) throw InputError("interrupted");
    return error;
  }

  // Writes masks of the restored pixels that actors hide, once for all methods. False if the actors are not
  // known.
  bool write_actor_masks(const fs::path& restored) {
    if (has_actor_masks_) return *has_actor_masks_;
    const auto truth = open_removal_truth({sequence_.source, sequence_.camera});
    has_actor_masks_ = truth != nullptr;
    if (!truth) return false;
    make_folder(folder("actors"));
    std::map<std::string, std::string> names;
    for (const auto& image : images_of(restored)) names[time_text(*image.timestamp)] = image.name + ".png";
    while (const auto frame = truth->next()) {
      const auto name = names.find(time_text(frame->timestamp));
      if (name == names.end()) continue;
      cv::Mat hidden =
          cv::Mat::zeros(frame->colour.size(), CV_8UC1);  // stays empty if the truth cannot be read
      const cv::Mat provenance = read_label_image(restored / "provenance" / name->second).image;
      if (frame->truth && !provenance.empty()) hidden = frame->truth->actors & (provenance != 0);
      write_image_fast(folder("actors") / name->second, hidden);
    }
    return true;
  }

  // Draws frames spread over the sequence: as taken, the truth, and restored by each method.
  std::string draw() const {
    const auto taken = images_of(sequence_.source);
    const auto background = background_of(truth());
    std::vector<fs::path> restored;
    for (const auto& method : settings_.methods) restored.push_back(folder(method));
    const auto images = images_of(restored.front());
    std::vector<cv::Mat> rows;
    for (std::size_t i = 0; i < kImages; ++i) {
      const auto& image = images[(2 * i + 1) * images.size() / (2 * kImages)];
      std::vector<cv::Mat> row{image_at(taken, *image.timestamp), image_at(background, *image.timestamp)};
      for (const auto& of_method : restored)
        row.push_back(read_colour_image(of_method / "rgb" / image.colour.filename()).image);
      for (cv::Mat& cell : row) {
        if (cell.empty()) return "";
        cv::resize(cell, cell, {kImageWidth, kImageWidth * cell.rows / cell.cols}, 0, 0, cv::INTER_AREA);
      }
      rows.emplace_back();
      cv::hconcat(row, rows.back());
    }
    cv::Mat figure;
    cv::vconcat(rows, figure);
    const std::string name = sequence_.name + ".jpg";
    write_image(out_ / name, figure);
    return name;
  }

  static cv::Mat image_at(const std::vector<SequenceImage>& images, double timestamp) {
    for (const auto& image : images)
      if (image.timestamp && time_text(*image.timestamp) == time_text(timestamp))
        return read_colour_image(image.colour).image;
    return {};
  }

  BenchmarkSequence sequence_;
  const RestorationBenchmarkSettings& settings_;
  fs::path out_;
  BenchmarkSteps steps_;
  std::unique_ptr<Segmenter> segmenter_;
  std::optional<bool> has_actor_masks_;
};
}  // namespace

RestoredSequence measure_restoration(const BenchmarkSequence& sequence,
                                     const RestorationBenchmarkSettings& settings,
                                     const std::stop_token& stop) {
  return Measurement(sequence, settings, stop).measure();
}

}  // namespace roslam::app
