// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/composition.hpp"

#include <limits>
#include <opencv2/core.hpp>
#include <set>
#include <system_error>

#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/tum_writer.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/sensors/image_file.hpp"
#include "simulation/composition/upright.hpp"

namespace roslam::app {

using namespace simulation;
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kUprightImages = 30;  // depth images from which the up direction is estimated
constexpr double kMaxTruthGap = 0.2;        // seconds; longest interval of true poses to interpolate in
constexpr double kTruthMargin = 0.1;        // seconds of truth kept before the first and after the last frame

// The image lists of the output folder, one line per frame.
class Lists {
 public:
  explicit Lists(const fs::path& out)
      : out_(out),
        colour_(out / "rgb.txt"),
        depth_(out / "depth.txt"),
        background_(out / "background.txt"),
        background_depth_(out / "background_depth.txt") {
    for (auto* list : {&colour_, &depth_, &background_, &background_depth_})
      list->line("# timestamp filename");
  }

  void add(const std::string& time, const fs::path& base_colour, const fs::path& base_depth) {
    colour_.line(time + " rgb/" + time + ".png");
    depth_.line(time + " depth/" + time + ".png");
    background_.line(time + " " + fs::relative(base_colour, out_).generic_string());
    background_depth_.line(time + " " + fs::relative(base_depth, out_).generic_string());
  }

  void close() {
    for (auto* list : {&colour_, &depth_, &background_, &background_depth_}) list->close();
  }

 private:
  fs::path out_;
  TextFile colour_;
  TextFile depth_;
  TextFile background_;
  TextFile background_depth_;
};

void write_images(const fs::path& out, const std::string& name, const ComposedFrame& frame, double units) {
  write_image_fast(out / "rgb" / name, frame.colour);
  write_image_fast(out / "depth" / name, packed_depth(frame.depth, units));
  write_image_fast(out / "labels" / name, frame.labels);
  write_image_fast(out / "instances" / name, frame.instances);
}

void write_truth(const fs::path& out, const Trajectory& truth, const Composition& made) {
  Trajectory kept;
  for (const auto& pose : truth) {
    if (pose.timestamp >= made.times.front() - kTruthMargin &&
        pose.timestamp <= made.times.back() + kTruthMargin)
      kept.push_back(pose);
  }
  write_trajectory(out / "groundtruth.txt", kept);
}

}  // namespace

Trajectory read_truth(const fs::path& folder) {
  const fs::path file = folder / "groundtruth.txt";
  std::error_code error;
  if (!fs::exists(file, error)) {
    throw InputError(file.string() +
                     ": is missing; people can only be composed into a sequence with known camera poses");
  }
  Trajectory truth = read_trajectory(file).trajectory;
  const auto images = read_tum_list(folder / "rgb.txt");
  const auto [first, last] =
      std::minmax_element(images.begin(), images.end(),
                          [](const TimedFile& a, const TimedFile& b) { return a.timestamp < b.timestamp; });
  std::erase_if(truth, [&](const StampedPose& pose) {
    return pose.timestamp < first->timestamp - kTruthMargin ||
           pose.timestamp > last->timestamp + kTruthMargin;
  });
  if (truth.empty()) {
    throw InputError(file.string() +
                     ": has no pose at the time of the images; check that it belongs to this sequence");
  }
  return truth;
}

std::optional<Eigen::Vector3d> find_up(const fs::path& folder, const Camera& camera,
                                       const Trajectory& truth) {
  const auto images = read_tum_list(folder / "depth.txt");
  const std::size_t step = std::max<std::size_t>(1, images.size() / kUprightImages);
  UprightEstimate estimate(camera);
  for (std::size_t i = 0; i < images.size(); i += step) {
    const auto pose = pose_at(truth, images[i].timestamp, kMaxTruthGap);
    if (!pose) continue;
    const ImageFile read = read_depth_image(folder / images[i].file);
    if (read.image.size() != cv::Size(camera.width, camera.height))
      continue;  // empty where it cannot be read
    estimate.add(depth_to_metres(read.image, camera.depth_units_per_metre), pose->T_world_camera);
  }
  return estimate.up();
}

// The output has the layout of the input: in the same folder it would overwrite it.
void protect_base(const CompositionSettings& settings) {
  std::set<fs::path> folders{settings.folder};
  for (const char* list : {"rgb.txt", "depth.txt"}) {
    for (const auto& image : read_tum_list(settings.folder / list))
      folders.insert((settings.folder / image.file).parent_path());
  }
  for (const auto& folder : folders) {
    for (const auto& written : {settings.out, settings.out / "rgb", settings.out / "depth",
                                settings.out / "labels", settings.out / "instances"}) {
      std::error_code error;
      if (fs::equivalent(folder, written, error)) {
        throw OutputError(
            written.string() +
            ": holds the sequence without people, which would be replaced; choose another --out");
      }
    }
  }
}

Composition write_composition(const CompositionSettings& settings, const Composer& composer,
                              TumSource& source, const Trajectory& truth, const std::stop_token& stop) {
  Composition made;
  Lists lists(settings.out);
  const std::size_t most = settings.frames > 0 ? std::min(settings.frames, *source.size()) : *source.size();
  Progress progress(most, settings.quiet);
  while (made.times.size() < most && !stop.stop_requested()) {
    auto frame = source.next();
    if (!frame) break;
    if (frame->depth.empty()) continue;  // counted by the source
    const auto pose = pose_at(truth, frame->timestamp, kMaxTruthGap);
    if (!pose) {
      ++made.skipped["colour image without a true pose near in time"];
      continue;
    }
    frame->T_world_camera = pose->T_world_camera;
    const ComposedFrame composed = composer.compose(*frame);
    const std::string time = time_text(frame->timestamp);
    write_images(settings.out, time + ".png", composed, settings.depth_units_per_metre);
    lists.add(time, source.colour_file(frame->index), *source.depth_file(frame->index));
    made.too_far +=
        static_cast<std::size_t>(cv::countNonZero(frame->depth * settings.depth_units_per_metre > 65535.0));
    made.times.push_back(frame->timestamp);
    made.covered.push_back(composed.covered);
    progress.show(made.times.size(), "composed");
  }
  lists.close();
  made.interrupted = stop.stop_requested();
  for (const auto& [reason, count] : source.skipped()) made.skipped[reason] += count;
  for (const auto& [reason, count] : source.skipped_depth()) made.skipped[reason] += count;
  if (!made.times.empty()) write_truth(settings.out, truth, made);
  return made;
}

}  // namespace roslam::app
