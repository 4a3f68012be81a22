// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

namespace roslam {

/// A temporary path unique to the test and the process, as tests run in parallel.
inline std::filesystem::path scratch_path(const std::string& extension = "") {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::string name =
      std::string("roslam_") + test->test_suite_name() + "_" + test->name() + "_" + std::to_string(getpid());
  std::replace(name.begin(), name.end(), '/', '_');
  return std::filesystem::path(testing::TempDir()) / (name + extension);
}

}  // namespace roslam
