// SPDX-License-Identifier: BSD-3-Clause
// Chunks of recordings: their order, what is damaged or absurd in them, and the memory that reading takes.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <random>

#include "roslam/common/error.hpp"
#include "tests/recorded_messages.hpp"
#include "tests/recording_writers.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

std::size_t resident_kilobytes(const char* field) {
  std::ifstream in("/proc/self/status");
  std::string word;
  while (in >> word) {
    std::size_t value = 0;
    if (word == field && in >> value) return value;
  }
  return 0;
}

class RecordingChunks : public testing::Test {
 protected:
  void TearDown() override { fs::remove_all(file_); }

  // Chunk after chunk, each of messages at these times.
  template <typename Writer>
  void write_chunks(const std::vector<std::vector<int>>& chunks, bool closes = true) {
    Writer writer(file_);
    const int topic = writer.add_topic("/t", "std_msgs/String", "string data");
    for (const auto& times : chunks) {
      for (const int time : times) writer.write(topic, time, bytes_of(std::to_string(number_++)));
      writer.end_chunk();
    }
    if (closes) writer.close();
  }

  std::vector<std::pair<int, int>> times_and_numbers() {
    const auto recording = open_recording(file_);
    std::vector<std::pair<int, int>> read;
    for (const Message& message : read_all(*recording))
      read.emplace_back(static_cast<int>(message.time), std::stoi(message.data));
    return read;
  }

  const fs::path file_ = scratch_path();
  int number_ = 0;
};

TEST_F(RecordingChunks, OverlappingAndUnsortedChunksAreMerged) {
  const std::vector<std::vector<int>> chunks{{50, 40, 60}, {10, 55, 20}, {}, {5, 100}, {20, 20}, {40, 60}};
  // Of equal times, the one that is first in the file.
  const std::vector<std::pair<int, int>> expected{{5, 6},   {10, 3}, {20, 5}, {20, 8}, {20, 9},  {40, 1},
                                                  {40, 10}, {50, 0}, {55, 4}, {60, 2}, {60, 11}, {100, 7}};
  for (const bool closes : {true, false}) {
    number_ = 0;
    write_chunks<BagWriter>(chunks, closes);
    EXPECT_EQ(times_and_numbers(), expected) << closes;
    number_ = 0;
    write_chunks<TestMcapWriter>(chunks, closes);
    EXPECT_EQ(times_and_numbers(), expected) << closes;
  }
}

// A chunk that begins earlier than the index says comes too late; nothing is lost.
TEST_F(RecordingChunks, AnIndexWithWrongTimesIsNoted) {
  write_chunks<BagWriter>({{10, 30}, {20, 40}});
  std::string bytes = bytes_of_file(file_);
  const std::string name = "start_time=";
  const std::uint64_t later = std::uint64_t{35} << 32U;
  std::memcpy(&bytes[bytes.rfind(name) + name.size()], &later, 8);
  put(file_, bytes);
  const auto recording = open_recording(file_);
  std::vector<std::int64_t> times;
  for (const Message& message : read_all(*recording)) times.push_back(message.time);
  EXPECT_EQ(times, (std::vector<std::int64_t>{10, 30, 20, 40}));
  EXPECT_EQ(recording->notes(),
            (std::map<std::string, std::size_t>{{"message is earlier than the one before it", 1}}));
}

// Chunks that overlap and have 400 MB together: their order is given up, not the limit of memory.
TEST_F(RecordingChunks, MemoryIsBoundedWhereAllChunksOverlap) {
  constexpr int kChunks = 20;
  {
    BagWriter writer(file_, {"lz4", std::size_t{64} << 20});
    const int topic = writer.add_topic("/t", "std_msgs/String", "");
    const std::string large(20 << 20, 'x');
    for (int i = 0; i < kChunks; ++i) {
      writer.write(topic, i, bytes_of(large));
      writer.write(topic, 1000 + i, bytes_of("end"));
      writer.end_chunk();
    }
    writer.close();
  }
  std::ofstream("/proc/self/clear_refs") << 5;  // begins the peak anew
  const std::size_t before = resident_kilobytes("VmRSS:");
  const auto recording = open_recording(file_);
  std::size_t count = 0;
  while (recording->next()) ++count;
  EXPECT_EQ(count, 2u * kChunks);
  EXPECT_LT(resident_kilobytes("VmHWM:"), before + 330 * 1024);
  EXPECT_GT(recording->notes().count("chunk read late, as those that overlap it have more than 256 MB"), 0u);
}

