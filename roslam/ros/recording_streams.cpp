// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/recording_streams.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <string_view>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool has_any(const std::string& name, std::initializer_list<std::string_view> words) {
  const std::string text = lower(name);
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return text.find(word) != std::string::npos; });
}

constexpr int kRegistered = 30;  // score of depth from which on its name says that it is registered

bool is_rectified(const RecordedImages& images) { return has_any(images.topic.name, {"_rect"}); }

// How well images serve as colour or as depth; 0: not at all.
int score_as_colour(const RecordedImages& images) {
  if (images.kind != PixelKind::kColour && images.kind != PixelKind::kGrey) return 0;
  const std::string& name = images.topic.name;
  if (has_any(name, {"depth"})) return 0;
  const int raw = (images.is_compressed ? 0 : 1) + (is_rectified(images) ? 0 : 2);
  if (has_any(name, {"infra"})) return 10 + raw;
  return (images.kind == PixelKind::kColour ? 40 : 20) +
         (has_any(name, {"color", "colour", "rgb"}) ? 10 : 0) + raw;
}

int score_as_depth(const RecordedImages& images) {
  if (images.kind != PixelKind::kDepth) return 0;
  const std::string& name = images.topic.name;
  const bool is_named = has_any(name, {"depth"});
  if (!is_named && (images.encoding == "mono16" || has_any(name, {"infra", "confidence"}))) return 0;
  const int raw = images.is_compressed ? 0 : 1;
  if (has_any(name, {"aligned_depth", "depth_to_color", "depth_to_rgb"})) return 40 + raw;
  if (has_any(name, {"registered"})) return kRegistered + raw;
  return (is_named ? 20 : 10) + raw;
}

std::string list_of(const std::vector<const RecordedImages*>& images) {
  std::string list;
  for (const RecordedImages* one : images) list += (list.empty() ? "" : ", ") + one->topic.name;
  return list;
}

std::string all_images(const RecordingContents& contents) {
  std::vector<const RecordedImages*> all;
  for (const RecordedImages& images : contents.images) all.push_back(&images);
  return all.empty() ? "it has no images at all" : "it has images of " + list_of(all);
}

const RecordedImages& images_of(const RecordingContents& contents, const std::string& name,
                                const std::string& file, const char* option) {
  for (const RecordedImages& images : contents.images)
    if (images.topic.name == name) return images;
  throw InputError(file + ": " + option + " " + name + ": no such topic of images; " + all_images(contents));
}

const RecordedImages& best(const RecordingContents& contents,
                           const std::function<int(const RecordedImages&)>& score, const std::string& file,
                           const char* kind, const std::string& option) {
  std::vector<const RecordedImages*> found;
  int highest = 1;
  for (const RecordedImages& images : contents.images) {
    const int now = images.stamps.empty() ? 0 : score(images);
    if (now > highest) found.clear();
    if (now >= highest) found.push_back(&images);
    highest = std::max(highest, now);
  }
  if (found.size() == 1) return *found.front();
  if (!found.empty())
    throw InputError(file + ": has " + std::to_string(found.size()) + " topics of " + kind +
                     " images; choose one with " + option + ": " + list_of(found));
  const auto broken = std::find_if(contents.images.begin(), contents.images.end(),
                                   [](const auto& images) { return !images.faults.empty(); });
  const auto unknown = std::find_if(contents.images.begin(), contents.images.end(), [](const auto& images) {
    return images.kind == PixelKind::kUnknown && !images.stamps.empty();
  });
  std::string why;
  if (unknown != contents.images.end())
    why =
        "; " + unknown->topic.name + " has the encoding '" + unknown->encoding + "', which is not supported";
  else if (broken != contents.images.end())
    why = "; " + broken->topic.name + ": " + broken->faults.begin()->first;
  throw InputError(file + ": has no " + kind + " images that can be used (" + all_images(contents) + why +
                   ")");
}

Camera camera_of(const RecordedImages& images, const std::string& file, const char* option) {
  if (!images.info)
    throw InputError(file + ": has no camera_info of " + images.topic.name + "; give its calibration with " +
                     option);
  try {
    return camera_of(*images.info, is_rectified(images));
  } catch (const CalibrationError& error) {
    throw CalibrationError(file + ": camera_info of " + images.topic.name + ": " + error.what() + "; give " +
                           option);
  }
}

bool is_same(const Camera& a, const Camera& b) {
  constexpr double kPixels = 0.5;
  return a.width == b.width && a.height == b.height && std::abs(a.fx - b.fx) < kPixels &&
         std::abs(a.fy - b.fy) < kPixels && std::abs(a.cx - b.cx) < kPixels &&
         std::abs(a.cy - b.cy) < kPixels && a.model == b.model && a.distortion == b.distortion;
}

// Whether depth is in the image of colour, by the calibrations that the recording has: the user may have a
// better one of colour.
void register_depth(RecordingStreams& streams, const RecordingContents& contents, const std::string& file) {
  const RecordedImages& depth = streams.depth;
  const bool says_so = score_as_depth(depth) >= kRegistered;
  const cv::Size size(streams.camera.width, streams.camera.height);
  streams.depth_camera = streams.camera;
  if (!depth.info) {
    if (!depth.size.empty() && depth.size != size)
      throw InputError(
          file + ": depth images of " + depth.topic.name +
          " are of another size than colour, and the file has no camera_info of them; record it, "
          "or depth that is registered to colour (aligned_depth_to_color)");
    if (!says_so) ++streams.notes[depth.topic.name + " has no camera_info; taken as registered to colour"];
    return;
  }
  const Camera depth_camera = camera_of(depth, file, "another --depth");
  const bool is_one_frame = depth.frame == streams.colour.frame || depth.frame.empty();
  if (says_so && cv::Size(depth_camera.width, depth_camera.height) == size) return;
  const Camera colour = streams.colour.info ? camera_of(streams.colour, file, "--camera") : streams.camera;
  if (is_one_frame && is_same(depth_camera, colour)) return;
  streams.depth_camera = depth_camera;
  streams.T_colour_depth = contents.frames.transform(streams.colour.frame, depth.frame);
  if (!streams.T_colour_depth)
    throw InputError(file + ": depth images of " + depth.topic.name + " are of another camera (frame '" +
                     depth.frame + "') than colour (frame '" + streams.colour.frame +
                     "'), and the file does not say how the two are placed; record /tf_static with them, or "
                     "depth that is registered to colour (aligned_depth_to_color)");
}

