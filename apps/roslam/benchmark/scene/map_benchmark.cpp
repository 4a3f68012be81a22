// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/scene/map_benchmark.hpp"

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "apps/roslam/benchmark/benchmark_steps.hpp"
#include "apps/roslam/evaluate/map_evaluation.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/tum_writer.hpp"
#include "recording/map_render.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/options/options.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

using namespace evaluation;
using namespace recording;

namespace {
namespace fs = std::filesystem;

const cv::Size kImage(480, 300);  // pixels

// A map and the step of the benchmark that makes it.
struct Variant {
  const char* name;
  const char* step;
};

// In the order of the report; the last is of the scene without movable objects.
constexpr std::array kVariants{Variant{kMapAsTaken, "as_taken"}, Variant{kMapRemoved, "removed"},
                               Variant{kMapReprojected, "reprojected"}, Variant{kMapRestored, "all"},
                               Variant{kMapEmptyScene, "empty"}};
constexpr const Variant& kRestored = kVariants[3];
constexpr const Variant& kEmptyScene = kVariants[4];

// The options in which the maps differ; the trajectory does not depend on them.
Options options_for(const Variant& variant, const std::string& config) {
  Options options = config.empty() ? Options{} : read_options(config);
  if (variant.name == kMapAsTaken) {
    options.dense.remove = false;
    options.dense.keep_movable = true;
  }
  if (variant.name == kMapRemoved) options.dense.restore = false;
  if (variant.name == kMapReprojected) options.restoration.inpaint = false;
  return options;
}

class Measurement {
 public:
  Measurement(const BenchmarkSequence& sequence, const MapBenchmarkSettings& settings,
              const std::stop_token& stop)
      : sequence_(sequence),
        settings_(settings),
        out_(settings.common.out),
        steps_(out_, sequence.name, settings.common.quiet, stop) {}

  MappedSequence measure() {
    MappedSequence result;
    result.sequence = sequence_;
    try {
      prepare();
      for (const Variant& variant : kVariants)
        map(variant, &variant == &kEmptyScene ? empty_ : sequence_.source);
      read_costs(result);
      result.maps = evaluate();
      result.figure = draw();
    } catch (const OutputError&) {
      throw;
    } catch (const std::exception& error) {
      if (!steps_.stop().stop_requested()) result.failure = error.what();
    }
    return result;
  }

 private:
  // Sets the sequence, the same without movable objects, and the ground truth: its background without noise.
  void prepare() {
    truth_.sequence = sequence_.source;
    truth_.camera = sequence_.camera;
    truth_.background = settings_.truth;
    truth_.background_depth_units = settings_.depth_units;
    empty_ = settings_.truth;
    if (!sequence_.is_simulated()) {
      if (empty_.empty())
        throw InputError(
            "the empty scene is missing; give the same frames without movable objects "
            "with --truth");
      return;
    }
    const BenchmarkSettings& flight = settings_.common.settings;
    steps_.simulate(sequence_, flight, flight.traffic, "d455", "rendered");
    steps_.simulate(sequence_, flight, flight.traffic, "ideal", "exact");
    sequence_.source = steps_.folder("rendered").string();
    sequence_.camera = (steps_.folder("rendered") / "camera.yaml").string();
    empty_ = write_empty_scene();
    truth_ = {sequence_.source, steps_.folder("exact"), sequence_.camera};
  }

  // Writes image lists that make the background of the flight a recording of its own.
  std::string write_empty_scene() const {
    const fs::path folder = steps_.folder("empty_scene");
    make_folder(folder);
    TextFile colours(folder / "rgb.txt"), depths(folder / "depth.txt");
    for (const SequenceImage& image : background_of(sequence_.source)) {
      const std::string time = time_text(*image.timestamp);
      colours.line(time + " " + fs::relative(image.colour, folder).string());
      depths.line(time + " " + fs::relative(image.depth, folder).string());
    }
    colours.close();
    depths.close();
    return folder.string();
  }

