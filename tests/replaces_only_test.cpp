// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/replaces_only.hpp"

#include <gtest/gtest.h>

#include "roslam/common/write_file.hpp"
#include "tests/scratch.hpp"

namespace roslam::app {
namespace {

namespace fs = std::filesystem;

TEST(ReplacesOnly, FilesOfItsKindNewOnesAndDevices) {
  const fs::path folder = fs::absolute(scratch_path());
  fs::create_directories(folder);
  const ReplacesOnly ply({"ply"});
  const auto refusal = [&](const fs::path& file) {
    std::string name = file.string();
    return ply(name);
  };
  write_file(folder / "own", "ply\nformat ascii 1.0\n");
  write_file(folder / "empty", "");
  write_file(folder / "list", "# timestamp filename\n");
  fs::create_symlink(folder / "list", folder / "link");
  for (const fs::path& file : {folder / "new", folder / "own", folder / "empty", fs::path("/dev/full")})
    EXPECT_EQ(refusal(file), "") << file;
  for (const fs::path& file : {folder / "list", folder / "link"})
    EXPECT_NE(refusal(file).find("another kind"), std::string::npos) << file;
  fs::remove_all(folder);
}

}  // namespace
}  // namespace roslam::app
