// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map_io/map_file.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "roslam/common/binary.hpp"
#include "roslam/common/error.hpp"

namespace roslam {

namespace {
// Version 2 has the measurement noise at the end, version 3 the lens after it. A map is written in the lowest
// version that holds it, so that earlier programs read it.
constexpr std::uint32_t kWithoutNoise = 1, kWithNoise = 2, kWithLens = 3, kWithStereo = 4;
constexpr std::size_t kFirstCoefficients = 5;  // of the lens, in every version

constexpr BinaryFormat format(std::uint32_t version) {
  return {"ROSLAMMP", version, "a map", 2047ULL * 1024 * 1024, kWithoutNoise};
}
constexpr std::size_t kPointBytes = 8 + 4 + 1 + 4 + 3 + sizeof(Descriptor) + 1;
constexpr std::size_t kWordBytes = 4 + 4;
constexpr std::size_t kObservationBytes = 4 + 4;
constexpr std::size_t kPoseBytes = 7 * 8;
constexpr std::size_t kKeyframeBytes = 8 + 8 + kPoseBytes + 4 + 4 + 4 + 4;
constexpr std::size_t kLandmarkBytes = 2 * 24 + sizeof(Descriptor) + 2 * 4 + 4 + 3 * 4 + 3 + 4;
constexpr std::size_t kLoopBytes = 4 + 4 + kPoseBytes;
constexpr double kMaxNoise = 1e6;  // pixels, metres, 1/metre

void put(BinaryWriter& writer, const Descriptor& descriptor) {
  for (const std::uint64_t part : descriptor) writer.put(part);
}

void put(BinaryWriter& writer, const cv::Vec3b& colour) {
  for (int c = 0; c < 3; ++c) writer.put(colour[c]);
}

void put(BinaryWriter& writer, const Eigen::Vector3d& vector) {
  for (const double value : vector) writer.put(value);
}

void put(BinaryWriter& writer, const SE3& motion) {
  for (const double value : motion.rotation().coeffs()) writer.put(value);
  put(writer, motion.translation());
}

void put(BinaryWriter& writer, const Camera& camera) {
  writer.put(static_cast<std::int32_t>(camera.width));
  writer.put(static_cast<std::int32_t>(camera.height));
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy}) writer.put(value);
  for (std::size_t i = 0; i < kFirstCoefficients; ++i) writer.put(camera.distortion[i]);
  writer.put(camera.depth_units_per_metre);
  writer.put(camera.fps);
}

void put(BinaryWriter& writer, const ObservedFrame& view) {
  writer.put(static_cast<std::uint32_t>(view.size()));
  for (std::size_t i = 0; i < view.size(); ++i) {
    writer.put(view.pixels[i].x());
    writer.put(view.pixels[i].y());
    writer.put(view.depths[i]);
    writer.put(view.levels[i]);
    writer.put(view.angles[i]);
    put(writer, view.colours[i]);
    put(writer, view.descriptors[i]);
    writer.put(static_cast<std::uint8_t>(view.may_move(i) ? 1 : 0));
  }
}

void put(BinaryWriter& writer, const Keyframe& keyframe, const BagOfWords& words) {
  writer.put(static_cast<std::uint64_t>(keyframe.frame_index));
  writer.put(keyframe.timestamp);
  put(writer, keyframe.T_camera_world);
  writer.put(keyframe.submap.value);
  writer.put(keyframe.session);
  put(writer, *keyframe.view);
  writer.put(static_cast<std::uint32_t>(words.size()));
  for (const auto& [word, weight] : words) {
    writer.put(word);
    writer.put(weight);
  }
}

void put(BinaryWriter& writer, const Landmark& landmark) {
  put(writer, landmark.position);
  put(writer, landmark.normal);
  put(writer, landmark.descriptor);
  writer.put(landmark.min_distance);
  writer.put(landmark.max_distance);
  writer.put(landmark.created_by.value);
  writer.put(landmark.times_visible);
  writer.put(landmark.times_found);
  writer.put(landmark.contradicted);
  put(writer, landmark.colour);
  writer.put(static_cast<std::uint32_t>(landmark.observations.size()));
  for (const auto& [keyframe, point] : landmark.observations) {
    writer.put(keyframe.value);
    writer.put(point);
  }
}

void put(BinaryWriter& writer, const std::optional<DepthNoise>& noise) {
  writer.put(noise ? noise->constant : 0.0);
  writer.put(noise ? noise->growth : 0.0);
}

