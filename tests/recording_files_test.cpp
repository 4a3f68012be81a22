// SPDX-License-Identifier: BSD-3-Clause
// Recordings that other programs wrote, compared with what independent readers find in them.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/recordings/recording.hpp"
#include "tests/recording_writers.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = fs::path(ROSLAM_TEST_DATA) / "recordings";

// Topic, time and CRC-32 of the data of each message, one a line.
using Lines = std::vector<std::string>;

Lines lines_of(Recording& recording) {
  Lines lines;
  while (const auto message = recording.next()) {
    const auto crc = crc32_z(0, message->data.data(), message->data.size());
    lines.push_back(recording.topics().at(static_cast<std::size_t>(message->topic)).name + " " +
                    std::to_string(message->time) + " " + std::to_string(crc));
  }
  return lines;
}

// What a Python program prints, or nothing if it fails.
std::optional<Lines> lines_of_python(const std::string& program, const fs::path& file) {
  const std::string command = "/usr/bin/python3 -c '" + program + "' '" + file.string() + "' 2>/dev/null";
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  Lines lines;
  char line[4096];
  while (std::fgets(line, sizeof line, pipe) != nullptr) {
    lines.emplace_back(line);
    lines.back().pop_back();
  }
  return pclose(pipe) == 0 ? std::optional(lines) : std::nullopt;
}

const std::string kRosbag =
    "import rosbag, sys, zlib\n"
    "for topic, raw, time in rosbag.Bag(sys.argv[1]).read_messages(raw=True):\n"
    "  print(topic, time.to_nsec(), zlib.crc32(raw[1]))\n";
const std::string kSqlite =
    "import sqlite3, sys, zlib\n"
    "db = sqlite3.connect(\"file:\" + sys.argv[1] + \"?mode=ro&immutable=1\", uri=True)\n"
    "for name, time, data in db.execute(\"SELECT name, timestamp, data FROM messages JOIN topics ON topic_id "
    "= "
    "topics.id ORDER BY timestamp, messages.id\"):\n"
    "  print(name, time, zlib.crc32(data))\n";

