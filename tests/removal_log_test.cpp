// SPDX-License-Identifier: BSD-3-Clause
// Removed objects are written while the camera flies: a disk that stalls costs masks, later lines, but
// neither memory nor the tracker's time.
#include "recording/removal_log.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "roslam/common/error.hpp"
#include "tests/file_size_limit.hpp"
#include "tests/scratch.hpp"

namespace roslam::recording {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kLimit{60};
constexpr std::size_t kImages = 30;  // frames with images that may wait
const cv::Rect kPerson(200, 120, 80, 200);

// A disk that stalls when this mask is written: opening a FIFO for writing waits until somebody reads it.
class StalledMask {
 public:
  explicit StalledMask(const fs::path& file) : file_(file) {
    if (mkfifo(file.c_str(), 0600) != 0) ADD_FAILURE() << file << " cannot be made";
  }
  ~StalledMask() {
    end_stall();
    if (reader_ >= 0) close(reader_);
  }
  StalledMask(const StalledMask&) = delete;
  StalledMask& operator=(const StalledMask&) = delete;

  void end_stall() {
    if (reader_ < 0) reader_ = open(file_.c_str(), O_RDONLY | O_NONBLOCK);
  }

  // The image that was written; to be called after it was.
  cv::Mat image() const {
    std::vector<unsigned char> bytes(1 << 16);
    const auto size = read(reader_, bytes.data(), bytes.size());
    bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return bytes.empty() ? cv::Mat() : cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  }

 private:
  fs::path file_;
  int reader_ = -1;
};

int references(const cv::Mat& image) { return std::atomic_ref<int>(image.u->refcount).load(); }

class RemovedObjects : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  RemovalLog::Settings settings(Mode mode) const { return {folder_, mode, 30.0, false}; }

  static double time_of(std::size_t index) { return static_cast<double>(index) / 32.0; }

  static Frame frame(std::size_t index) {
    static const cv::Mat colour(480, 640, CV_8UC3, cv::Scalar(90, 120, 150));
    Frame result;
    result.index = index;
    result.timestamp = time_of(index);
    result.colour = colour;
    return result;
  }

  // A frame with a person, 3 points on it and 5 beside it.
  static FrameResult with_person(std::size_t index) {
    static const cv::Mat object_mask(kPerson.size(), CV_8UC1, cv::Scalar(255));
    MovableObject person;
    person.id = 1;
    person.kind = Movable::kPerson;
    person.box = kPerson;
    person.mask = object_mask;
    person.confidence = 0.75F;
    FrameResult result = without_objects(index);
    result.dynamic_objects.mask = frame_mask();
    result.dynamic_objects.objects = {person};
    result.dynamic_objects.label_age = 2;
    for (int i = 0; i < 3; ++i)
      result.removed_points.emplace_back(230.0F, 180.0F + 10.0F * static_cast<float>(i));
    return result;
  }

  static FrameResult without_objects(std::size_t index) {
    FrameResult result;
    result.index = index;
    result.timestamp = time_of(index);
    result.state = TrackingState::kTracking;
    result.T_world_camera = SE3();
    result.quality = 1.0;
    for (int i = 0; i < 5; ++i) result.points.emplace_back(20.0F + 10.0F * static_cast<float>(i), 30.0F);
    return result;
  }

  // The mask of all frames with a person.
  static const cv::Mat& frame_mask() {
    static const cv::Mat mask = [] {
      cv::Mat image = cv::Mat::zeros(480, 640, CV_8UC1);
      image(kPerson) = 255;
      return image;
    }();
    return mask;
  }

  std::vector<Json> lines() const {
    std::vector<Json> result;
    std::ifstream in(folder_ / kDescriptorFile);
    for (std::string line; std::getline(in, line);) result.push_back(Json::parse(line, nullptr, false));
    return result;
  }

  std::set<std::string> mask_files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_ / kMaskFolder))
      names.insert(std::string(kMaskFolder) + "/" + entry.path().filename().string());
    return names;
  }

  // The lines of these frames as they are written where nothing is dropped.
  std::vector<Json> complete_lines(std::size_t frames, FrameResult (*result_of)(std::size_t)) const {
    RemovalLog log(settings(Mode::kDeterministic));
    for (std::size_t i = 0; i < frames; ++i) log.add(frame(i), result_of(i));
    log.finish();
    return lines();
  }

  // The masks that lines name are the files that exist.
  void expect_masks(const std::vector<Json>& written) const {
    std::set<std::string> named;
    for (const auto& line : written) {
      if (!line["mask"].is_null()) named.insert(line["mask"].get<std::string>());
    }
    EXPECT_EQ(named, mask_files());
  }

  static FrameResult person_in_every_other(std::size_t index) {
    return index % 2 == 0 ? with_person(index) : without_objects(index);
  }

  const fs::path folder_ = scratch_path();
};

