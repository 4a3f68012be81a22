// SPDX-License-Identifier: BSD-3-Clause
// Output that nobody reads.
#include <gtest/gtest.h>

#include <string>

#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

class Usage : public testing::Test {
 protected:
  Usage() { fs::create_directories(folder_); }
  ~Usage() override { fs::remove_all(folder_); }

  Outcome roslam(const std::string& arguments, const std::string& before = "") const {
    return shell_in(folder_, before + " '" ROSLAM_PROGRAM "' " + arguments);
  }

  const fs::path folder_ = scratch_path();
};

TEST_F(Usage, AReaderThatLeavesIsNoFailure) {
  // The exit code of the program, which writes more than a pipe holds or after its reader has left.
  const auto code_of = [&](const std::string& arguments, const std::string& to) {
    shell_in(folder_, "(sleep 0.05; '" ROSLAM_PROGRAM "' " + arguments + "; echo $? >code) " + to);
    return content(folder_ / "code");
  };
  for (const std::string arguments : {"--help", "run --help", "--version"}) {
    EXPECT_EQ(code_of(arguments, "| true"), "0\n") << arguments;
    EXPECT_EQ(code_of(arguments, "2>&1 | true"), "0\n") << arguments;
  }
  EXPECT_EQ(code_of("run --print-config", "| true"), "0\n");
  EXPECT_EQ(code_of("rnu", "2>&1 | true"), "2\n");
  EXPECT_EQ(code_of("map info none.roslam", "2>&1 | true"), "1\n");
  EXPECT_EQ(code_of("run --print-config >&- 2>&-", ""), "0\n");
}

TEST_F(Usage, OutputThatIsFullIsAFailure) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  for (const char* arguments : {"--help", "--version", "run --help", "run --print-config"}) {
    const Outcome outcome = roslam(std::string(arguments) + " >/dev/full; echo $?; }", "{");
    EXPECT_EQ(outcome.out, "1\n") << arguments;
    EXPECT_NE(outcome.error.find("stdout"), std::string::npos) << arguments << ": " << outcome.error;
  }
}

}  // namespace
}  // namespace roslam
