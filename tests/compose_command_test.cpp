// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

// A base sequence of five frames: a wall at 4 m, a pillar at 1.5 m on the left, seen by a level camera.
class ComposeCommand : public testing::Test {
 protected:
  static constexpr int kFrames = 5;

  ComposeCommand() : folder_(scratch_path()) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "base/rgb");
    fs::create_directories(folder_ / "base/depth");
    fs::create_directories(folder_ / "people");
    std::ofstream rgb(folder_ / "base/rgb.txt");
    std::ofstream depth(folder_ / "base/depth.txt");
    std::ofstream truth(folder_ / "base/groundtruth.txt");
    for (int i = 0; i < kFrames; ++i) {
      const std::string name = std::to_string(i) + ".png";
      cv::Mat colour(240, 320, CV_8UC3, cv::Scalar(120, 120, 120));
      colour.colRange(0, 60) = cv::Scalar(0, 0, 90);
      cv::Mat metres(240, 320, CV_16UC1, cv::Scalar(4001));
      metres.colRange(0, 60) = 1501;
      cv::imwrite((folder_ / "base/rgb" / name).string(), colour);
      cv::imwrite((folder_ / "base/depth" / name).string(), metres);
      rgb << 10.0 + 0.1 * i << " rgb/" << name << "\n";
      depth << 10.0 + 0.1 * i << " depth/" << name << "\n";
      truth << 10.0 + 0.1 * i << " 0 0 0 0 0 0 1\n";
    }
    std::ofstream(folder_ / "camera.yaml") << "width: 320\nheight: 240\nfx: 200\nfy: 200\ncx: 160\ncy: 120\n"
                                           << "depth_units_per_metre: 1000\n";
    put_person("people/green", {80, 200});
  }
  ~ComposeCommand() override { fs::remove_all(folder_); }

  void put_person(const std::string& name, const cv::Size& size, int value = 255) const {
    cv::imwrite((folder_ / (name + ".jpg")).string(), cv::Mat(size, CV_8UC3, cv::Scalar(0, 255, 0)));
    cv::Mat mask(size, CV_8UC1, cv::Scalar(0));
    mask(cv::Rect(5, 5, size.width - 10, size.height - 10)) = value;
    cv::imwrite((folder_ / (name + "_mask.png")).string(), mask);
  }

  Outcome compose(const std::string& arguments) const {
    return shell_in(folder_, std::string(ROSLAM_PROGRAM) + " compose " + arguments);
  }

  // base: the folder of the sequence.
  Outcome compose_base(const std::string& more, const std::string& base = "base") const {
    return compose(base + " --camera camera.yaml --people people --distance 2 2.5 --span 0.3 " + more);
  }

  void fails(const Outcome& outcome, const std::string& reason) const {
    EXPECT_EQ(outcome.code, 1) << reason;
    EXPECT_NE(outcome.error.find(reason), std::string::npos) << reason << ": " << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }

  cv::Mat image(const std::string& file) const {
    return cv::imread((folder_ / file).string(), cv::IMREAD_UNCHANGED);
  }

  // The second word of each line but the first.
  std::vector<std::string> listed(const std::string& file) const {
    std::istringstream lines(content(folder_ / file));
    std::vector<std::string> files;
    std::string line;
    while (std::getline(lines, line)) {
      if (line.front() != '#') files.push_back(line.substr(line.find(' ') + 1));
    }
    return files;
  }

  fs::path folder_;
};

TEST_F(ComposeCommand, WritesASequenceWithItsTruth) {
  const Outcome outcome = compose_base("--out out --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(outcome.error, "");
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["frames"], kFrames);
  EXPECT_EQ(json["actors"].size(), 2u);
  const double mean = json["covered_mean"].get<double>();
  EXPECT_GT(mean, 0.02);
  EXPECT_GE(json["covered_most"].get<double>(), mean);
  Camera camera = read_camera(folder_ / "camera.yaml");
  camera.depth_units_per_metre = 5000;
  EXPECT_EQ(read_camera(folder_ / "out/camera.yaml"), camera);
  EXPECT_EQ(read_trajectory(folder_ / "out/groundtruth.txt").trajectory.size(), 5u);
  for (const char* list : {"rgb.txt", "depth.txt", "background.txt", "background_depth.txt"}) {
    const auto files = listed(std::string("out/") + list);
    ASSERT_EQ(files.size(), 5u) << list;
    for (const auto& file : files) EXPECT_FALSE(image("out/" + file).empty()) << file;
  }
  for (const auto& file : listed("out/rgb.txt")) {
    const std::string name = fs::path(file).filename();
    const cv::Mat instances = image("out/instances/" + name);
    ASSERT_EQ(instances.type(), CV_16UC1);
    const cv::Mat seen = instances > 0;
    EXPECT_EQ(cv::norm(image("out/labels/" + name) == 11, seen, cv::NORM_INF), 0.0);
    const cv::Mat depth = image("out/depth/" + name);
    const cv::Mat same = (depth == 5 * 4001) | (depth == 5 * 1501) | (depth == 0);
    EXPECT_EQ(cv::countNonZero(~same & ~seen), 0);
    EXPECT_EQ(cv::countNonZero(same.colRange(0, 60)), 240 * 60);  // the pillar stands nearer
  }
}

