// SPDX-License-Identifier: BSD-3-Clause
// Folders and databases of rosbag2.
#include <gtest/gtest.h>

#include <fstream>

#include "roslam/common/error.hpp"
#include "roslam/recordings/recording.hpp"
#include "tests/recording_writers.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

class Rosbag2 : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  // Messages of one topic at these times; each holds its time as text.
  template <typename Writer>
  void write(const std::string& name, const std::vector<int>& times, const std::string& topic = "/t",
             typename Writer::Options options = {}) {
    Writer writer(folder_ / name, options);
    const int id = writer.add_topic(topic, "std_msgs/msg/String", "string data");
    for (const int time : times) {
      const std::string text = std::to_string(time);
      writer.write(id, time, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    }
    writer.close();
  }

  void write_metadata(const std::vector<std::string>& files) {
    std::ofstream out(folder_ / "metadata.yaml");
    out << "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n";
    for (const auto& file : files) out << "    - " << file << "\n";
  }

  static std::vector<int> times_of(Recording& recording) {
    std::vector<int> times;
    while (const auto message = recording.next()) {
      times.push_back(static_cast<int>(message->time));
      EXPECT_EQ(std::string(message->data.begin(), message->data.end()), std::to_string(message->time));
    }
    return times;
  }

  static std::string error_of(const fs::path& path) {
    try {
      open_recording(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }

  const fs::path folder_ = scratch_path();
};

TEST_F(Rosbag2, FilesOfAFolderAreReadOneAfterAnother) {
  std::vector<int> expected;
  for (int part = 0; part < 12; ++part) {
    write<Db3Writer>("flight_" + std::to_string(part) + ".db3", {10 * part, 10 * part + 5},
                     part == 3 ? "/other" : "/t");
    expected.insert(expected.end(), {10 * part, 10 * part + 5});
  }
  ASSERT_TRUE(is_recording(folder_));
  const auto recording = open_recording(folder_);
  EXPECT_EQ(recording->container(), "rosbag2 SQLite");
  ASSERT_EQ(recording->topics().size(), 2u);
  EXPECT_EQ(recording->topics()[0].messages, 22u);
  EXPECT_EQ(recording->time_range(), std::pair(std::int64_t{0}, std::int64_t{115}));
  EXPECT_EQ(times_of(*recording), expected);
  recording->select({1});
  EXPECT_EQ(times_of(*recording), (std::vector<int>{30, 35}));
  EXPECT_TRUE(recording->notes().empty());
}

TEST_F(Rosbag2, MetadataSaysWhichFilesAndInWhichOrder) {
  write<TestMcapWriter>("b.mcap", {1, 2});
  write<TestMcapWriter>("a.mcap", {3, 4});
  write<TestMcapWriter>("stray.mcap", {9});
  write_metadata({"folder/b.mcap", "a.mcap.zstd", "missing.mcap"});  // the second was unpacked by hand
  const auto recording = open_recording(folder_);
  EXPECT_EQ(times_of(*recording), (std::vector<int>{1, 2, 3, 4}));
  EXPECT_EQ(recording->notes(),
            (std::map<std::string, std::size_t>{{"file that metadata.yaml lists is missing", 1}}));
  std::ofstream(folder_ / "metadata.yaml") << "rosbag2_bagfile_information: [";
  EXPECT_EQ(times_of(*open_recording(folder_)), (std::vector<int>{3, 4, 1, 2, 9}));
}

TEST_F(Rosbag2, AFileCompressedAsAWholeIsRefusedWithTheRemedy) {
  write<Db3Writer>("x.db3", {1});
  std::ifstream in(folder_ / "x.db3", std::ios::binary);
  std::ofstream(folder_ / "x.db3.zstd", std::ios::binary)
      << compressed("zstd", {std::istreambuf_iterator<char>(in), {}});
  fs::remove(folder_ / "x.db3");
  EXPECT_TRUE(is_recording(folder_ / "x.db3.zstd"));
  EXPECT_NE(error_of(folder_ / "x.db3.zstd").find("unpack it with zstd -d"), std::string::npos);
  write_metadata({"x.db3.zstd"});
  EXPECT_NE(error_of(folder_).find("unpack it with zstd -d"), std::string::npos);
}

TEST_F(Rosbag2, ReadingWritesNothingBesideTheDatabase) {
  write<Db3Writer>("x.db3", {1, 2});
  std::ofstream(folder_ / "x.db3-wal") << "what a crash left";
  fs::permissions(folder_, fs::perms::owner_write, fs::perm_options::remove);
  const auto recording = open_recording(folder_ / "x.db3");
  EXPECT_EQ(times_of(*recording), (std::vector<int>{1, 2}));
  ASSERT_EQ(recording->notes().size(), 1u);
  EXPECT_TRUE(recording->notes().begin()->first.starts_with("a crash left a journal (-wal)"));
  fs::permissions(folder_, fs::perms::owner_write, fs::perm_options::add);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2);
}

TEST_F(Rosbag2, NamesOfFilesAreTakenAsTheyAre) {
  const std::string name = "50% of a? #1 & \xc3\xa4.db3";
  write<Db3Writer>(name, {7});
  EXPECT_EQ(times_of(*open_recording(folder_ / name)), std::vector<int>{7});
}

TEST_F(Rosbag2, OtherFilesAreRefused) {
  EXPECT_FALSE(is_recording(folder_));
  EXPECT_NE(error_of(folder_).find("not a recording"), std::string::npos);
  EXPECT_NE(error_of(folder_ / "none.bag").find("no such file"), std::string::npos);
  std::ofstream(folder_ / "old.bag") << "#ROSBAG V1.2\n and more";
  EXPECT_NE(error_of(folder_ / "old.bag").find("rosbag fix"), std::string::npos);
  std::ofstream(folder_ / "text.bag") << "hello";
  EXPECT_FALSE(is_recording(folder_ / "text.bag"));
  // A database of something else, and one whose messages are a program without end.
  {
    Db3Writer writer(folder_ / "view.db3");
    writer.run("DROP TABLE messages");
    writer.run(
        "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) "
        "SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data FROM n");
    writer.close();
  }
  EXPECT_NE(error_of(folder_ / "view.db3").find("without the tables"), std::string::npos);
}

TEST_F(Rosbag2, ADamagedMessageIsLeftOut) {
  Db3Writer writer(folder_ / "x.db3", {.compresses_messages = true});
  const int topic = writer.add_topic("/t", "std_msgs/msg/String", "");
  const std::string text = "1";
  writer.write(topic, 1, {reinterpret_cast<const std::uint8_t*>(text.data()), 1});
  writer.run("INSERT INTO messages VALUES (2, 1, 2, x'28b52ffd60ffffffff')");  // claims to be long
  writer.run("INSERT INTO messages VALUES (3, 1, 'noon', x'00')");
  writer.run("INSERT INTO messages VALUES (4, 99, 4, x'00')");
  writer.close();
  const auto recording = open_recording(folder_ / "x.db3");
  EXPECT_EQ(times_of(*recording), std::vector<int>{1});
  std::size_t left_out = 0;
  for (const auto& [what, count] : recording->notes()) left_out += count;
  EXPECT_EQ(left_out, 3u);
}

}  // namespace
}  // namespace roslam
