// SPDX-License-Identifier: BSD-3-Clause
// Binary files: round trip, and rejection of damaged files.
#include "roslam/common/binary.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

constexpr BinaryFormat kFormat{"ROSLAMTE", 3, "a test file", 1000};

class Binary : public testing::Test {
 protected:
  ~Binary() override { std::filesystem::remove_all(file_); }

  std::string bytes() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  std::string error_of(std::string_view bytes) const {
    try {
      check_binary(bytes, kFormat, "test.bin");
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }

  const std::filesystem::path file_ = scratch_path(".bin");
};

TEST_F(Binary, ValuesComeBackInTheirOrder) {
  BinaryWriter writer;
  writer.put(std::uint8_t{7});
  writer.put(-1.5F);
  writer.put_text("words");
  writer.put(0.1);
  writer.put(std::uint64_t{1} << 63);
  EXPECT_EQ(writer.bytes().size(), 1U + 4 + 9 + 8 + 8);
  EXPECT_EQ(writer.bytes().substr(5, 4), std::string("\5\0\0\0", 4)) << "little-endian";
  BinaryReader reader(writer.bytes(), "test.bin");
  EXPECT_EQ(reader.get<std::uint8_t>(), 7);
  EXPECT_EQ(reader.get<float>(), -1.5F);
  EXPECT_EQ(reader.get_text(), "words");
  EXPECT_EQ(reader.get<double>(), 0.1);
  EXPECT_EQ(reader.get<std::uint64_t>(), std::uint64_t{1} << 63);
  EXPECT_EQ(reader.left(), 0U);
  EXPECT_THROW(reader.get<std::uint8_t>(), InputError);
}

TEST_F(Binary, NeverCountsMoreItemsThanFit) {
  BinaryWriter writer;
  writer.put(std::uint32_t{3});
  writer.put_bytes(std::string(11, 'x'));
  EXPECT_EQ(BinaryReader(writer.bytes(), "").get_count(3), 3U);
  EXPECT_THROW(BinaryReader(writer.bytes(), "").get_count(4), InputError);
}

TEST_F(Binary, EveryFlippedByteAndEveryTruncationIsNoticed) {
  write_binary(file_, kFormat, "what the file holds");
  EXPECT_EQ(read_binary(file_, kFormat), "what the file holds");
  const std::string good = bytes();
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int bit : {1, 128}) {
      std::string bad = good;
      bad[i] = static_cast<char>(bad[i] ^ bit);
      EXPECT_NE(error_of(bad), "") << i;
    }
    EXPECT_NE(error_of(good.substr(0, i)), "") << i;
  }
  EXPECT_NE(error_of(good + "x"), "");
  EXPECT_EQ(error_of(good), "");
}

TEST_F(Binary, SaysWhatIsWrong) {
  const auto expect_error = [](const std::string& error, const std::string& part) {
    EXPECT_NE(error.find(part), std::string::npos) << error;
    EXPECT_EQ(error.find("test.bin: "), 0U) << error;
  };
  write_binary(file_, kFormat, "what the file holds");
  const std::string good = bytes();
  expect_error(error_of(""), "empty");
  expect_error(error_of("a text that is something else"), "not a test file of RO-SLAM");
  std::string other = good;
  other[8] = 9;
  expect_error(error_of(other), "version 9");
  other = good;
  other.back() = 'x';
  expect_error(error_of(other), "checksum");
  expect_error(error_of(good.substr(0, good.size() - 1)), "long");
}

TEST_F(Binary, RefusesWhatIsMissingOrTooLargeUnread) {
  EXPECT_THROW(read_binary(file_, kFormat), InputError);
  EXPECT_THROW(read_binary(testing::TempDir(), kFormat), InputError);
  write_file(file_, "");
  std::filesystem::resize_file(file_, std::uintmax_t{3} << 30);  // sparse
  EXPECT_THROW(read_binary(file_, kFormat), InputError);
}

TEST_F(Binary, AFailedWriteLeavesTheOldFileAndNoOther) {
  write_binary(file_, kFormat, "old");
  std::filesystem::path part = file_;
  part += ".part";
  std::filesystem::create_directory(part);  // cannot be opened for writing
  EXPECT_THROW(write_binary(file_, kFormat, "new"), OutputError);
  EXPECT_EQ(read_binary(file_, kFormat), "old");
  std::filesystem::remove(part);
  write_binary(file_, kFormat, "new");
  EXPECT_EQ(read_binary(file_, kFormat), "new");
  EXPECT_FALSE(std::filesystem::exists(part));
}

}  // namespace
}  // namespace roslam