TEST_F(ComposeCommand, TheSameSeedGivesTheSameBytes) {
  ASSERT_EQ(compose_base("--out a --seed 7").code, 0);
  ASSERT_EQ(compose_base("--out b --seed 7").code, 0);
  ASSERT_EQ(compose_base("--out c --seed 8").code, 0);
  std::size_t files = 0;
  bool differs = false;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "a")) {
    if (!entry.is_regular_file()) continue;
    const fs::path name = fs::relative(entry.path(), folder_ / "a");
    EXPECT_EQ(content(folder_ / "b" / name), content(entry.path())) << name;
    differs =
        differs || (name.parent_path() == "rgb" && content(folder_ / "c" / name) != content(entry.path()));
    ++files;
  }
  EXPECT_EQ(files, 4u * kFrames + 8u);
  EXPECT_TRUE(differs);
}

TEST_F(ComposeCommand, FewerFramesAreTheFirstOfAll) {
  ASSERT_EQ(compose_base("--out all").code, 0);
  const Outcome outcome = compose_base("--out two --frames 2");
  ASSERT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.out.find("wrote 2 frames to two; actors cover "), std::string::npos) << outcome.out;
  ASSERT_EQ(listed("two/rgb.txt").size(), 2u);
  for (const auto& file : listed("two/rgb.txt"))
    EXPECT_EQ(content(folder_ / "two" / file), content(folder_ / "all" / file));
}

TEST_F(ComposeCommand, WithoutActorsItCopiesTheSequence) {
  const Outcome outcome = compose_base("--out out --actors 0");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("actors cover 0.0 %"), std::string::npos);
  const auto files = listed("out/rgb.txt");
  const auto depths = listed("out/depth.txt");
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string base = "base/rgb/" + std::to_string(i) + ".png";
    EXPECT_EQ(cv::norm(image("out/" + files[i]), image(base), cv::NORM_INF), 0.0);
    const cv::Mat depth = image("base/depth/" + std::to_string(i) + ".png");
    EXPECT_EQ(cv::norm(image("out/" + depths[i]), 5 * depth, cv::NORM_INF), 0.0);
  }
}

TEST_F(ComposeCommand, MoreActorsThanImagesComeAgain) {
  const Outcome outcome = compose_base("--out out --actors 5 --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json["actors"].size(), 5u);
  for (const auto& actor : json["actors"]) EXPECT_EQ(actor["name"], "green");
}

TEST_F(ComposeCommand, SkipsWhatCannotBeReadAndCountsIt) {
  fs::resize_file(folder_ / "base/rgb/1.png", fs::file_size(folder_ / "base/rgb/1.png") / 2);
  fs::resize_file(folder_ / "base/depth/2.png", fs::file_size(folder_ / "base/depth/2.png") / 2);
  const Outcome outcome = compose_base("--out out --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["frames"], kFrames - 2);
  EXPECT_EQ(json["skipped"]["colour image is truncated"], 1);
  EXPECT_EQ(json["skipped"]["depth image is truncated"], 1);
  EXPECT_EQ(listed("out/background.txt").size(), 3u);
}

TEST_F(ComposeCommand, TellsWhatIsWrongWithThePeople) {
  fs::create_directories(folder_ / "nobody");
  const auto with = [&](const std::string& people) {
    return compose("base --camera camera.yaml --out out --people " + people);
  };
  fails(with("nowhere"), "nowhere: no such folder");
  fails(with("nobody"), "nobody: holds no people");
  fs::create_directories(folder_ / "bare");
  fs::copy(folder_ / "people/green.jpg", folder_ / "bare/green.jpg");
  fails(with("bare"), "bare/green.jpg: has no mask green_mask.png");
  cv::imwrite((folder_ / "bare/green_mask.png").string(), cv::Mat(50, 50, CV_8UC1, cv::Scalar(255)));
  fails(with("bare"), "bare/green_mask.png: is 50x50 but its image 80x200 pixels");
  fs::create_directories(folder_ / "empty");
  put_person("empty/one", {80, 200}, 0);
  fails(with("empty"), "empty/one_mask.png: marks no person");
  fs::create_directories(folder_ / "torn");
  put_person("torn/one", {80, 200});
  fs::resize_file(folder_ / "torn/one.jpg", 200);
  fails(with("torn"), "torn/one.jpg: is truncated");
}

TEST_F(ComposeCommand, TellsWhatIsWrongWithTheSequence) {
  fails(compose_base("--out out", "nowhere"), "nowhere: no such folder");
  fails(compose_base("--out base"), "base: holds the sequence without people");
  fails(compose_base("--out base/rgb"), "base/rgb: holds the sequence without people");
  std::ofstream(folder_ / "file") << "";
  fails(compose_base("--out file"), "cannot create the output folder");
  fs::copy(folder_ / "base", folder_ / "other", fs::copy_options::recursive);
  std::ofstream(folder_ / "other/groundtruth.txt") << "500 0 0 0 0 0 0 1\n";
  fails(compose_base("--out out", "other"), "other/groundtruth.txt: has no pose at the time of the images");
  fs::remove(folder_ / "other/groundtruth.txt");
  fails(compose_base("--out out", "other"), "other/groundtruth.txt: is missing");
  fails(compose("base --camera tum-fr1 --people people --out out"), "base: no frame could be used");
  fails(compose("base --camera none.yaml --people people --out out"),
        "none.yaml: cannot open the camera file");
  EXPECT_FALSE(fs::exists(folder_ / "base/labels"));
}

TEST_F(ComposeCommand, TellsWhenTheDiskIsFull) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  fs::create_directories(folder_ / "out/rgb");
  fs::create_symlink("/dev/full", folder_ / "out/rgb/10.000000.png");
  fails(compose_base("--out out --overwrite"), "10.000000.png: cannot be written in full");
}

TEST_F(ComposeCommand, ListsOfACompositionThatFailsAreAbsent) {
  ASSERT_EQ(compose_base("--out out").code, 0);
  const Outcome outcome = shell_in(folder_, std::string("ulimit -f 2; ") + ROSLAM_PROGRAM +
                                                " compose base --camera camera.yaml --actors 0 --out out");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.error.find("ulimit"), std::string::npos) << outcome.error;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "out")) {
    EXPECT_NE(entry.path().extension(), ".part");
    const bool is_image = entry.path().extension() == ".png";
    EXPECT_TRUE(!is_image || !image(fs::relative(entry.path(), folder_).string()).empty()) << entry.path();
  }
  for (const char* list : {"rgb.txt", "depth.txt", "background.txt", "background_depth.txt"})
    EXPECT_FALSE(fs::exists(folder_ / "out" / list)) << list;
}

