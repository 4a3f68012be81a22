// SPDX-License-Identifier: BSD-3-Clause
// roslam export: what is in the file, decoded by a reader of its own and compared with the files of the run.
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "recording/recorded_run.hpp"
#include "tests/exported_points.hpp"
#include "tests/exported_run.hpp"

namespace roslam {
namespace {

class ExportMcap : public ExportedRun {
 protected:
  static std::int64_t nanoseconds(double seconds) { return 1000 * std::llround(1e6 * seconds); }

  // odometry.csv by the names of its columns.
  static std::vector<std::map<std::string, double>> odometry_rows() {
    std::istringstream text(content(folder_ / "copy/odometry.csv"));
    const auto cells = [&](std::string line) {
      std::vector<std::string> row;
      std::istringstream in(line);
      for (std::string cell; std::getline(in, cell, ',');) row.push_back(cell);
      return row;
    };
    std::string line;
    std::getline(text, line);
    const auto names = cells(line.substr(1));
    std::vector<std::map<std::string, double>> rows;
    while (std::getline(text, line)) {
      const auto row = cells(line);
      rows.emplace_back();
      for (std::size_t i = 0; i < row.size(); ++i)
        if (names.at(i) != "state") rows.back()[names[i]] = std::stod(row[i]);
    }
    return rows;
  }

  static cv::Mat image_of(const Stamped& stamped) {
    CdrMessage message(stamped.data);
    EXPECT_EQ(message.stamp(), stamped.time);
    EXPECT_EQ(message.text(), "camera_optical_frame");
    EXPECT_EQ(message.text(), "jpeg");
    const auto size = message.get<std::uint32_t>();
    const std::string bytes = message.take(size);
    EXPECT_TRUE(message.is_at_end());
    return cv::imdecode(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), cv::IMREAD_UNCHANGED);
  }

  static double mean_difference(const cv::Mat& a, const cv::Mat& b, const cv::Mat& where) {
    cv::Mat difference;
    cv::absdiff(a, b, difference);
    const cv::Scalar mean = cv::mean(difference, where);
    return (mean[0] + mean[1] + mean[2]) / 3.0;
  }
};

TEST_F(ExportMcap, HasTheMessagesOfTheRunAndSaysSo) {
  fs::copy(folder_ / "data/groundtruth.txt", folder_ / "copy/groundtruth.txt");
  const Outcome outcome = exported("--json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const Topics topics = this->topics();
  const std::size_t poses = read_trajectory(folder_ / "copy/trajectory.txt").trajectory.size();
  ASSERT_GT(poses, kFrames / 2);
  const std::map<std::string, std::size_t> expected{{"/tf_static", 1},
                                                    {"/tf", poses},
                                                    {"/odometry", odometry_rows().size()},
                                                    {"/camera_pose", poses},
                                                    {"/path", 2},
                                                    {"/ground_truth/path", 1},
                                                    {"/map/landmarks", 1},
                                                    {"/map/dense", 1},
                                                    {"/camera/image/compressed", kFrames},
                                                    {"/camera/removed/compressed", kFrames},
                                                    {"/camera/camera_info", kFrames}};
  std::map<std::string, std::size_t> counts, reported;
  for (const auto& [name, messages] : topics) counts[name] = messages.size();
  EXPECT_EQ(counts, expected);
  const auto report = nlohmann::json::parse(outcome.out);
  for (const auto& topic : report.at("topics")) reported[topic.at("name")] = topic.at("messages");
  EXPECT_EQ(reported, expected);
  EXPECT_EQ(report.at("bytes"), fs::file_size(folder_ / "x.mcap"));
  EXPECT_TRUE(report.at("notes").empty()) << report.at("notes");
  EXPECT_EQ(report.at("start"), 0.0);
  EXPECT_NEAR(report.at("end").get<double>(), (kFrames - 1) / 30.0, 1e-5);
  const auto recording = open_recording(folder_ / "x.mcap");
  EXPECT_TRUE(recording->notes().empty());
  for (const RecordedTopic& topic : recording->topics()) {
    EXPECT_EQ(topic.encoding, "cdr");
    EXPECT_FALSE(topic.definition.empty()) << topic.name;
  }
  // Subscribers that come late have to receive what is there once. The index has no compression.
  const std::string bytes = content(folder_ / "x.mcap");
  std::size_t latched = 0;
  for (const char* name : {"/tf_static", "/path", "/ground_truth/path", "/map/landmarks", "/map/dense"}) {
    const std::size_t channel = bytes.rfind(std::string(name) + std::string("\x03\0\0\0cdr", 7));
    ASSERT_NE(channel, std::string::npos) << name;
    const std::string metadata = bytes.substr(channel, 200);
    if (metadata.find("offered_qos_profiles") != std::string::npos &&
        metadata.find("\n  durability: 1\n") != std::string::npos)
      ++latched;
  }
  EXPECT_EQ(latched, 5U);
}

TEST_F(ExportMcap, TransformsLeadToTheCamera) {
  const Topics topics = topics_with();
  const Trajectory trajectory = read_trajectory(folder_ / "copy/trajectory.txt").trajectory;
  const SE3 T_body_camera =
      transforms_of(topics.at("/tf_static").front()).at("base_link camera_optical_frame");
  EXPECT_LT(difference(T_body_camera, recording::camera_of_run(folder_ / "copy").T_body_camera), 1e-12);
  EXPECT_GT(T_body_camera.translation().norm(), 0.1);  // of --mount
  const auto& poses = topics.at("/camera_pose");
  const auto& transforms = topics.at("/tf");
  ASSERT_EQ(poses.size(), trajectory.size());
  ASSERT_EQ(transforms.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].time, nanoseconds(trajectory[i].timestamp));
    ASSERT_EQ(transforms[i].time, poses[i].time);
    CdrMessage message(poses[i].data);
    EXPECT_EQ(message.stamp(), poses[i].time);
    EXPECT_EQ(message.text(), "map");
    const SE3 T_map_camera = message.pose();
    EXPECT_TRUE(message.is_at_end());
    EXPECT_LT(difference(T_map_camera, trajectory[i].T_world_camera), 1e-9);
    const auto tree = transforms_of(transforms[i]);
    const SE3 chain = tree.at("map odom") * tree.at("odom base_link") * T_body_camera;
    EXPECT_LT(difference(chain, T_map_camera), 1e-9) << i;
  }
  const Trajectory path = path_of(topics.at("/path").back().data, "map");
  ASSERT_EQ(path.size(), trajectory.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_NEAR(path[i].timestamp, trajectory[i].timestamp, 1e-6);
    EXPECT_LT(difference(path[i].T_world_camera, trajectory[i].T_world_camera), 1e-9);
  }
}