template <typename Has>
bool any_view(const SavedMap& saved, const Has& has) {
  const auto ids = saved.map.keyframe_ids();
  return std::any_of(ids.begin(), ids.end(), [&](KeyframeId id) { return has(*saved.map.find(id)->view); });
}

bool has_noise(const SavedMap& saved) {
  return saved.camera.depth_noise || any_view(saved, [](const ObservedFrame& view) {
           return view.pixel_sigma.has_value() || view.depth_noise.has_value();
         });
}

bool has_stereo(const SavedMap& saved) {
  return saved.camera.is_stereo() ||
         any_view(saved, [](const ObservedFrame& view) { return !view.inverse_depth_sigmas.empty(); });
}

void put_noise(BinaryWriter& writer, const SavedMap& saved) {
  put(writer, saved.camera.depth_noise);
  for (const KeyframeId id : saved.map.keyframe_ids()) {
    const ObservedFrame& view = *saved.map.find(id)->view;
    writer.put(view.pixel_sigma.value_or(0.0));
    put(writer, view.depth_noise);
  }
}

std::uint32_t version_of(const SavedMap& saved) {
  const Camera& camera = saved.camera;
  if (has_stereo(saved)) return kWithStereo;
  if (camera.model != LensModel::kPinhole || camera.coefficients().size() > kFirstCoefficients)
    return kWithLens;
  return has_noise(saved) ? kWithNoise : kWithoutNoise;
}

void put_lens(BinaryWriter& writer, const Camera& camera) {
  writer.put(static_cast<std::uint32_t>(camera.model));
  for (std::size_t i = kFirstCoefficients; i < camera.distortion.size(); ++i)
    writer.put(camera.distortion[i]);
}

void put_stereo(BinaryWriter& writer, const SavedMap& saved) {
  writer.put(saved.camera.baseline);
  for (const KeyframeId id : saved.map.keyframe_ids()) {
    const ObservedFrame& view = *saved.map.find(id)->view;
    for (std::size_t i = 0; i < view.size(); ++i) writer.put(view.inverse_depth_sigma(i));
  }
}

// Decodes a map and validates every value, so that any file gives a valid map or an error.
class Decoder {
 public:
  Decoder(std::string_view content, const std::string& name) : in_(content, name) {}

  SavedMap decode() {
    SavedMap saved;
    saved.name = in_.name();
    saved.camera = get_camera();
    saved.map = Map(get_scales());
    levels_ = saved.map.scales().size();
    saved.vocabulary = in_.get<std::uint64_t>();
    const std::size_t keyframes = in_.get_count(kKeyframeBytes);
    std::vector<std::shared_ptr<ObservedFrame>> views;
    for (std::size_t i = 0; i < keyframes; ++i) {
      Keyframe keyframe = get_keyframe();
      views.push_back(get_observed_frame());
      keyframe.view = views.back();
      saved.map.insert(std::move(keyframe));
      saved.words.push_back(get_words());
    }
    const std::size_t landmarks = in_.get_count(kLandmarkBytes);
    for (std::size_t i = 0; i < landmarks; ++i) saved.map.insert(get_landmark(saved.map));
    const std::size_t loops = in_.get_count(kLoopBytes);
    for (std::size_t i = 0; i < loops; ++i) {
      const KeyframeId from = get_keyframe_id(saved.map);
      const KeyframeId to = get_keyframe_id(saved.map);
      require(from != to && saved.map.find(from)->submap == saved.map.find(to)->submap,
              "it has a loop within one keyframe or between submaps");
      saved.map.add_loop(from, to, get_motion());
    }
    if (in_.left() > 0) get_noise(saved.camera, views);
    if (in_.left() > 0) get_lens(saved.camera);
    if (in_.left() > 0) get_stereo(saved.camera, views);
    require(in_.left() == 0, "it has data after its end");
    require_valid(saved.camera);
    const std::array<double, 4> bounds = saved.camera.undistorted_bounds();
    for (const auto& view : views) view->grid = FeatureGrid(view->pixels, bounds);
    return saved;
  }

 private:
  void require(bool condition, const char* otherwise) const {
    if (!condition) in_.fail(otherwise);
  }

  template <typename T>
  T get_finite() {
    const T value = in_.get<T>();
    require(std::isfinite(value), "it contains a number that is not finite");
    return value;
  }

  Eigen::Vector3d get_vector() {
    Eigen::Vector3d vector;
    for (double& value : vector) value = get_finite<double>();
    require(vector.cwiseAbs().maxCoeff() < 1e7, "it contains a position out of range");
    return vector;
  }

