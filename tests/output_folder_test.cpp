// SPDX-License-Identifier: BSD-3-Clause
#include "recording/output_folder.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "tests/scratch.hpp"

namespace roslam::recording {
namespace {

namespace fs = std::filesystem;

class OutputFolders : public testing::Test {
 protected:
  void TearDown() override { fs::remove_all(folder_); }
  const fs::path folder_ = scratch_path();
  const std::vector<std::string> names_{"rgb.txt", "rgb"};
};

TEST_F(OutputFolders, FilesOfOthersAreNotReplacedUnlessAsked) {
  fs::create_directories(folder_);
  write_file(folder_ / "rgb.txt", "mine\n");
  try {
    const OutputFolder folder(folder_, "simulate", names_, false);
    FAIL() << "a folder of somebody else was taken";
  } catch (const OutputError& error) {
    EXPECT_NE(std::string(error.what()).find("rgb.txt"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("--overwrite"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(fs::exists(folder_ / "rgb.txt"));
  EXPECT_NO_THROW(OutputFolder(folder_, "simulate", names_, true));
}

TEST_F(OutputFolders, FilesOfAnotherKindDoNotMatter) {
  fs::create_directories(folder_);
  write_file(folder_ / "notes.txt", "mine\n");
  EXPECT_NO_THROW(OutputFolder(folder_, "simulate", names_, false));
  EXPECT_TRUE(fs::exists(folder_ / "notes.txt"));
}

TEST_F(OutputFolders, ResultsOfTheSameCommandAreReplacedAndDoNotStay) {
  {
    const OutputFolder folder(folder_, "simulate", names_, false);
    write_file(folder_ / "rgb.txt", "the first\n");
  }
  const OutputFolder again(folder_, "simulate", names_, false);
  EXPECT_FALSE(fs::exists(folder_ / "rgb.txt")) << "would pass for a result of this call";
  write_file(folder_ / "rgb.txt", "the second\n");
}

TEST_F(OutputFolders, ResultsOfAnotherCommandAreNotReplaced) {
  {
    const OutputFolder folder(folder_, "simulate", names_, false);
    write_file(folder_ / "rgb.txt", "simulated\n");
  }
  EXPECT_THROW(OutputFolder(folder_, "compose", names_, false), OutputError);
}

TEST_F(OutputFolders, WhatTheCommandDidNotWriteStaysInAFolderOfIts) {
  {
    OutputFolder folder(folder_, "segment", {"labels.json"}, false);
    folder.claim("a.png");
    write_file(folder_ / "a.png", "own\n");
  }
  write_file(folder_ / "b.png", "mine\n");
  OutputFolder again(folder_, "segment", {"labels.json"}, false);
  EXPECT_NO_THROW(again.claim("a.png"));
  EXPECT_THROW(again.claim("b.png"), OutputError);
}

TEST_F(OutputFolders, TwoProcessesCannotWriteToOne) {
  fs::create_directories(folder_);
  int ready[2];
  int leave[2];
  ASSERT_EQ(pipe(ready), 0);
  ASSERT_EQ(pipe(leave), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FolderLock lock(folder_);
    char byte = 'x';
    if (write(ready[1], &byte, 1) != 1 || read(leave[0], &byte, 1) != 1) _exit(1);
    kill(getpid(), SIGKILL);  // the lock must not outlive the process
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_THROW(FolderLock{folder_}, OutputError);
  ASSERT_EQ(write(leave[1], &byte, 1), 1);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_NO_THROW(FolderLock{folder_});
}

}  // namespace
}  // namespace roslam::recording