TEST_F(ExportMcap, OdometryIsThatOfItsFile) {
  const Topics topics = topics_with();
  const auto rows = odometry_rows();
  const auto& messages = topics.at("/odometry");
  ASSERT_EQ(messages.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& row = rows[i];
    CdrMessage message(messages[i].data);
    EXPECT_EQ(message.stamp(), nanoseconds(row.at("timestamp")));
    EXPECT_EQ(message.text(), "odom");
    EXPECT_EQ(message.text(), "base_link");
    const SE3 pose = message.pose();
    EXPECT_LT(difference(pose, transforms_of(topics.at("/tf")[i]).at("odom base_link")), 1e-15);
    EXPECT_NEAR(pose.translation().y(), row.at("py"), 1e-12);
    EXPECT_NEAR(std::abs(pose.rotation().x()), std::abs(row.at("qx")), 1e-8);
    // As geometry_msgs has it: rows and columns are x, y, z, rotation about x, y, z.
    const auto expect_matrix = [&](const std::vector<std::string>& names) {
      const auto values = message.doubles(36);
      for (std::size_t r = 0; r < 6; ++r)
        for (std::size_t c = 0; c < 6; ++c) {
          const std::string name = "cov_" + names[std::min(r, c)] + "_" + names[std::max(r, c)];
          EXPECT_EQ(values[6 * r + c], row.at(name)) << name;
        }
    };
    expect_matrix({"px", "py", "pz", "rx", "ry", "rz"});
    for (const char* name : {"vx", "vy", "vz", "wx", "wy", "wz"})
      EXPECT_EQ(message.get<double>(), row.at(name)) << name;
    expect_matrix({"vx", "vy", "vz", "wx", "wy", "wz"});
    EXPECT_TRUE(message.is_at_end());
  }
  EXPECT_NE(rows.back().at("cov_px_rz"), rows.back().at("cov_py_rz"));
}

TEST_F(ExportMcap, PointsAreThoseOfTheMaps) {
  const Topics topics = topics_with();
  const auto landmarks = cloud_points(topics.at("/map/landmarks").front().data);
  EXPECT_GT(landmarks.size(), 100U);
  EXPECT_EQ(landmarks, ply_points(folder_ / "copy/map.ply"));
  EXPECT_EQ(cloud_points(topics.at("/map/dense").front().data), ply_points(folder_ / "copy/dense.ply"));
}