  void map(const Variant& variant, const std::string& source) {
    make_folder(out_ / "runs");
    const std::string config = steps_.folder(variant.step).string() + ".yaml";
    write_file(config, options_to_yaml(options_for(variant, settings_.common.settings.config)));
    steps_.call({"run", source, "--camera", camera_of(source), "--config", config, "--out",
                 steps_.folder(variant.step).string(), "--quiet"},
                variant.step);
  }

  // The depth images of a recording may have other units than those of the sequence composed from it.
  std::string camera_of(const std::string& source) {
    if (source != settings_.truth) return sequence_.camera;
    const auto units = settings_.depth_units ? settings_.depth_units : depth_units_beside(settings_.truth);
    if (!units) return sequence_.camera;
    Camera camera = load_camera(sequence_.camera);
    camera.depth_units_per_metre = *units;
    const std::string file = steps_.folder("empty_camera").string() + ".yaml";
    write_file(file, camera_to_yaml(camera));
    return file;
  }

  void read_costs(MappedSequence& result) const {
    const auto report = nlohmann::json::parse(std::ifstream(steps_.folder(kRestored.step) / "run.json"));
    result.fuse_milliseconds =
        report.at("processor_milliseconds").at("dense.fuse").at("median").get<double>();
    result.voxel_megabytes = report.at("dense").at("voxel_megabytes").get<double>();
    result.peak_megabytes = report.at("peak_memory_megabytes").get<double>();
    result.path_length = report.at("path_length_metres").get<double>();
  }

  std::vector<EvaluatedMap> evaluate() const {
    MapEvaluationSettings evaluation;
    evaluation.truth = truth_;
    evaluation.truth_options.range = settings_.range;
    evaluation.truth_options.far_range = std::max(evaluation.truth_options.far_range, settings_.range);
    for (const Variant& variant : kVariants)
      evaluation.estimates.push_back({variant.name, steps_.folder(variant.step)});
    evaluation.reference = steps_.folder(kEmptyScene.step);
    evaluation.quiet = settings_.common.quiet;
    return evaluate_maps(evaluation);
  }

  // Draws the maps from the front and, below, from above.
  std::string draw() const {
    std::vector<cv::Mat> front, top;
    for (const Variant& variant : kVariants) {
      const fs::path run = steps_.folder(variant.step);
      const SurfaceMap surface = read_surface_ply(run / "dense.ply");
      const Trajectory trajectory = read_trajectory(run / "trajectory.txt").trajectory;
      const auto drawn = [&](const Viewpoint& view) {
        return draw_surface(surface, view, MapColour::kRgb, surface.spacing);
      };
      front.push_back(drawn(front_view(trajectory.front().T_world_camera, kImage)));
      top.push_back(drawn(top_view(surface, kImage)));
    }
    std::vector<cv::Mat> rows(2);
    cv::hconcat(front, rows[0]);
    cv::hconcat(top, rows[1]);
    cv::Mat figure;
    cv::vconcat(rows, figure);
    const std::string name = sequence_.name + ".jpg";
    write_image(out_ / name, figure);
    return name;
  }

  BenchmarkSequence sequence_;
  const MapBenchmarkSettings& settings_;
  fs::path out_;
  BenchmarkSteps steps_;
  std::string empty_;  // source without movable objects
  MapSequenceSettings truth_;
};
}  // namespace

const EvaluatedMap* MappedSequence::find(const std::string& name) const {
  for (const EvaluatedMap& map : maps)
    if (map.name == name) return &map;
  return nullptr;
}

double MappedSequence::filled_share() const {
  const EvaluatedMap* open = find(kMapRemoved);
  const EvaluatedMap* filled = find(kMapRestored);
  if (open == nullptr || filled == nullptr || !(open->error.missing_of_reference > 0.0))
    return std::numeric_limits<double>::quiet_NaN();
  return 1.0 - filled->error.missing_of_reference / open->error.missing_of_reference;
}

MappedSequence measure_maps(const BenchmarkSequence& sequence, const MapBenchmarkSettings& settings,
                            const std::stop_token& stop) {
  return Measurement(sequence, settings, stop).measure();
}

}  // namespace roslam::app