  SE3 get_motion() {
    Eigen::Quaterniond rotation;
    for (double& value : rotation.coeffs()) value = get_finite<double>();
    require(std::abs(rotation.squaredNorm() - 1.0) < 1e-9, "it contains a quaternion not of unit length");
    return SE3::from_parts(rotation, get_vector());
  }

  Descriptor get_descriptor() {
    Descriptor descriptor;
    for (std::uint64_t& part : descriptor) part = in_.get<std::uint64_t>();
    return descriptor;
  }

  cv::Vec3b get_colour() {
    cv::Vec3b colour;
    for (int c = 0; c < 3; ++c) colour[c] = in_.get<std::uint8_t>();
    return colour;
  }

  Camera get_camera() {
    Camera camera;
    camera.width = in_.get<std::int32_t>();
    camera.height = in_.get<std::int32_t>();
    for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value = in_.get<double>();
    for (std::size_t i = 0; i < kFirstCoefficients; ++i) camera.distortion[i] = get_finite<double>();
    camera.depth_units_per_metre = in_.get<double>();
    camera.fps = in_.get<double>();
    return camera;
  }

  std::vector<float> get_scales() {
    std::vector<float> scales(in_.get_count(sizeof(float)));
    require(!scales.empty() && scales.size() <= 64, "it has an invalid number of pyramid levels");
    float last = 0.0F;
    for (float& scale : scales) {
      scale = get_finite<float>();
      require(scale > 1.01F * last && scale < 1e6F, "its pyramid scales are not ascending");
      last = scale;
    }
    return scales;
  }

  std::optional<DepthNoise> get_depth_noise() {
    const DepthNoise noise{get_sigma(), get_sigma()};
    if (noise.constant > 0.0 || noise.growth > 0.0) return noise;
    return std::nullopt;
  }

  double get_sigma() {
    const auto sigma = get_finite<double>();
    require(sigma >= 0.0 && sigma < kMaxNoise, "it contains a noise out of range");
    return sigma;
  }

  void get_noise(Camera& camera, const std::vector<std::shared_ptr<ObservedFrame>>& views) {
    camera.depth_noise = get_depth_noise();
    for (const auto& view : views) {
      if (const double sigma = get_sigma(); sigma > 0.0) view->pixel_sigma = sigma;
      view->depth_noise = get_depth_noise();
    }
  }

  void get_lens(Camera& camera) {
    const auto model = in_.get<std::uint32_t>();
    require(model <= static_cast<std::uint32_t>(LensModel::kFisheye), "its camera has an unknown lens model");
    camera.model = static_cast<LensModel>(model);
    for (std::size_t i = kFirstCoefficients; i < camera.distortion.size(); ++i)
      camera.distortion[i] = get_finite<double>();
  }

  void get_stereo(Camera& camera, const std::vector<std::shared_ptr<ObservedFrame>>& views) {
    constexpr float kLeast = 1e-9F;
    camera.baseline = get_finite<double>();
    for (const auto& view : views) {
      for (std::size_t i = 0; i < view->size(); ++i) {
        const auto sigma = get_finite<float>();
        require(sigma == 0.0F || (sigma > kLeast && sigma < kMaxNoise), "it contains a noise out of range");
        view->inverse_depth_sigmas.push_back(sigma);
      }
    }
  }

  void require_valid(const Camera& camera) const {
    try {
      camera.validate();
    } catch (const CalibrationError& error) {
      in_.fail(std::string("its camera is invalid (") + error.what() + ")");
    }
  }

  std::shared_ptr<ObservedFrame> get_observed_frame() {
    const auto view = std::make_shared<ObservedFrame>();
    const std::size_t points = in_.get_count(kPointBytes);
    require(points > 0, "it has a keyframe without points");
    bool has_movable = false;
    for (std::size_t i = 0; i < points; ++i) {
      const auto x = get_finite<float>();
      view->pixels.emplace_back(x, get_finite<float>());
      require(view->pixels.back().cwiseAbs().maxCoeff() < 1e6F, "it contains a point far outside its image");
      view->depths.push_back(get_finite<float>());
      require(view->depths.back() >= 0.0F, "it contains a negative depth");
      view->levels.push_back(in_.get<std::uint8_t>());
      require(view->levels.back() < levels_, "it contains a point of a missing pyramid level");
      view->angles.push_back(get_finite<float>());
      view->colours.push_back(get_colour());
      view->descriptors.push_back(get_descriptor());
      view->is_movable.push_back(in_.get<std::uint8_t>() != 0);
      has_movable = has_movable || view->is_movable.back();
    }
    if (!has_movable) view->is_movable.clear();
    return view;
  }