// The same messages, in the order of time; of equal times in any order.
void expect_same(Lines read, Lines expected) {
  const auto time_of = [](const std::string& line) {
    const std::size_t crc = line.rfind(' ');
    return std::stoll(line.substr(line.rfind(' ', crc - 1) + 1));
  };
  EXPECT_TRUE(std::is_sorted(read.begin(), read.end(), [&](const std::string& a, const std::string& b) {
    return time_of(a) < time_of(b);
  }));
  std::sort(read.begin(), read.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(read.size(), expected.size());
  EXPECT_TRUE(read == expected);
}

struct Known {
  const char* file;
  std::size_t topics;
  std::size_t messages;
  const char* note = nullptr;  // the beginning of one that is expected; else none is
};

// Counts of the bags and of the database by other readers (rosbag, sqlite3), of the cut bag and the MCAP
// files by hand from their records and statistics.
constexpr Known kKnown[] = {
    {"aruco_images.bag", 2, 16},
    {"cruise_example-unsorted-chunks.bag", 1, 3},
    {"foxglove_example-bz2.bag", 9, 8647},
    {"foxglove_example-lz4.bag", 9, 8647},
    {"foxglove_no-messages.bag", 0, 0},
    {"realsense_d435.bag", 70, 135},
    {"tiryoh_test_sample.bag", 2, 14},
    {"tiryoh_test_truncated.bag", 1, 3, "the file is truncated"},
    {"tiryoh_test_unindexed.bag", 2, 14, "the recording was not closed"},
    {"rosbag2_topics_and_services.db3", 5, 13},
    {"rosbag2_talker.mcap", 3, 20},
    {"rosbag2_topics_and_services.mcap", 5, 13},
    {"soccer_goal_12.mcap", 1, 2},
    {"tiryoh_test_sample.mcap", 2, 14},
    {"tiryoh_test_sample_truncated.mcap", 2, 14, "the file is truncated"},
};

class RecordedFiles : public testing::TestWithParam<Known> {};

TEST_P(RecordedFiles, HaveTheirTopicsAndMessages) {
  const fs::path file = kFolder / GetParam().file;
  if (!fs::exists(file)) GTEST_SKIP() << "no " << file;
  ASSERT_TRUE(is_recording(file));
  const auto recording = open_recording(file);
  EXPECT_EQ(recording->topics().size(), GetParam().topics);
  std::size_t counted = 0;
  for (const RecordedTopic& topic : recording->topics()) {
    counted += topic.messages.value();
    EXPECT_FALSE(topic.type.empty());
  }
  EXPECT_EQ(counted, GetParam().messages);
  const Lines lines = lines_of(*recording);
  EXPECT_EQ(lines.size(), GetParam().messages);
  EXPECT_EQ(recording->time_range().has_value(), !lines.empty());

  std::string notes;
  for (const auto& [what, count] : recording->notes()) notes += what + "; ";
  if (GetParam().note == nullptr) {
    EXPECT_EQ(notes, "");
  } else {
    EXPECT_NE(notes.find(GetParam().note), std::string::npos) << notes;
  }

  const std::string extension = file.extension();
  if (extension == ".mcap" || GetParam().note != nullptr) return;
  const auto expected = lines_of_python(extension == ".bag" ? kRosbag : kSqlite, file);
  if (!expected) GTEST_SKIP() << "no python3-rosbag or sqlite3 to compare with";
  expect_same(lines, *expected);
}

INSTANTIATE_TEST_SUITE_P(All, RecordedFiles, testing::ValuesIn(kKnown), [](const auto& test) {
  std::string name = test.param.file;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

// Images that rosbag2 compressed one by one, in an MCAP file: 640x480 pixels of three bytes behind 52 of CDR.
TEST(RecordedMessages, CompressedOneByOneAreUnpacked) {
  const fs::path file = kFolder / "soccer_goal_12.mcap";
  if (!fs::exists(file)) GTEST_SKIP() << "no " << file;
  const auto recording = open_recording(file);
  while (const auto message = recording->next()) {
    ASSERT_EQ(message->data.size(), 52u + 640 * 480 * 3);
    EXPECT_EQ(std::string(&message->data[36], &message->data[40]), "rgb8");
  }
}

// The same recording in several forms. The messages of /diagnostics_agg in the bag without an index differ.
TEST(RecordingsOfOneFlight, AnIndexChangesNothing) {
  if (!fs::exists(kFolder)) GTEST_SKIP() << "no " << kFolder;
  const auto rosout_of = [](const char* file) {
    const auto recording = open_recording(kFolder / file);
    for (const RecordedTopic& topic : recording->topics()) {
      if (topic.name == "/rosout_agg") recording->select({topic.id});
    }
    return lines_of(*recording);
  };
  const auto whole = rosout_of("tiryoh_test_sample.bag");
  EXPECT_EQ(whole.size(), 10u);
  EXPECT_EQ(rosout_of("tiryoh_test_unindexed.bag"), whole);
  EXPECT_EQ(rosout_of("tiryoh_test_truncated.bag"), Lines(whole.begin(), whole.begin() + 3));
  EXPECT_EQ(lines_of(*open_recording(kFolder / "foxglove_example-bz2.bag")),
            lines_of(*open_recording(kFolder / "foxglove_example-lz4.bag")));
  EXPECT_EQ(lines_of(*open_recording(kFolder / "tiryoh_test_sample_truncated.mcap")),
            lines_of(*open_recording(kFolder / "tiryoh_test_sample.mcap")));
}

// Bags of the tests' writer are bags for other programs as well.
TEST(RecordingWriters, WriteWhatOthersRead) {
  for (const std::string method : {"none", "lz4", "bz2"}) {
    const fs::path file = scratch_path(".bag");
    BagWriter writer(file, {method, 3000});
    const int numbers = writer.add_topic("/numbers", "std_msgs/UInt32", "uint32 data");
    const int words = writer.add_topic("/words", "std_msgs/String", "string data");
    for (std::uint32_t i = 0; i < 500; ++i) {
      const std::string data = bits(i);
      writer.write(i % 4 == 0 ? words : numbers, 1'600'000'000'000'000'000 + i * 7,
                   {reinterpret_cast<const std::uint8_t*>(data.data()), data.size()});
    }
    writer.close();
    const auto expected = lines_of_python(kRosbag, file);
    const auto recording = open_recording(file);
    if (expected) expect_same(lines_of(*recording), *expected);
    fs::remove(file);
    if (!expected) GTEST_SKIP() << "no python3-rosbag to compare with";
  }
}

}  // namespace
}  // namespace roslam
