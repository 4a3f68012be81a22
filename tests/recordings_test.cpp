// SPDX-License-Identifier: BSD-3-Clause
// Recordings written here are read: all containers, compressions and orders of chunks; cut and damaged files.
#include "roslam/recordings/recording.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <random>

#include "roslam/common/error.hpp"
#include "tests/recording_writers.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kStart = 1'700'000'000'123'456'789;

struct Message {
  std::string topic;
  std::int64_t time;
  std::string data;
  bool operator==(const Message&) const = default;
};

std::vector<Message> read_all(Recording& recording) {
  std::vector<Message> messages;
  while (const auto message = recording.next()) {
    messages.push_back({recording.topics().at(static_cast<std::size_t>(message->topic)).name, message->time,
                        std::string(message->data.begin(), message->data.end())});
  }
  return messages;
}

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

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string bytes_of_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void put(const fs::path& file, std::string_view bytes) { std::ofstream(file, std::ios::binary) << bytes; }

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
      McapOptions options(method);
      options.chunk_bytes = 5000;
      options.has_summary = has_summary;
      options.has_crcs = method != "lz4";
      all.push_back(
          {"mcap_" + method + (has_summary ? "" : "_bare"), "sensor_msgs/msg/Image",
           [options](const fs::path& file) { return std::make_unique<McapWriter>(file, options); }});
    }
  }
  for (const bool has_summary : {true, false}) {
    McapOptions options;
    options.has_chunks = false;
    options.has_summary = has_summary;
    all.push_back({has_summary ? "mcap_unchunked" : "mcap_unchunked_bare", "sensor_msgs/msg/Image",
                   [options](const fs::path& file) { return std::make_unique<McapWriter>(file, options); }});
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
    write_chunks<McapWriter>(chunks, closes);
    EXPECT_EQ(times_and_numbers(), expected) << closes;
  }
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
    McapWriter writer(file_, McapOptions(method));
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
  write_chunks<McapWriter>({{10, 30}, {20, 40}});
  std::string bytes = bytes_of_file(file_);
  const std::string loose = McapWriter::record(
      0x05, McapWriter::bits(std::uint16_t{0}) + McapWriter::bits(std::uint32_t{9}) +
                McapWriter::bits(std::uint64_t{25}) + McapWriter::bits(std::uint64_t{25}) + "77");
  const std::string data_end = McapWriter::record(0x0f, McapWriter::bits(std::uint32_t{0}));
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

std::size_t resident_kilobytes(const char* field) {
  std::ifstream in("/proc/self/status");
  std::string word;
  while (in >> word) {
    std::size_t value = 0;
    if (word == field && in >> value) return value;
  }
  return 0;
}

// Peak memory over what the process had before.
template <typename Writer>
void expect_bounded_memory(const fs::path& file, typename Writer::Options options, bool closes) {
  constexpr int kMessages = 400;
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

TEST_F(RecordingChunks, MemoryDoesNotGrowWithTheFile) {
  expect_bounded_memory<BagWriter>(file_, {"lz4"}, true);
  expect_bounded_memory<BagWriter>(file_, {"none"}, false);
  McapOptions unchunked;
  unchunked.has_chunks = false;
  expect_bounded_memory<McapWriter>(file_, McapOptions("zstd"), true);
  expect_bounded_memory<McapWriter>(file_, unchunked, true);
  expect_bounded_memory<Db3Writer>(file_, {.has_time_index = false}, true);
}

}  // namespace
}  // namespace roslam
