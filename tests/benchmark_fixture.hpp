// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {

/// Runs the program in a temporary folder of the test.
class BenchmarkTest : public testing::Test {
 protected:
  const std::filesystem::path folder_ = scratch_path();

  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Outcome shell(const std::string& command) const { return shell_in(folder_, command); }
  Outcome roslam(const std::string& arguments) const { return shell("'" ROSLAM_PROGRAM "' " + arguments); }

  /// Expects exit code 1, nothing on stdout and one line with these words on stderr.
  void expect_refused(const std::string& arguments, const std::string& words) const {
    const auto result = roslam(arguments);
    EXPECT_EQ(result.code, 1) << arguments;
    EXPECT_NE(result.error.find(words), std::string::npos) << arguments << " -> " << result.error;
    EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1) << result.error;
    EXPECT_EQ(result.out, "") << arguments;
  }
};

}  // namespace roslam
