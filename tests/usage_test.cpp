// SPDX-License-Identifier: BSD-3-Clause
// Help, wrong usage, and output that nobody reads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

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

  static std::vector<std::string> lines_of(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

  // All commands, with the commands below them.
  std::vector<std::string> commands(const std::string& above = "") const {
    std::vector<std::string> all{above};
    bool are_listed = false;
    for (const auto& line : lines_of(roslam(above + " --help", "COLUMNS=120").out)) {
      if (line == "Subcommands:") are_listed = true;
      if (line.empty()) are_listed = false;
      if (!are_listed || line.size() < 3 || line[1] != ' ' || line[2] == ' ') continue;
      const auto below = commands(above + " " + line.substr(2, line.find(' ', 2) - 2));
      all.insert(all.end(), below.begin(), below.end());
    }
    return all;
  }

  // Without the spaces and backslashes at which lines are broken.
  static std::string letters(std::string text) {
    std::erase_if(text, [](unsigned char c) { return std::isspace(c) || c == '\\'; });
    return text;
  }

  void expect_one_line(const std::string& arguments, const std::string& words) const {
    const Outcome outcome = roslam(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_EQ(outcome.out, "") << arguments;
    EXPECT_NE(outcome.error.find(words), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }

  const fs::path folder_ = scratch_path();
};

TEST_F(Usage, HelpFitsTheTerminal) {
  const auto all = commands();
  ASSERT_GE(all.size(), 20U);
  for (const auto& command : all) {
    std::string before;
    for (const std::size_t width : {60U, 80U}) {
      const Outcome help = roslam(command + " --help", "COLUMNS=" + std::to_string(width));
      EXPECT_EQ(help.code, 0);
      for (const auto& line : lines_of(help.out)) EXPECT_LE(line.size(), width) << command << ": " << line;
      EXPECT_TRUE(before.empty() || letters(help.out) == before) << command;
      before = letters(help.out);
    }
  }
}

TEST_F(Usage, HelpHasEightyColumnsWhereTheWidthIsUnknown) {
  const auto widest = [&](const std::string& columns) {
    std::size_t most = 0;
    for (const auto& line : lines_of(roslam("run --help", columns).out)) most = std::max(most, line.size());
    return most;
  };
  for (const char* unknown : {"COLUMNS=", "COLUMNS=0", "COLUMNS=-3", "COLUMNS=many", "env -u COLUMNS"})
    EXPECT_EQ(widest(unknown), 80U) << unknown;
  EXPECT_LE(widest("COLUMNS=7"), 40U);
  EXPECT_GT(widest("COLUMNS=1000"), 100U);
  EXPECT_LE(widest("COLUMNS=1000"), 120U);
}

TEST_F(Usage, HelpKeepsColumnsListsAndExamples) {
  const std::string help = roslam("run --help", "COLUMNS=80").out;
  for (const char* lines :
       {"  roslam run simulated:street --out street\n",
        "  roslam run rgbd_dataset_freiburg1_rpy --camera tum-fr1 --out rpy\n",
        "  trajectory.txt keyframes.txt camera poses of frames and keyframes (TUM format)\n",
        "  dense.ply dense.bt           dense map: points and triangles; free and\n"
        "                               occupied space (OctoMap)\n",
        "  --print-config              Print the effective options (YAML) and exit\n"})
    EXPECT_NE(help.find(lines), std::string::npos) << lines << help;
  const std::string narrow = roslam("run --help", "COLUMNS=60").out;
  EXPECT_NE(narrow.find("  roslam run my_flight --camera my_camera.yaml --real-time \\\n      --out live\n"),
            std::string::npos)
      << narrow;
}

TEST_F(Usage, UnknownCommandsAndOptionsAreNamedWithSimilarOnes) {
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {"rnu", "unknown command 'rnu'; did you mean 'run'?"},
           {"bench static", "unknown command 'bench'; did you mean 'benchmark'?"},
           {"merge a b --out c", "unknown command 'merge'; did you mean 'map merge'?"},
           {"frobnicate", "unknown command 'frobnicate'; see roslam --help"},
           {"map inof x", "unknown command 'inof'; did you mean 'info'?"},
           {"map frobnicate", "unknown command 'frobnicate'; see roslam map --help"},
           {"benchmark dynamik", "did you mean 'dynamic'?"},
           {"evaluate trajectroy", "did you mean 'trajectory'?"},
           {"vocabulary tarin", "did you mean 'train'?"},
           {"run simulated:street --realtime --out x",
            "unknown option '--realtime'; did you mean '--real-time'?"},
           {"run simulated:street --output=x", "unknown option '--output'; did you mean '--out'?"},
           {"run simulated:street -out x", "did you mean '--out'?"},
           {"--verison", "unknown option '--verison'; did you mean '--version'?"},
           {"render m.ply --out x.png --color rgb", "did you mean '--colour'?"},
           {"compose base --camrea tum-fr1 --people p --out x", "did you mean '--camera'?"},
           {"map export x --frobnicate", "unknown option '--frobnicate'; see roslam map export --help"},
           {"run simulated:street street2 --out x", "unexpected argument 'street2'; see roslam run --help"},
           {"map", "see roslam map --help"},
           {"run", "SOURCE is required; see roslam run --help"},
           {"run simulated:street --out x --seed many", "see roslam run --help"}})
    expect_one_line(arguments, words);
}

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