TEST_F(RecordingChunks, SeveralPublishersOfATopicAreOne) {
  BagWriter writer(file_);
  const int first = writer.add_topic("/tf", "tf2_msgs/TFMessage", "");
  const int second = writer.add_topic("/tf", "tf2_msgs/TFMessage", "");
  const int other = writer.add_topic("/tf", "tf/tfMessage", "");
  for (const int topic : {first, second, other, second}) writer.write(topic, topic, bytes_of("x"));
  writer.close();
  const auto recording = open_recording(file_);
  ASSERT_EQ(recording->topics().size(), 2u);
  EXPECT_EQ(recording->topics()[0].messages, 3u);
  EXPECT_EQ(recording->topics()[1].type, "tf/tfMessage");
  recording->select({0});
  EXPECT_EQ(read_all(*recording).size(), 3u);
}

TEST_F(RecordingChunks, ADamagedChunkIsLeftOutAndCounted) {
  for (const std::string method : {"none", "lz4", "zstd"}) {
    TestMcapWriter writer(file_, TestMcapOptions(method));
    const int topic = writer.add_topic("/t", "std_msgs/msg/String", "");
    for (int i = 0; i < 3; ++i) {
      writer.write(topic, i, bytes_of("chunk " + std::to_string(i) + std::string(100, 'x')));
      writer.end_chunk();
    }
    writer.close();
    std::string bytes = bytes_of_file(file_);
    bytes[bytes.find("chunk 1") + 3] ^= 1;  // a literal of the compressed data
    put(file_, bytes);
    const auto recording = open_recording(file_);
    const auto messages = read_all(*recording);
    ASSERT_EQ(messages.size(), 2u) << method;
    EXPECT_EQ(messages[1].data.substr(0, 7), "chunk 2");
    EXPECT_EQ(recording->notes(), (std::map<std::string, std::size_t>{{"damaged chunk, left out", 1}}));
  }
}

// Messages between chunks are not in the index of chunks.
TEST_F(RecordingChunks, MessagesBesideTheChunksOfAnMcapFileAreFound) {
  write_chunks<TestMcapWriter>({{10, 30}, {20, 40}});
  std::string bytes = bytes_of_file(file_);
  const std::string loose =
      TestMcapWriter::record(0x05, bits(std::uint16_t{0}) + bits(std::uint32_t{9}) + bits(std::uint64_t{25}) +
                                       bits(std::uint64_t{25}) + "77");
  const std::string data_end = TestMcapWriter::record(0x0f, bits(std::uint32_t{0}));
  // The summary moves, and its checksum is no longer known.
  const std::size_t at = bytes.find(data_end);
  const std::size_t footer = bytes.size() - 8 - 20;
  std::uint64_t summary = 0;
  std::memcpy(&summary, &bytes[footer], 8);
  summary += loose.size();
  std::memcpy(&bytes[footer], &summary, 8);
  std::memset(&bytes[footer + 16], 0, 4);
  bytes.insert(at, loose);
  put(file_, bytes);
  EXPECT_EQ(times_and_numbers(),
            (std::vector<std::pair<int, int>>{{10, 0}, {20, 2}, {25, 77}, {30, 1}, {40, 3}}));
  EXPECT_TRUE(open_recording(file_)->notes().empty());
}

