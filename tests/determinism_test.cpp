// SPDX-License-Identifier: BSD-3-Clause
// The same input gives the same bytes.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/street.hpp"

namespace roslam::street {
namespace {

class Deterministic : public Dataset {
 protected:
  // Runs twice and compares all results but run.json, which holds times.
  void expect_same_bytes(const fs::path& data, const std::string& camera) const {
    for (const char* out : {"one", "two"}) {
      const Outcome outcome = run_program("run '" + data.string() + "' --quiet --deterministic --camera " +
                                              camera + " --out '" + (scratch_ / out).string() + "'",
                                          scratch_);
      ASSERT_EQ(outcome.code, 0) << outcome.error;
    }
    for (const char* file :
         {"trajectory.txt", "keyframes.txt", "map.ply", "dense.ply", "dense.bt", "trajectory.png"}) {
      const std::string bytes = content(scratch_ / "one" / file);
      EXPECT_GT(bytes.size(), 100u) << file;
      EXPECT_TRUE(bytes == content(scratch_ / "two" / file)) << file << " differs";
    }
  }
};

TEST_F(Deterministic, OnASimulatedFlight) {
  make(kBeforeGap);
  expect_same_bytes(data_, "simulated");
}

TEST_F(Deterministic, OnARecordedSequence) {
  const fs::path recorded = fs::path(ROSLAM_TEST_DATA) / "slam/fr1_rpy";
  if (!fs::exists(recorded / "rgb.txt")) GTEST_SKIP() << recorded << " is not there";
  fs::remove_all(data_);
  fs::create_directories(data_);
  constexpr int kLines = 103;  // three of comments, a hundred images
  for (const char* list : {"rgb.txt", "depth.txt"}) {
    std::ifstream in(recorded / list);
    std::string line;
    std::string text;
    for (int i = 0; i < kLines && std::getline(in, line); ++i) text += line + "\n";
    put(data_ / list, text);
  }
  for (const char* images : {"rgb", "depth"})
    fs::create_directory_symlink(fs::canonical(recorded / images), data_ / images);
  expect_same_bytes(data_, "tum-fr1");
}

}  // namespace
}  // namespace roslam::street
