// SPDX-License-Identifier: BSD-3-Clause
// Recordings written here are read: all containers, compressions and orders of chunks; cut and damaged files.
#include "roslam/recordings/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "roslam/common/error.hpp"
#include "tests/recorded_messages.hpp"
#include "tests/recording_writers.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kStart = 1'700'000'000'123'456'789;

bool is_sorted_by_time(const std::vector<Message>& messages) {
  return std::is_sorted(messages.begin(), messages.end(),
                        [](const Message& a, const Message& b) { return a.time < b.time; });
}

// CDR of random size and content that compresses by half.
std::string random_data(std::mt19937& random, std::size_t max_size) {
  std::string data("\0\1\0\0", 4);
  const std::size_t size = random() % max_size;
  for (std::size_t i = 0; i < size; ++i) data += static_cast<char>(random() % 16);
  return data;
}

struct Format {
  std::string name;
  std::string type;  // of its images
  std::function<std::unique_ptr<RecordingWriter>(const fs::path&)> create;
};

std::vector<Format> formats() {
  std::vector<Format> all;
  for (const std::string method : {"none", "lz4", "bz2"}) {
    all.push_back({"bag_" + method, "sensor_msgs/Image", [method](const fs::path& file) {
                     return std::make_unique<BagWriter>(file, ChunkOptions{method, 5000});
                   }});
  }
  for (const std::string method : {"none", "lz4", "zstd"}) {
    for (const bool has_summary : {true, false}) {
      TestMcapOptions options(method);
      options.chunk_bytes = 5000;
      options.has_summary = has_summary;
      options.has_crcs = method != "lz4";
      all.push_back(
          {"mcap_" + method + (has_summary ? "" : "_bare"), "sensor_msgs/msg/Image",
           [options](const fs::path& file) { return std::make_unique<TestMcapWriter>(file, options); }});
    }
  }
  for (const bool has_summary : {true, false}) {
    TestMcapOptions options;
    options.has_chunks = false;
    options.has_summary = has_summary;
    all.push_back(
        {has_summary ? "mcap_unchunked" : "mcap_unchunked_bare", "sensor_msgs/msg/Image",
         [options](const fs::path& file) { return std::make_unique<TestMcapWriter>(file, options); }});
  }
  for (const bool compresses : {true, false}) {
    const Db3Options options{compresses, !compresses, true};
    all.push_back({compresses ? "db3_zstd" : "db3", "sensor_msgs/msg/Image",
                   [options](const fs::path& file) { return std::make_unique<Db3Writer>(file, options); }});
  }
  return all;
}

class Recordings : public testing::TestWithParam<Format> {
 protected:
  void TearDown() override { fs::remove(file_); }

  // Messages of two topics, whose times are out of order by up to 20 of them; sorted.
  std::vector<Message> write_messages(std::size_t count) {
    std::mt19937 random(7);
    const auto writer = GetParam().create(file_);
    const std::map<std::string, int> ids{
        {"/image", writer->add_topic("/image", GetParam().type, "uint8[] data")},
        {"/imu", writer->add_topic("/imu", "sensor_msgs/Imu", "")}};
    std::vector<Message> messages;
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t time = kStart + static_cast<std::int64_t>(i * 1000 + random() % 20000);
      messages.push_back({i % 3 == 0 ? "/image" : "/imu", time, random_data(random, 800)});
      writer->write(ids.at(messages.back().topic), time, bytes_of(messages.back().data));
    }
    writer->close();
    std::stable_sort(messages.begin(), messages.end(),
                     [](const Message& a, const Message& b) { return a.time < b.time; });
    return messages;
  }

  const fs::path file_ = scratch_path();
};

TEST_P(Recordings, MessagesComeBackInOrderOfTime) {
  const auto written = write_messages(300);
  ASSERT_TRUE(is_recording(file_));
  const auto recording = open_recording(file_);
  ASSERT_EQ(recording->topics().size(), 2u);
  const RecordedTopic& image = recording->topics()[0];
  EXPECT_EQ(image.name, "/image");
  EXPECT_EQ(image.type, GetParam().type);
  EXPECT_EQ(image.definition, "uint8[] data");
  EXPECT_EQ(image.encoding, recording->container() == "ROS 1 bag" ? "ros1" : "cdr");
  EXPECT_EQ(image.messages, 100u);
  EXPECT_EQ(recording->topics()[1].messages, 200u);
  EXPECT_EQ(recording->time_range(), std::pair(written.front().time, written.back().time));
  EXPECT_EQ(read_all(*recording), written);
  EXPECT_FALSE(recording->next());

  std::vector<Message> images;
  std::copy_if(written.begin(), written.end(), std::back_inserter(images),
               [](const Message& message) { return message.topic == "/image"; });
  for (int repeat = 0; repeat < 2; ++repeat) {
    recording->select({image.id});
    EXPECT_EQ(read_all(*recording), images);
  }
  recording->select({});
  EXPECT_EQ(read_all(*recording), written);
  const bool is_scanned = GetParam().name.ends_with("_bare");
  EXPECT_EQ(recording->notes().size(), is_scanned ? 1u : 0u);
}

// Whatever is whole in a cut file is given; a cut database is refused.
TEST_P(Recordings, AFileCutAnywhereGivesWhatIsWhole) {
  const auto written = write_messages(60);
  const std::string bytes = bytes_of_file(file_);
  const bool is_database = GetParam().name.starts_with("db3");
  std::size_t most = 0;
  for (std::size_t size = 0; size < bytes.size(); size += 97) {
    put(file_, bytes.substr(0, size));
    std::vector<Message> messages;
    try {
      const auto recording = open_recording(file_);
      messages = read_all(*recording);
      EXPECT_FALSE(recording->notes().empty()) << size;
      EXPECT_TRUE(is_sorted_by_time(messages)) << size;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(file_.string()), std::string::npos);
      EXPECT_TRUE(is_database || size < 13u) << error.what();
    }
    for (const Message& message : messages)
      EXPECT_NE(std::find(written.begin(), written.end(), message), written.end()) << size;
    std::size_t whole = 0;  // messages whose data are in the file as they are
    for (const Message& message : written) {
      const std::size_t at = message.data.size() < 30 ? std::string::npos : bytes.find(message.data);
      whole += at != std::string::npos && at + message.data.size() <= size ? 1 : 0;
    }
    if (is_database) continue;
    EXPECT_GE(messages.size(), whole) << size;
    EXPECT_GE(messages.size(), most) << size;  // more of the file, no fewer messages
    most = messages.size();
  }
  EXPECT_TRUE(is_database || most > written.size() * 9 / 10);
}

// Flipped bits give errors or notes or other data, but end.
TEST_P(Recordings, DamagedBytesAreSurvived) {
  write_messages(60);
  const std::string bytes = bytes_of_file(file_);
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    std::string damaged = bytes;
    for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] ^= static_cast<char>(1U << random() % 8);
    put(file_, damaged);
    try {
      const auto recording = open_recording(file_);
      EXPECT_LE(read_all(*recording).size(), 200u);
    } catch (const InputError&) {
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, Recordings, testing::ValuesIn(formats()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace roslam