TEST_F(ExportMcap, ThinsMapsThatAreTooLargeAndSaysSo) {
  const Outcome outcome = exported("--max-points 100 --no-images");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  for (const char* words : {"note: copy/map.ply: 100 of its ", "note: copy/dense.ply: 100 of its "})
    EXPECT_NE(outcome.error.find(words), std::string::npos) << outcome.error;
  auto all = ply_points(folder_ / "copy/dense.ply");
  const auto points = cloud_points(topics().at("/map/dense").front().data);
  ASSERT_EQ(points.size(), 100U);
  EXPECT_EQ(points.front(), all.front());
  EXPECT_GT(std::find(all.begin(), all.end(), points.back()) - all.begin(),
            static_cast<long>(all.size() * 9 / 10));
  std::sort(all.begin(), all.end());
  for (const Point& point : points) EXPECT_TRUE(std::binary_search(all.begin(), all.end(), point));
}

TEST_F(ExportMcap, TakesTheLandmarksOfTheMapFileWhereThereIsNoOther) {
  fs::remove(folder_ / "copy/map.ply");
  auto landmarks = cloud_points(topics_with("--no-images").at("/map/landmarks").front().data);
  auto expected = ply_points(folder_ / "run/map.ply");
  std::sort(landmarks.begin(), landmarks.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(landmarks, expected);
}

TEST_F(ExportMcap, ImagesAreThoseOfTheSource) {
  const Topics topics = topics_with();
  std::size_t with_objects = 0;
  for (std::size_t i = 0; i < kFrames; ++i) {
    const Stamped& message = topics.at("/camera/image/compressed").at(i);
    const std::string file = time_text(static_cast<double>(message.time) * 1e-9) + ".png";
    const cv::Mat source = cv::imread((folder_ / "data/rgb" / file).string());
    ASSERT_FALSE(source.empty()) << file;
    const cv::Mat image = image_of(message);
    ASSERT_EQ(image.size(), source.size());
    ASSERT_EQ(image.type(), CV_8UC3);
    EXPECT_LT(mean_difference(image, source, {}), 6.0);
    const cv::Mat removed = image_of(topics.at("/camera/removed/compressed").at(i));
    const cv::Mat mask = cv::imread((folder_ / "copy/masks" / file).string(), cv::IMREAD_UNCHANGED);
    if (mask.empty()) continue;
    ++with_objects;
    const cv::Mat objects = mask != 0;
    EXPECT_LT(mean_difference(removed, source, ~objects), 6.0);
    const cv::Scalar before = cv::mean(source, objects), after = cv::mean(removed, objects);
    EXPECT_GT(after[2] - after[0], before[2] - before[0] + 60.0);  // redder
    CdrMessage info(topics.at("/camera/camera_info").at(i).data);
    EXPECT_EQ(info.stamp(), message.time);
    EXPECT_EQ(info.text(), "camera_optical_frame");
    EXPECT_EQ(info.get<std::uint32_t>(), 480U);
    EXPECT_EQ(info.get<std::uint32_t>(), 640U);
  }
  EXPECT_GT(with_objects, kFrames / 2);
}

TEST_F(ExportMcap, ImagesAreThinnedOrLeftOutAndPosesAreNot) {
  Topics topics = topics_with("--every 5");
  EXPECT_EQ(topics.at("/camera/image/compressed").size(), 3U);
  EXPECT_EQ(topics.at("/camera_pose").size(),
            read_trajectory(folder_ / "copy/trajectory.txt").trajectory.size());
  const auto large = fs::file_size(folder_ / "x.mcap");
  EXPECT_EQ(topics_with("--every 5 --jpeg-quality 20").at("/camera/image/compressed").size(), 3U);
  EXPECT_LT(fs::file_size(folder_ / "x.mcap"), large);
  topics = topics_with("--no-images");
  EXPECT_EQ(topics.count("/camera/image/compressed") + topics.count("/camera/camera_info"), 0U);
  EXPECT_EQ(topics.count("/camera_pose"), 1U);
}

TEST_F(ExportMcap, TruthLiesOverTheTrajectory) {
  // Another frame of reference than the map.
  const SE3 T_other_truth(Eigen::Quaterniond(0.9, 0.1, -0.3, 0.2).normalized(), {10.0, -4.0, 2.0});
  Trajectory truth = read_trajectory(folder_ / "copy/trajectory.txt").trajectory;
  for (StampedPose& pose : truth) pose.T_world_camera = T_other_truth * pose.T_world_camera;
  write_trajectory(folder_ / "copy/groundtruth.txt", truth);
  const Topics topics = topics_with("--no-images");
  const SE3 T_map_truth = transforms_of(topics.at("/tf_static").front()).at("map ground_truth");
  EXPECT_LT(difference(T_map_truth, T_other_truth.inverse()), 1e-6);
  const Trajectory path = path_of(topics.at("/ground_truth/path").front().data, "ground_truth");
  ASSERT_EQ(path.size(), truth.size());
  for (std::size_t i = 0; i < path.size(); ++i)
    EXPECT_LT(difference(path[i].T_world_camera, truth[i].T_world_camera), 1e-8);
}

}  // namespace
}  // namespace roslam