TEST_F(RemovedObjects, DropsNothingInRealTimeWhileTheDiskKeepsUp) {
  RemovalLog log(settings(Mode::kRealTime));
  for (std::size_t i = 0; i < kImages; ++i) log.add(frame(i), person_in_every_other(i));
  log.finish();
  EXPECT_EQ(log.tally().frames, kImages);
  EXPECT_EQ(log.tally().masks_dropped, 0U);
  EXPECT_EQ(log.tally().lines_dropped, 0U);
  EXPECT_EQ(log.tally().removed_points, (PointCounts{{"person", 3 * kImages / 2}}));
  EXPECT_EQ(log.tally().kept_points, 5 * kImages);
  const auto written = lines();
  EXPECT_EQ(written.size(), kImages);
  expect_masks(written);
  EXPECT_EQ(mask_files().size(), kImages / 2);
  const cv::Mat mask = cv::imread((folder_ / mask_name(time_of(2))).string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(mask.size(), cv::Size(640, 480));
  EXPECT_EQ(cv::countNonZero(mask), kPerson.area());
  EXPECT_EQ(mask.at<std::uint8_t>(kPerson.tl()), 1);
}

// Each frame refers to the same images, so that the references tell how many frames are kept with them.
TEST_F(RemovedObjects, KeepsNoMoreThanLinesInMemoryWhileTheDiskStallsInRealTime) {
  constexpr std::size_t kFrames = 200;
  const auto complete = complete_lines(kFrames, with_person);
  ASSERT_EQ(complete.size(), kFrames);
  EXPECT_EQ(mask_files().size(), kFrames);

  RemovalLog log(settings(Mode::kRealTime));
  StalledMask stalled(folder_ / mask_name(time_of(0)));
  const cv::Mat object_mask = with_person(0).dynamic_objects.objects.front().mask;
  const int mask_before = references(frame_mask());
  const int object_before = references(object_mask);
  for (std::size_t i = 0; i < kFrames; ++i) log.add(frame(i), with_person(i));
  // One is being written, and refers to its images more than once.
  EXPECT_GE(references(frame_mask()) - mask_before, static_cast<int>(kImages));
  EXPECT_LE(references(frame_mask()) - mask_before, static_cast<int>(kImages) + 10);
  EXPECT_GE(references(object_mask) - object_before, static_cast<int>(kImages));
  EXPECT_LE(references(object_mask) - object_before, static_cast<int>(kImages) + 10);
  stalled.end_stall();
  log.finish();
  EXPECT_EQ(references(frame_mask()), mask_before);

  EXPECT_EQ(log.tally().frames, kFrames);
  EXPECT_EQ(log.tally().lines_dropped, 0U);
  EXPECT_GE(mask_files().size(), kImages);
  EXPECT_LE(mask_files().size(), kImages + 1);
  EXPECT_EQ(log.tally().masks_dropped + mask_files().size(), kFrames);
  // Frames of which a line only is kept are summed up as the others are.
  EXPECT_EQ(log.tally().removed_points, (PointCounts{{"person", 3 * kFrames}}));
  EXPECT_EQ(log.tally().kept_points, 5 * kFrames);
  EXPECT_EQ(log.tally().label_ages, std::vector<int>(kFrames, 2));
  EXPECT_NEAR(log.tally().removed_area, kFrames * kPerson.area() / (640.0 * 480.0), 1e-6);
  auto written = lines();
  expect_masks(written);
  ASSERT_EQ(written.size(), kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    if (written[i]["mask"].is_null()) written[i]["mask"] = complete[i]["mask"];
    EXPECT_EQ(written[i], complete[i]) << i;
  }
  EXPECT_EQ(cv::countNonZero(stalled.image()), kPerson.area());
}

TEST_F(RemovedObjects, DropsLinesTooWhereTheDiskStallsForMinutesAndCountsThem) {
  constexpr std::size_t kFrames = 3500;
  RemovalLog log(settings(Mode::kRealTime));
  StalledMask stalled(folder_ / mask_name(time_of(0)));
  for (std::size_t i = 0; i < kFrames; ++i) log.add(frame(i), with_person(i));
  stalled.end_stall();
  log.finish();
  const auto written = lines();
  EXPECT_EQ(log.tally().frames, written.size());
  EXPECT_GE(written.size(), 3000U);
  EXPECT_LE(written.size(), 3001U);
  EXPECT_EQ(log.tally().lines_dropped, kFrames - written.size());
  EXPECT_EQ(log.tally().masks_dropped + mask_files().size(), written.size());
  EXPECT_EQ(log.tally().removed_points, (PointCounts{{"person", 3 * written.size()}}));
  expect_masks(written);
  for (std::size_t i = 0; i < written.size(); ++i) EXPECT_EQ(written[i]["frame"], i);  // the newest are lost
}

// A frame without an object has no mask that could be dropped.
TEST_F(RemovedObjects, CountsMasksOfFramesWithObjectsOnly) {
  constexpr std::size_t kFrames = 300;
  RemovalLog log(settings(Mode::kRealTime));
  StalledMask stalled(folder_ / mask_name(time_of(0)));
  for (std::size_t i = 0; i < kFrames; ++i) log.add(frame(i), person_in_every_other(i));
  stalled.end_stall();
  log.finish();
  EXPECT_EQ(log.tally().frames, kFrames);
  EXPECT_EQ(log.tally().lines_dropped, 0U);
  EXPECT_EQ(log.tally().masks_dropped + mask_files().size(), kFrames / 2);
}

TEST_F(RemovedObjects, WritesMasksAgainAfterTheStall) {
  RemovalLog log(settings(Mode::kRealTime));
  std::size_t added = 0;
  {
    StalledMask stalled(folder_ / mask_name(time_of(0)));
    for (; added < 100; ++added) log.add(frame(added), with_person(added));
    stalled.end_stall();
    // The frames that wait are written once the newest of them is.
    const auto last_mask = folder_ / mask_name(time_of(kImages - 1));
    const auto end = Clock::now() + kLimit;
    while (!fs::exists(last_mask) && Clock::now() < end) std::this_thread::yield();
    ASSERT_TRUE(fs::exists(last_mask));
  }
  EXPECT_LE(mask_files().size(), kImages + 1);
  const auto end = Clock::now() + kLimit;
  while (mask_files().size() <= kImages + 1 && Clock::now() < end) {  // until the queue is short enough
    log.add(frame(added), with_person(added));
    ++added;
    std::this_thread::yield();
  }
  log.finish();
  EXPECT_GT(mask_files().size(), kImages + 1);
  EXPECT_EQ(lines().size(), added);
  EXPECT_GT(log.tally().masks_dropped, 0U);
  EXPECT_EQ(log.tally().masks_dropped + mask_files().size(), added);
}

TEST_F(RemovedObjects, WaitsForTheDiskAndDropsNothingInDeterministicMode) {
  constexpr std::size_t kFrames = 120;
  RemovalLog log(settings(Mode::kDeterministic));
  std::atomic<std::size_t> added = 0;
  std::future<void> writer;
  StalledMask stalled(folder_ / mask_name(time_of(0)));  // ends before the writer is waited for
  writer = std::async(std::launch::async, [&] {
    for (std::size_t i = 0; i < kFrames; ++i, ++added) log.add(frame(i), person_in_every_other(i));
  });
  const auto end = Clock::now() + kLimit;
  while (added < kImages && Clock::now() < end) std::this_thread::yield();
  EXPECT_EQ(writer.wait_for(std::chrono::milliseconds(100)), std::future_status::timeout);
  EXPECT_GE(added, kImages);
  EXPECT_LE(added, kImages + 1);
  stalled.end_stall();
  ASSERT_EQ(writer.wait_for(kLimit), std::future_status::ready);
  log.finish();
  EXPECT_EQ(log.tally().frames, kFrames);
  EXPECT_EQ(log.tally().masks_dropped, 0U);
  EXPECT_EQ(log.tally().lines_dropped, 0U);
  const auto written = lines();
  EXPECT_EQ(written.size(), kFrames);
  EXPECT_EQ(mask_files().size(), kFrames / 2);
  expect_masks(written);
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ(written[i]["frame"], i);
    EXPECT_EQ(written[i]["mask"].is_null(), i % 2 == 1) << i;
  }
}