void choose_inertial(RecordingStreams& streams, const RecordingContents& contents,
                     const RecordingChoice& choice, const std::string& file) {
  std::vector<RecordedTopic> both, accelerometers, gyroscopes;
  for (const RecordedTopic& topic : contents.inertial) {
    if (topic.name == choice.inertial) both = {topic};
    if (!choice.inertial.empty()) continue;
    (has_any(topic.name, {"accel"})  ? accelerometers
     : has_any(topic.name, {"gyro"}) ? gyroscopes
                                     : both)
        .push_back(topic);
  }
  if (!choice.inertial.empty() && both.empty())
    throw InputError(file + ": --imu " + choice.inertial +
                     ": no such topic of inertial samples (sensor_msgs/Imu)");
  if (both.size() == 1) {
    streams.inertial = both;
  } else if (both.empty() && accelerometers.size() == 1 && gyroscopes.size() == 1) {
    streams.inertial = {accelerometers.front(), gyroscopes.front()};
  } else if (!contents.inertial.empty()) {
    ++streams.notes[contents.inertial.size() > 1
                        ? "several topics of inertial samples, of which none is used; choose one with --imu"
                        : "inertial samples without a gyroscope or an accelerometer are not used"];
  }
  if (streams.inertial.empty() || streams.camera.imu) return;
  const auto frame = contents.inertial_frames.find(streams.inertial.back().id);
  const auto T_camera_imu = frame == contents.inertial_frames.end()
                                ? std::nullopt
                                : contents.frames.transform(streams.colour.frame, frame->second);
  if (T_camera_imu) {
    streams.camera.imu = ImuCalibration{};
    streams.camera.imu->T_camera_imu = *T_camera_imu;
    return;
  }
  streams.inertial.clear();
  ++streams.notes
        ["inertial samples are not used, as the file does not say where the unit is; give imu in --camera"];
}

// tf has the poses of many frames, and is taken only where it is asked for.
void choose_truth(RecordingStreams& streams, const RecordingContents& contents, const RecordingChoice& choice,
                  const std::string& file) {
  const std::size_t colon = choice.truth.find(':');
  const std::string name = choice.truth.substr(0, colon);
  if (colon != std::string::npos) streams.truth_child = choice.truth.substr(colon + 1);
  std::vector<RecordedTopic> topics = contents.poses;
  if (!streams.truth_child.empty())
    topics.insert(topics.end(), contents.transforms.begin(), contents.transforms.end());
  for (const RecordedTopic& topic : topics) {
    const bool is_it =
        name.empty() ? has_any(topic.name, {"ground_truth", "groundtruth", "vicon", "mocap", "optitrack"})
                     : topic.name == name;
    if (!is_it) continue;
    if (streams.truth) {
      ++streams.notes["several topics of ground truth, of which none is used; choose one with --truth"];
      streams.truth.reset();
      return;
    }
    streams.truth = topic;
  }
  if (!name.empty() && !streams.truth)
    throw InputError(file + ": --truth " + name + ": no such topic of poses; of tf, give TOPIC:CHILD_FRAME");
}
}  // namespace

RecordingStreams choose_streams(const RecordingContents& contents, const RecordingChoice& choice,
                                const std::optional<Camera>& camera, const std::string& file) {
  RecordingStreams streams;
  streams.colour = choice.colour.empty() ? best(contents, score_as_colour, file, "colour", "--colour")
                                         : images_of(contents, choice.colour, file, "--colour");
  streams.depth = choice.depth.empty() ? best(contents, score_as_depth, file, "depth", "--depth")
                                       : images_of(contents, choice.depth, file, "--depth");
  if (!streams.colour.clock.empty() && !streams.depth.clock.empty() &&
      streams.colour.clock != streams.depth.clock)
    throw InputError(file + ": colour images are stamped by the clock '" + streams.colour.clock +
                     "' and depth images by '" + streams.depth.clock +
                     "', so that they cannot be paired; record both with global time enabled");
  streams.frames = contents.frames;
  streams.notes = contents.faults;
  const bool has_file = contents.camera && contents.camera->width == streams.colour.size.width &&
                        contents.camera->height == streams.colour.size.height;
  streams.camera = camera     ? *camera
                   : has_file ? *contents.camera
                              : camera_of(streams.colour, file, "--camera");
  if (!camera && !has_file && streams.colour.rate() > 0.0) streams.camera.fps = streams.colour.rate();
  if (!(streams.camera.depth_units_per_metre > 0.0) && !streams.depth.encoding.starts_with("32FC1")) {
    constexpr double kMillimetres = 1000.0;  // as ROS defines 16UC1
    streams.camera.depth_units_per_metre = streams.depth.units_per_metre.value_or(kMillimetres);
  }
  streams.camera.validate();
  register_depth(streams, contents, file);
  choose_inertial(streams, contents, choice, file);
  choose_truth(streams, contents, choice, file);
  return streams;
}

}  // namespace roslam
