// SPDX-License-Identifier: BSD-3-Clause
// Where models are found: the folders of ROSLAM_MODEL_PATH first, in their order, then those of the build or
// the installation.
#include "roslam/common/resources.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

// Of a resource that no folder of the build or of an installation has.
constexpr const char* kName = "resources_test.onnx";

// Restores the variable and the working directory that the test changes.
class Resources : public testing::Test {
 protected:
  Resources() {
    if (const char* value = std::getenv(kVariable)) before_ = value;
    for (const char* folder : {"first", "second", "third"}) fs::create_directories(scratch_ / folder);
  }

  ~Resources() override {
    fs::current_path(working_directory_);
    set(before_);
    fs::remove_all(scratch_);
  }

  static void set(const std::optional<std::string>& value) {
    if (value) {
      setenv(kVariable, value->c_str(), 1);
    } else {
      unsetenv(kVariable);
    }
  }

  // The folders of the fixture of these names, joined by colons; an empty name is an empty entry.
  void set_folders(std::initializer_list<std::string> names) const {
    std::string value;
    for (const std::string& name : names) {
      if (&name != names.begin()) value += ':';
      if (!name.empty()) value += folder(name).string();
    }
    set(value);
  }

  fs::path folder(const std::string& name) const { return scratch_ / name; }

  static fs::path put(const fs::path& file) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "content";
    return file;
  }

  static constexpr const char* kVariable = "ROSLAM_MODEL_PATH";
  const fs::path working_directory_ = fs::current_path();
  const fs::path scratch_ = fs::canonical(testing::TempDir()) / scratch_path().filename();
  std::optional<std::string> before_;
};

TEST_F(Resources, WhatIsNowhereGivesAnEmptyPath) {
  set(std::nullopt);
  EXPECT_EQ(find_resource(kName), fs::path());
  set_folders({"first", "second"});
  EXPECT_EQ(find_resource(kName), fs::path());
}

TEST_F(Resources, OfSeveralFoldersTheFirstThatHasTheFileWins) {
  set_folders({"first", "second", "third"});
  const fs::path third = put(folder("third") / kName);
  EXPECT_EQ(find_resource(kName), third) << "it is in no other";
  const fs::path second = put(folder("second") / kName);
  EXPECT_EQ(find_resource(kName), second);
  const fs::path first = put(folder("first") / kName);
  EXPECT_EQ(find_resource(kName), first);
  set_folders({"third", "first"});
  EXPECT_EQ(find_resource(kName), third) << "the order of the variable counts, not that of names";
  EXPECT_EQ(find_resource("resources_test.other"), fs::path());
}

TEST_F(Resources, MissingFoldersAreSkipped) {
  const fs::path file = put(folder("second") / kName);
  set_folders({"missing", "second"});
  EXPECT_EQ(find_resource(kName), file);
  set_folders({"second", "missing"});
  EXPECT_EQ(find_resource(kName), file);
  put(folder("plain"));  // a file where a folder should be
  set_folders({"plain", "second"});
  EXPECT_EQ(find_resource(kName), file);
}

// An empty entry must not mean the working directory, as it does in some other variables.
TEST_F(Resources, EmptyEntriesAreSkipped) {
  const fs::path file = put(folder("second") / kName);
  put(folder("third") / kName);
  fs::current_path(folder("third"));
  set_folders({"", "second"});
  EXPECT_EQ(find_resource(kName), file);
  set_folders({"", "", "second", ""});
  EXPECT_EQ(find_resource(kName), file);
  for (const char* empty : {"", ":", "::"}) {
    set(empty);
    EXPECT_EQ(find_resource(kName), fs::path()) << "\"" << empty << "\"";
  }
  set(".");
  EXPECT_EQ(find_resource(kName), fs::path(kName)) << "the control: the file is in the working directory";
}

TEST_F(Resources, AFolderOfThatNameIsNoResource) {
  fs::create_directories(folder("first") / kName);
  set_folders({"first", "second"});
  EXPECT_EQ(find_resource(kName), fs::path());
  const fs::path file = put(folder("second") / kName);
  EXPECT_EQ(find_resource(kName), file);
}

// Whether there is one depends on where the test runs; the variable must not hide it.
TEST_F(Resources, WithoutTheVariableTheFoldersOfTheBuildOrInstallationAreSearched) {
  constexpr const char* kShipped = "roslam-orb.vocabulary";
  set(std::nullopt);
  const fs::path shipped = find_resource(kShipped);
  EXPECT_TRUE(shipped.empty() || fs::is_regular_file(shipped)) << shipped;
  set_folders({"first", "", "missing"});
  EXPECT_EQ(find_resource(kShipped), shipped) << "the variable comes first, not instead";
  const fs::path own = put(folder("first") / kShipped);
  EXPECT_EQ(find_resource(kShipped), own);
}

}  // namespace
}  // namespace roslam