TEST_F(RemovedObjects, ADiskThatFailsIsReportedAtTheEndAndNeverWaitedFor) {
  for (const Mode mode : {Mode::kDeterministic, Mode::kRealTime}) {
    RemovalLog log(settings(mode));
    fs::remove(folder_ / kMaskFolder);
    std::ofstream(folder_ / kMaskFolder) << "a file in place of the folder";
    for (std::size_t i = 0; i < 10 * kImages; ++i) log.add(frame(i), with_person(i));
    EXPECT_THROW(log.finish(), OutputError);
    EXPECT_TRUE(fs::is_empty(folder_));  // the disk space is for the other results
  }
}

TEST_F(RemovedObjects, AVideoThatIsCutIsReportedAndRemoved) {
  constexpr std::size_t kFrames = 90;
  std::uintmax_t size = 0;
  const auto record = [&] {
    RemovalLog log({folder_, Mode::kDeterministic, 30.0, true});
    for (std::size_t i = 0; i < kFrames; ++i) log.add(frame(i), without_objects(i));
    log.finish();
    size = fs::file_size(folder_ / "removal.avi");
  };
  ASSERT_NO_THROW(record());
  for (const std::uintmax_t limit : {size - 1, size / 2, std::uintmax_t{100000}}) {
    const FileSizeLimit limited(limit);
    EXPECT_THROW(record(), OutputError) << limit;
    EXPECT_TRUE(fs::is_empty(folder_));
  }
}

}  // namespace
}  // namespace roslam::recording
