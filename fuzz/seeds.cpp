// SPDX-License-Identifier: BSD-3-Clause
// fuzz_seeds DIR: writes a small valid file for each parser to DIR/PARSER/seed.
#include <cstdio>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/camera_export.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/occupancy/occupancy_map.hpp"
#include "roslam/options/options.hpp"
#include "telemetry/mavlink/mavlink_frame.hpp"
#include "tests/onnx_writer.hpp"
#include "tests/recording_writers.hpp"
#include "tests/ros_writer.hpp"
#include "tests/rvl_writer.hpp"

namespace {
using namespace roslam;

std::vector<Descriptor> random_descriptors(std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<Descriptor> result(count);
  for (auto& descriptor : result) descriptor = {random(), random(), random(), random()};
  return result;
}

// Two keyframes that see the same four points.
SavedMap small_map() {
  const Camera camera;
  Map map({1.0F, 1.2F});
  for (int k = 0; k < 2; ++k) {
    auto view = std::make_shared<ObservedFrame>();
    view->descriptors = random_descriptors(4);
    for (int i = 0; i < 4; ++i) {
      view->pixels.emplace_back(100.0F + 50.0F * static_cast<float>(i), 200.0F);
      view->depths.push_back(2.0F);
      view->levels.push_back(static_cast<std::uint8_t>(i % 2));
      view->angles.push_back(10.0F);
      view->colours.emplace_back(1, 2, 3);
    }
    view->grid = FeatureGrid(view->pixels, camera.undistorted_bounds());
    map.add_keyframe(static_cast<std::size_t>(k), 0.1 * k, SE3(), view);
  }
  for (std::uint32_t i = 0; i < 4; ++i) {
    const LandmarkId id = map.add_landmark({0.1 * i, 0.0, 2.0}, KeyframeId{0}, i);
    map.add_observation(id, KeyframeId{1}, i);
  }
  map.add_loop(KeyframeId{0}, KeyframeId{1}, SE3());
  SavedMap saved = SavedMap::of(camera, map, nullptr);
  saved.vocabulary = 1;
  saved.words = {{{1, 0.5F}, {7, 0.5F}}, {}};
  return saved;
}

SurfaceMap small_surface() {
  SurfaceMap surface;
  surface.spacing = 0.05;
  for (int i = 0; i < 4; ++i)
    surface.points.push_back({{0.1F * static_cast<float>(i), 0.0F, 1.0F}, {0.0F, 0.0F, 1.0F}, {1, 2, 3}});
  surface.triangles = {{0, 1, 2}, {1, 3, 2}};
  return surface;
}

std::string small_network() {
  const auto ones = [](int count) { return std::vector<float>(static_cast<std::size_t>(count), 1.0F); };
  OnnxWriter writer;
  writer.array("w3", {4, 3, 3, 3}, ones(108))
      .array("d", {4, 1, 3, 3}, ones(36))
      .array("w1", {4, 4, 1, 1}, ones(16))
      .array("b", {4}, ones(4))
      .array("scales", {4}, {1, 1, 2, 2})
      .array("roi", {0}, {})
      .array("w2", {2, 8, 1, 1}, ones(16))
      .array("t", {2, 3, 2, 2}, ones(24))
      .node("Conv", {"in", "w3", "b"}, "a", {{"pads", {1, 1, 1, 1}}, {"strides", {2, 2}}})
      .node("Relu", {"a"}, "r")
      .node("Conv", {"r", "d"}, "e", {{"pads", {1, 1, 1, 1}}, {"group", {4}}})
      .node("Conv", {"e", "w1", "b"}, "f")
      .node("Add", {"r", "f"}, "g")
      .node("AveragePool", {"g"}, "h", {{"kernel_shape", {2, 2}}, {"strides", {2, 2}}})
      .node("Resize", {"h", "roi", "scales"}, "i", {}, "mode", "linear")
      .node("GlobalAveragePool", {"g"}, "j")
      .node("Add", {"g", "j"}, "k")
      .node("Concat", {"i", "k"}, "l", {{"axis", {1}}})
      .node("Conv", {"l", "w2"}, "m")
      .node("Sigmoid", {"m"}, "n")
      .node("ConvTranspose", {"n", "t"}, "out", {{"kernel_shape", {2, 2}}, {"strides", {2, 2}}});
  return writer.file("in", 3, "out");
}
// Two topics, several chunks, messages of either.
void write_recording(RecordingWriter& writer) {
  const int image = writer.add_topic("/image", "sensor_msgs/Image", "uint8[] data");
  const int imu = writer.add_topic("/imu", "sensor_msgs/Imu", "");
  for (int i = 0; i < 12; ++i) {
    const std::vector<std::uint8_t> data(static_cast<std::size_t>(10 + 7 * i), static_cast<std::uint8_t>(i));
    writer.write(i % 3 == 0 ? image : imu, 1'000'000'000 + (i ^ 3) * 1000, data);
  }
}

// One of each kind. Those that are not closed have no index.
void write_recordings(const std::filesystem::path& folder) {
  for (const char* parser : {"ros_bag", "mcap", "sqlite"}) make_folder(folder / parser);
  for (const std::string method : {"none", "lz4", "bz2"}) {
    BagWriter closed(folder / "ros_bag" / method, {method, 300});
    write_recording(closed);
    closed.close();
    BagWriter cut(folder / "ros_bag" / (method + "_cut"), {method, 300});
    write_recording(cut);
  }
  for (const std::string method : {"none", "lz4", "zstd", "unchunked"}) {
    TestMcapOptions options(method);
    options.chunk_bytes = 300;
    options.has_chunks = method != "unchunked";
    options.has_crcs = false;  // else a damaged chunk is never looked into
    TestMcapWriter closed(folder / "mcap" / method, options);
    write_recording(closed);
    closed.close();
    TestMcapWriter cut(folder / "mcap" / (method + "_cut"), options);
    write_recording(cut);
  }
  for (const bool compresses : {false, true}) {
    Db3Writer writer(folder / "sqlite" / (compresses ? "zstd" : "plain"),
                     {compresses, compresses, compresses});
    write_recording(writer);
    writer.close();
  }
}

// One of each type, in both encodings; the first byte chooses (fuzz/ros_message.cpp).
void put_messages(const std::filesystem::path& folder) {
  make_folder(folder);
  const auto put = [&](int choice, const ros::Bytes& message) {
    std::string bytes(1, static_cast<char>(choice));
    bytes.append(message.begin(), message.end());
    write_file(folder / std::to_string(choice), bytes);
  };
  for (const ros::Version version : {ros::Version::kRos1, ros::Version::kRos2}) {
    const int odd = version == ros::Version::kRos2 ? 1 : 0;
    put(0 + odd, ros::tf(version, 1000, {{"a", "b", SE3()}, {"b", "c", SE3()}}));
    put(2 + odd, ros::odometry(version, 1000, "a", "b", SE3()));
    put(4 + odd, ros::pose_stamped(version, 1000, "a", SE3()));
    put(8 + odd, ros::camera_info(version, 1000, "a", Camera{}));
    put(10 + odd, ros::imu(version, 1000, "a", {0, 0, 1}, {0, 0, 9.8}));
    put(12 + odd, ros::image(version, 1000, "a", "16UC1", cv::Mat(8, 8, CV_16UC1, cv::Scalar(1000))));
    put(14 + odd, ros::compressed_image(version, 1000, "a", "16UC1; compressedDepth png", ros::Bytes(40, 1)));
    ros::Bytes rvl(12, 0);
    const ros::Bytes stream = ros::RvlWriter::encode(cv::Mat(8, 8, CV_16UC1, cv::Scalar(1000)));
    rvl.insert(rvl.end(), stream.begin(), stream.end());
    put(30 + odd, ros::compressed_image(version, 1000, "a", "16UC1; compressedDepth rvl", rvl));
  }
}

// Camera files of other programs.
void put_cameras(const std::filesystem::path& folder) {
  Camera camera = *camera_preset("tum-fr3");
  camera.imu = ImuCalibration{};
  write_file(folder / "kalibr", camera_to_kalibr(camera));
  write_file(folder / "ros", camera_to_ros(camera));
  write_file(folder / "opencv", camera_to_opencv(camera));
  write_file(
      folder / "xml",
      "<?xml version=\"1.0\"?>\n<opencv_storage><image_width>640</image_width>"
      "<image_height>480</image_height><camera_matrix type_id=\"opencv-matrix\"><data>\n500 0 320 0 500 240 "
      "0 0 1</data></camera_matrix><d><_>0.1</_><_>0</_></d></opencv_storage>\n");
  write_file(folder / "asl",
             "sensor_type: camera\nT_BS: {data: [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}\nrate_hz: 20\n"
             "resolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [500, 500, 320, 240]\n"
             "distortion_model: equidistant\ndistortion_coefficients: [0.1, 0, 0, 0]\n");
  write_file(folder / "orb_slam",
             "%YAML:1.0\nCamera.fx: 500\nCamera.fy: 500\nCamera.cx: 320\nCamera.cy: 240\nCamera.k1: 0.1\n"
             "Camera.width: 640\nCamera.height: 480\nDepthMapFactor: 5000\n");
}

// One message of each kind, after the byte that says how the stream is cut.
void put_mavlink(const std::filesystem::path& folder) {
  using namespace telemetry;
  make_folder(folder);
  std::string all(1, '\x20');
  for (const MavlinkMessage& message :
       {MavlinkMessage(HeartbeatMessage{}), MavlinkMessage(TimesyncMessage{0, 5, 1, 197}),
        MavlinkMessage(OdometryMessage{}), MavlinkMessage(StatusTextMessage(MavlinkSeverity::kInfo, "text")),
        MavlinkMessage(GpsOriginMessage{1, 2, 3, 1, 4})}) {
    const auto frame = encode(message, {}, 0);
    all.append(frame.begin(), frame.end());
  }
  write_file(folder / "all", all);
}
}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds DIR\n");
    return 2;
  }
  const std::filesystem::path folder = arguments[1];
  const auto put = [&](const char* parser, std::string_view bytes) {
    make_folder(folder / parser);
    write_file(folder / parser / "seed", bytes);
  };
  try {
    put("camera", camera_to_yaml(*camera_preset("tum-fr1")));
    put_cameras(folder / "camera");
    put("options", options_to_yaml({}));
    put("trajectory", "# time x y z\n1.5 0 0 1 0 0 0 1\n2.5 0 1 1 0 0 0.6 0.8\n");
    put("tum_list", "# time file\n1.5 rgb/1.5.png\n2.5 rgb/2.5.png\n");
    const std::vector<std::vector<Descriptor>> images{random_descriptors(60)};
    put("vocabulary", Vocabulary::train(images, {.branching = 3, .depth = 3}).content());
    put("map", encode_map(small_map()));
    put("network", small_network());
    put("surface_ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 1e0\n3 0 1 2\n");
    write_surface_ply(folder / "surface_ply" / "binary", small_surface(), true);
    OccupancyMap occupancy(0.1);
    occupancy.add_surface(small_surface());
    make_folder(folder / "occupancy");
    occupancy.write(folder / "occupancy" / "states.bt");
    occupancy.write(folder / "occupancy" / "probabilities.ot");
    write_recordings(folder);
    put_messages(folder / "ros_message");
    put_mavlink(folder / "mavlink");
  } catch (const Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
  return 0;
}
