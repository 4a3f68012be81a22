// SPDX-License-Identifier: BSD-3-Clause
#include "recording/run_folder.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "tests/scratch.hpp"

namespace roslam {

using namespace recording;

namespace {
namespace fs = std::filesystem;

std::string content(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

// The results of an earlier run stay until there are new ones: a run that fails to start must not cost them.
TEST(RunFolder, KeepsEarlierResultsUntilThereAreNewOnes) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  write_file(folder / "run.json", "{\"version\": \"earlier\"}\n");
  const RunFolder run(folder);
  EXPECT_EQ(content(folder / "run.json"), "{\"version\": \"earlier\"}\n");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1)
      << "leaves files behind";
}

TEST(RunFolder, RefusesADataset) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  write_file(folder / "rgb.txt", "# timestamp filename\n");
  EXPECT_THROW(RunFolder{folder}, OutputError);
}

}  // namespace
}  // namespace roslam
