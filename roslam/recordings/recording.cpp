// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/recording.hpp"

#include <fstream>

#include "roslam/common/error.hpp"
#include "roslam/recordings/decompress.hpp"
#include "roslam/recordings/mcap.hpp"
#include "roslam/recordings/ros_bag.hpp"
#include "roslam/recordings/rosbag2_folder.hpp"
#include "roslam/recordings/sqlite_recording.hpp"

namespace roslam {

namespace {
enum class Container { kNone, kRosBag, kSqlite, kMcap, kFolder, kCompressed };

Container container_of(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    return Rosbag2Folder::recognises(path) ? Container::kFolder : Container::kNone;
  if (!std::filesystem::is_regular_file(path, error)) return Container::kNone;
  char bytes[16] = {};
  std::ifstream in(path, std::ios::binary);
  in.read(bytes, sizeof bytes);
  const std::string_view begin(bytes, static_cast<std::size_t>(in.gcount()));
  if (RosBag::recognises(begin)) return Container::kRosBag;
  if (is_sqlite_file(begin)) return Container::kSqlite;
  if (McapFile::recognises(begin)) return Container::kMcap;
  const std::string inner = path.stem().extension().string();
  const bool is_zstd = is_zstd_frame({reinterpret_cast<const std::uint8_t*>(begin.data()), begin.size()});
  return is_zstd && (inner == ".db3" || inner == ".mcap") ? Container::kCompressed : Container::kNone;
}
}  // namespace

bool is_recording(const std::filesystem::path& path) { return container_of(path) != Container::kNone; }

std::unique_ptr<Recording> open_recording(const std::filesystem::path& path) {
  switch (container_of(path)) {
    case Container::kRosBag:
      return std::make_unique<RosBag>(path);
    case Container::kSqlite:
      return open_sqlite_recording(path);
    case Container::kMcap:
      return std::make_unique<McapFile>(path);
    case Container::kFolder:
      return std::make_unique<Rosbag2Folder>(path);
    case Container::kCompressed:
      throw InputError(path.string() + ": compressed as a whole; unpack it with zstd -d " + path.string());
    case Container::kNone:
      break;
  }
  if (std::error_code error; !std::filesystem::exists(path, error))
    throw InputError(path.string() +
                     ": no such file; give a .bag, .db3 or .mcap file or a folder of rosbag2");
  throw InputError(path.string() +
                   ": not a recording; give a ROS 1 bag, a .db3 or .mcap file or a folder of rosbag2");
}

}  // namespace roslam
