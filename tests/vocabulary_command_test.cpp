// SPDX-License-Identifier: BSD-3-Clause
// `roslam vocabulary train` and `roslam run --vocabulary`: what they write, and what bad input they refuse.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/place_recognition/vocabulary.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

class VocabularyCommand : public testing::Test {
 protected:
  VocabularyCommand() : folder_(scratch_path()) { fs::create_directories(folder_ / "in"); }
  ~VocabularyCommand() override { fs::remove_all(folder_); }

  Outcome train(const std::string& arguments) {
    return shell_in(folder_, std::string(ROSLAM_PROGRAM) + " vocabulary train " + arguments);
  }

  void put_images(unsigned count) {
    for (unsigned seed = 0; seed < count; ++seed) {
      std::mt19937 random(seed);
      cv::Mat image(240, 320, CV_8UC3, cv::Scalar::all(128));
      for (int i = 0; i < 300; ++i) {
        const cv::Point corner(static_cast<int>(random() % 320), static_cast<int>(random() % 240));
        cv::rectangle(image, cv::Rect(corner, cv::Size(12, 9)),
                      cv::Scalar::all(static_cast<int>(random() % 256)), cv::FILLED);
      }
      cv::imwrite((folder_ / "in" / (std::to_string(seed) + ".png")).string(), image);
    }
  }

  static void expect_one_error(const Outcome& outcome, const std::string& part, int code = 1) {
    EXPECT_EQ(outcome.code, code) << outcome.error;
    EXPECT_NE(outcome.error.find(part), std::string::npos) << outcome.error;
    if (code == 1) {
      EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    }
  }

  fs::path folder_;
};

TEST_F(VocabularyCommand, MakesTheSameFileFromTheSameImages) {
  put_images(6);
  const Outcome outcome = train("in --out words --branching 5 --depth 3 --json --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const auto summary = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(summary["images"], 6);
  EXPECT_GT(summary["descriptors"], 1000);
  EXPECT_EQ(Vocabulary::load(folder_ / "words").words(), summary["words"]);
  EXPECT_LE(summary["words"], 125);
  ASSERT_EQ(train("in --out again --branching 5 --depth 3 --quiet").code, 0);
  EXPECT_EQ(content(folder_ / "words"), content(folder_ / "again"));
  ASSERT_EQ(train("in --out other --branching 5 --depth 3 --seed 2 --quiet").code, 0);
  EXPECT_NE(content(folder_ / "words"), content(folder_ / "other"));
}

TEST_F(VocabularyCommand, NamesWhatIsWrongWithItsInput) {
  expect_one_error(train("missing --out words"), "missing");
  expect_one_error(train("in --out words"), "in");
  cv::imwrite((folder_ / "in/grey.png").string(), cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(90)));
  expect_one_error(train("in --out words --quiet"), "too few corners");
  EXPECT_FALSE(fs::exists(folder_ / "words"));
  put_images(2);
  expect_one_error(train("in --out no/such/folder/words --quiet"), "no/such/folder/words");
  expect_one_error(train("in --out words --branching 60 --depth 8 --quiet"), "million");
  expect_one_error(train("in --out words --branching 1"), "--branching", 2);
  expect_one_error(train("in"), "--out", 2);
}

TEST_F(VocabularyCommand, RunRefusesAVocabularyThatIsNone) {
  const auto run = [&](const std::string& arguments) {
    return shell_in(folder_, std::string(ROSLAM_PROGRAM) +
                                 " run simulated:street --frames 3 --dynamic none --quiet --out run " +
                                 arguments);
  };
  expect_one_error(run("--vocabulary missing"), "missing: no such file");
  write_file(folder_ / "text", "these are words, but not the right ones");
  expect_one_error(run("--vocabulary text"), "text: not a vocabulary of RO-SLAM");
  put_images(2);
  ASSERT_EQ(train("in --out words --branching 5 --depth 2 --quiet").code, 0);
  std::string damaged = content(folder_ / "words");
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
  write_file(folder_ / "damaged", damaged);
  expect_one_error(run("--vocabulary damaged"), "damaged: damaged, its checksum");
  expect_one_error(run("--vocabulary words --no-loops"), "--vocabulary", 2);
  EXPECT_EQ(run("--vocabulary words").code, 0);
}

}  // namespace
}  // namespace roslam