TEST_F(ComposeCommand, WithoutActorsNeedsNoPeople) {
  const Outcome outcome = compose("base --camera camera.yaml --actors 0 --out out");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(listed("out/rgb.txt").size(), static_cast<std::size_t>(kFrames));
  const Outcome without = compose("base --camera camera.yaml --out out");
  EXPECT_EQ(without.code, 2);
  EXPECT_NE(without.error.find("--people"), std::string::npos) << without.error;
}

TEST_F(ComposeCommand, WrongUsageIsTwo) {
  EXPECT_EQ(compose_base("").code, 2);
  EXPECT_EQ(compose_base("--out out --actors -1").code, 2);
  EXPECT_EQ(compose_base("--out out --actors many").code, 2);
  EXPECT_EQ(compose_base("--out out --seed -1").code, 2);
  EXPECT_EQ(compose_base("--out out --frames 0").code, 2);
  EXPECT_EQ(compose_base("--out out --unknown").code, 2);
  fails(compose("base --camera camera.yaml --people people --out out --distance 3 1"), "max_distance");
}

TEST_F(ComposeCommand, SaysWhenNobodyIsSeenOrDepthIsTooFar) {
  const Outcome hidden = compose("base --camera camera.yaml --people people --out out --distance 8 9");
  EXPECT_EQ(hidden.code, 0);
  EXPECT_NE(hidden.error.find("no actor is ever seen"), std::string::npos) << hidden.error;
  const Outcome far = compose_base("--out out --depth-units 20000");
  EXPECT_EQ(far.code, 0);
  EXPECT_NE(far.error.find("farther than 3.3 m"), std::string::npos) << far.error;
}

TEST_F(ComposeCommand, ComposesARealSequence) {
  const fs::path data = ROSLAM_TEST_DATA;
  if (!fs::exists(data / "slam/kitchen") || !fs::exists(data / "cutouts")) {
    GTEST_SKIP() << data.string() << ": no slam/kitchen and cutouts there";
  }
  std::string command = "--camera 7scenes --camera-height 1.4 --distance 1 2 --span 0.9 --frames 5 --out out";
  command.append(" --json --people '").append((data / "cutouts").string()).append("' '");
  command.append((data / "slam/kitchen").string()).append("'");
  const Outcome outcome = compose(command);
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["frames"], 5);
  EXPECT_GT(json["covered_most"].get<double>(), 0.01);
  // The camera looks down at a table: up is far from what its images have up.
  EXPECT_NEAR(json["up"][1].get<double>(), -0.89, 0.05);
  const Outcome run =
      shell_in(folder_, std::string(ROSLAM_PROGRAM) +
                            " run out --camera out/camera.yaml --out run --dynamic none --quiet");
  EXPECT_EQ(run.code, 0) << run.error;
}

}  // namespace
}  // namespace roslam