  Keyframe get_keyframe() {
    Keyframe keyframe;
    keyframe.frame_index = static_cast<std::size_t>(in_.get<std::uint64_t>());
    keyframe.timestamp = get_finite<double>();
    keyframe.T_camera_world = get_motion();
    keyframe.submap = SubmapId{in_.get<std::uint32_t>()};
    keyframe.session = in_.get<std::uint32_t>();
    constexpr std::uint32_t kMany = 1U << 24U;
    require(keyframe.submap.value < kMany && keyframe.session < kMany, "it has too many submaps or sessions");
    return keyframe;
  }

  BagOfWords get_words() {
    BagOfWords words(in_.get_count(kWordBytes));
    for (std::size_t i = 0; i < words.size(); ++i) {
      words[i].first = in_.get<std::uint32_t>();
      words[i].second = get_finite<float>();
      require(i == 0 || words[i].first > words[i - 1].first, "its words are out of order");
      require(words[i].second > 0.0F && words[i].second <= 1.001F, "it has a word with an invalid weight");
    }
    return words;
  }

  KeyframeId get_keyframe_id(const Map& map) {
    const KeyframeId id{in_.get<std::uint32_t>()};
    require(map.find(id) != nullptr, "it refers to a missing keyframe");
    return id;
  }

  Landmark get_landmark(const Map& map) {
    Landmark landmark;
    landmark.position = get_vector();
    landmark.normal = get_vector();
    landmark.descriptor = get_descriptor();
    landmark.min_distance = get_finite<float>();
    landmark.max_distance = get_finite<float>();
    require(landmark.min_distance >= 0.0F && landmark.max_distance >= landmark.min_distance,
            "it has a landmark with invalid distance limits");
    landmark.created_by = get_keyframe_id(map);
    landmark.times_visible = in_.get<std::uint32_t>();
    landmark.times_found = in_.get<std::uint32_t>();
    landmark.contradicted = in_.get<std::uint32_t>();
    landmark.colour = get_colour();
    landmark.observations.resize(in_.get_count(kObservationBytes));
    require(!landmark.observations.empty(), "it has a landmark without observations");
    for (auto& observation : landmark.observations) {
      observation = {get_keyframe_id(map), in_.get<std::uint32_t>()};
      const auto& seen = map.find(observation.keyframe)->landmarks;
      require(map.submap_of(observation.keyframe) == map.submap_of(landmark),
              "it has a landmark in two submaps");
      require(observation.point < seen.size(), "it refers to a missing point");
      require(!seen[observation.point].is_valid(), "it has a point that observes two landmarks");
      require(
          &observation == landmark.observations.data() || (&observation - 1)->keyframe < observation.keyframe,
          "its observations are out of order");
    }
    return landmark;
  }

  BinaryReader in_;
  std::size_t levels_ = 0;
};
}  // namespace

std::string encode_map(const SavedMap& saved) {
  BinaryWriter writer;
  put(writer, saved.camera);
  const auto scales = saved.map.scales();
  writer.put(static_cast<std::uint32_t>(scales.size()));
  for (const float scale : scales) writer.put(scale);
  writer.put(saved.vocabulary);
  const auto keyframes = saved.map.keyframe_ids();
  writer.put(static_cast<std::uint32_t>(keyframes.size()));
  for (const KeyframeId id : keyframes) {
    put(writer, *saved.map.find(id),
        id.index() < saved.words.size() ? saved.words[id.index()] : BagOfWords{});
  }
  const auto landmarks = saved.map.landmark_ids();
  writer.put(static_cast<std::uint32_t>(landmarks.size()));
  for (const LandmarkId id : landmarks) put(writer, *saved.map.find(id));
  const auto loops = saved.map.loops();
  writer.put(static_cast<std::uint32_t>(loops.size()));
  for (const auto& loop : loops) {
    writer.put(loop.from.value);
    writer.put(loop.to.value);
    put(writer, loop.T_to_from);
  }
  const std::uint32_t version = version_of(saved);
  if (version >= kWithNoise) put_noise(writer, saved);
  if (version >= kWithLens) put_lens(writer, saved.camera);
  if (version >= kWithStereo) put_stereo(writer, saved);
  return std::move(writer).bytes();
}

SavedMap decode_map(std::string_view content, const std::string& name) {
  return Decoder(content, name).decode();
}

void save_map(const std::filesystem::path& file, const SavedMap& saved) {
  write_binary(file, format(version_of(saved)), encode_map(saved));
}

SavedMap load_map(const std::filesystem::path& file) {
  return decode_map(read_binary(file, format(kWithStereo)), file.string());
}

}  // namespace roslam
