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

// Nothing is decided by a clock: the process is stopped in the middle of labelling for longer than the
// network may take in real time, has the lowest priority, and shares the processor with four others.
TEST_F(Deterministic, WhateverElseTheMachineDoes) {
  make(16);
  put(scratch_ / "config.yaml", "threads:\n  segmentation_timeout: 1.0\n");
  const auto command = [&](const char* out) {
    return "'" ROSLAM_PROGRAM "' run '" + data_.string() +
           "' --quiet --no-dense --camera simulated --config '" + (scratch_ / "config.yaml").string() +
           "' --out '" + (scratch_ / out).string() + "' >/dev/null 2>&1";
  };
  ASSERT_EQ(std::system(command("calm").c_str()), 0);
  put(scratch_ / "run.sh", "exec " + command("disturbed") + "\n");  // keeps its process id
  put(scratch_ / "disturb.sh",
      "for i in 1 2 3 4; do timeout 10 sh -c 'while :; do :; done' & busy=\"$busy $!\"; done\n"
      "nice -n 19 sh \"$1\" & run=$!\n"
      "for i in 1 2 3; do sleep 1.5; kill -STOP $run; sleep 1.5; kill -CONT $run; done\n"
      "wait $run; code=$?; kill $busy; exit $code\n");
  ASSERT_EQ(std::system(("sh '" + (scratch_ / "disturb.sh").string() + "' '" +
                         (scratch_ / "run.sh").string() + "' >/dev/null 2>&1")
                            .c_str()),
            0);
  for (const char* file : {"trajectory.txt", "keyframes.txt", "map.ply", "map.roslam", "descriptors.jsonl"}) {
    const std::string bytes = content(scratch_ / "calm" / file);
    EXPECT_GT(bytes.size(), 100u) << file;
    EXPECT_TRUE(bytes == content(scratch_ / "disturbed" / file)) << file << " differs";
  }
}

}  // namespace
}  // namespace roslam::street