// A chunk that claims to unpack to nearly 4 GB, and one to as much as its claim allows: memory is not taken.
TEST_F(RecordingChunks, AnAbsurdSizeIsLeftOut) {
  for (const std::string method : {"none", "lz4", "bz2"}) {
    BagWriter writer(file_, {method});
    const int topic = writer.add_topic("/t", "std_msgs/String", "");
    writer.write(topic, 1, bytes_of("first"));
    writer.end_chunk();
    writer.write(topic, 2, bytes_of("second"));
    writer.close();
    std::string bytes = bytes_of_file(file_);
    const std::string name("size=", 5);
    const std::uint32_t claimed = 0xfffffff0;
    std::memcpy(&bytes[bytes.find(name) + name.size()], &claimed, 4);
    put(file_, bytes);
    const auto recording = open_recording(file_);
    const auto messages = read_all(*recording);
    ASSERT_EQ(messages.size(), 1u) << method;
    EXPECT_EQ(messages[0].data, "second");
    EXPECT_EQ(recording->notes().count("chunk with an implausible size, left out"), 1u);
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 1 << 20) << "kB";
}

// Peak memory over what the process had before.
template <typename Writer>
void expect_bounded_memory(const fs::path& file, typename Writer::Options options, bool closes) {
  constexpr int kMessages = 400;
  constexpr std::int64_t kStart = 1'700'000'000'123'456'789;
  std::string image(512 * 1024, '\0');
  std::mt19937 random(1);
  for (std::size_t i = 0; i < image.size(); i += 4) {
    const auto bits = random();
    std::memcpy(&image[i], &bits, 4);
  }
  {
    Writer writer(file, options);
    const int topic = writer.add_topic("/image", "sensor_msgs/Image", "");
    for (int i = 0; i < kMessages; ++i) writer.write(topic, kStart + i * 1000, bytes_of(image));
    if (closes) writer.close();
  }
  ASSERT_GT(fs::file_size(file), std::uintmax_t{200} << 20);
  std::ofstream("/proc/self/clear_refs") << 5;  // begins the peak anew
  const std::size_t before = resident_kilobytes("VmRSS:");
  const auto recording = open_recording(file);
  int count = 0;
  while (const auto message = recording->next())
    count += std::equal(message->data.begin(), message->data.end(), bytes_of(image).begin()) ? 1 : 0;
  EXPECT_EQ(count, kMessages);
  ASSERT_GT(before, 0u);
  EXPECT_LT(resident_kilobytes("VmHWM:"), before + 100 * 1024);
}

// The summary lists a chunk inside of the first record, whose size leads back to where it begins.
TEST_F(RecordingChunks, ASummaryThatPointsIntoAnotherRecordEnds) {
  TestMcapOptions options("");
  options.has_crcs = false;
  TestMcapWriter writer(file_, options);
  writer.write(writer.add_topic("/a", "std_msgs/msg/String", ""), 1000, std::vector<std::uint8_t>(20, 7));
  writer.close();
  std::fstream bytes(file_, std::ios::in | std::ios::out | std::ios::binary);
  const auto get = [&](std::uint64_t at) {
    std::uint64_t value = 0;
    bytes.seekg(static_cast<std::streamoff>(at));
    bytes.read(reinterpret_cast<char*>(&value), sizeof(value));
    return value;
  };
  const auto put = [&](std::uint64_t at, std::uint64_t value) {
    bytes.seekp(static_cast<std::streamoff>(at));
    bytes.write(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  const std::uint64_t size = fs::file_size(file_);
  std::uint64_t at = get(size - 8 - 20);  // where the summary begins
  while (at < size && (get(at) & 0xffU) != 8) at += 9 + get(at + 1);
  ASSERT_LT(at, size) << "no index of a chunk";
  put(at + 9 + 16, 13);          // where the chunk begins
  put(9, 0 - std::uint64_t{9});  // size of the header
  bytes.close();
  const auto recording = open_recording(file_);
  while (recording->next()) {
  }
  EXPECT_FALSE(recording->notes().empty());
}

TEST_F(RecordingChunks, MemoryDoesNotGrowWithTheFile) {
  expect_bounded_memory<BagWriter>(file_, {"lz4"}, true);
  expect_bounded_memory<BagWriter>(file_, {"none"}, false);
  TestMcapOptions unchunked;
  unchunked.has_chunks = false;
  expect_bounded_memory<TestMcapWriter>(file_, TestMcapOptions("zstd"), true);
  expect_bounded_memory<TestMcapWriter>(file_, unchunked, true);
  expect_bounded_memory<Db3Writer>(file_, {.has_time_index = false}, true);
}

}  // namespace
}  // namespace roslam
