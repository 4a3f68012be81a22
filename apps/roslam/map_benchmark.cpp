// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/map_benchmark.hpp"

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "apps/roslam/benchmark_steps.hpp"
#include "apps/roslam/map_evaluation.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/tum_writer.hpp"
#include "roslam/cloud/map_picture.hpp"
#include "roslam/cloud/surface_file.hpp"
#include "roslam/error.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/sources/image_file.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

const cv::Size kPicture(480, 300);  // pixels

// A map and the step that makes it.
struct Variant {
  const char* name;
  const char* step;
};

// In the order of the report; the last is of another flight.
constexpr std::array kVariants{Variant{kMapAsTaken, "as_taken"}, Variant{kMapRemoved, "removed"},
                               Variant{kMapReprojected, "reprojected"}, Variant{kMapRestored, "all"},
                               Variant{kMapEmptyScene, "empty"}};
constexpr const Variant& kRestored = kVariants[3];
constexpr const Variant& kEmptyScene = kVariants[4];

// What makes the maps differ; the trajectory does not depend on it.
Options options_for(const Variant& variant, const std::string& config) {
  Options options = config.empty() ? Options{} : read_options(config);
  if (variant.name == kMapAsTaken) {
    options.dense.remove = false;
    options.dense.keep_movable = true;
  }
  if (variant.name == kMapRemoved) options.dense.restore = false;
  if (variant.name == kMapReprojected) options.restoration.invent = false;
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
  // What is flown, the same without what moves, and its exact background.
  void prepare() {
    truth_.sequence = sequence_.source;
    truth_.camera = sequence_.camera;
    truth_.background = settings_.truth;
    truth_.background_depth_units = settings_.depth_units;
    empty_ = settings_.truth;
    if (!sequence_.is_simulated()) {
      if (empty_.empty())
        throw InputError(
            "the map of the empty scene is missing; name the same frames without what moves "
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

  // The background of the flight as a recording of its own.
  std::string write_empty_scene() const {
    const fs::path folder = steps_.folder("empty_scene");
    make_folder(folder);
    TextFile colours(folder / "rgb.txt"), depths(folder / "depth.txt");
    for (const SequencePicture& picture : background_of(sequence_.source)) {
      const std::string time = time_text(*picture.timestamp);
      colours.line(time + " " + fs::relative(picture.colour, folder).string());
      depths.line(time + " " + fs::relative(picture.depth, folder).string());
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

  // The depth of a recording may have other units than that of the people put into it.
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

  // The maps from the front and, below, from above.
  std::string draw() const {
    std::vector<cv::Mat> front, top;
    for (const Variant& variant : kVariants) {
      const fs::path run = steps_.folder(variant.step);
      const Surface surface = read_surface_ply(run / "dense.ply");
      const Trajectory flight = read_trajectory(run / "trajectory.txt").trajectory;
      const auto drawn = [&](const MapView& view) {
        return draw_surface(surface, view, MapColour::kRgb, surface.spacing);
      };
      front.push_back(drawn(front_view(flight.front().T_world_camera, kPicture)));
      top.push_back(drawn(top_view(surface, kPicture)));
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
  std::string empty_;  // source without what moves
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
