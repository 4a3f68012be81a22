// SPDX-License-Identifier: BSD-3-Clause
#include "recording/topic_file.hpp"

#include <algorithm>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/ros/ros_definitions.hpp"

namespace roslam::recording {

namespace {
namespace fs = std::filesystem;

// Quality of service as rosbag2 stores it, in numbers, which all its versions read. Without it the player
// publishes for subscribers that are there already, and nobody who asks for the last message, such as for
// /tf_static, is connected.
std::string latched_profile() {
  const std::string forever = "{sec: 9223372036, nsec: 854775807}";
  constexpr const char* kKeepLast = "1";
  constexpr const char* kReliable = "1";
  constexpr const char* kTransientLocal = "1";
  constexpr const char* kAutomatic = "1";
  return std::string("- history: ") + kKeepLast + "\n  depth: 1\n  reliability: " + kReliable +
         "\n  durability: " + kTransientLocal + "\n  deadline: " + forever + "\n  lifespan: " + forever +
         "\n  liveliness: " + kAutomatic + "\n  liveliness_lease_duration: " + forever +
         "\n  avoid_ros_namespace_conventions: false\n";
}

// Where the file lies in the end: a link is followed.
fs::path place_of(const fs::path& file) {
  std::error_code error;
  return fs::is_symlink(file, error) ? fs::weakly_canonical(file, error) : file;
}

void require_folder(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error))
    throw OutputError(file.string() + ": is a folder; name the file to write");
  const fs::path folder = fs::absolute(file, error).parent_path();
  if (!fs::is_directory(folder, error))
    throw OutputError(file.string() + ": its folder does not exist; make it or choose another name");
}
}  // namespace

TopicFile::TopicFile(const fs::path& file) : file_(place_of(file)), part_(file_) {
  require_folder(file_);
  if (!is_device(file_)) part_ += ".part";
  writer_.emplace(part_);
}

TopicFile::~TopicFile() {
  if (!writer_) return;
  writer_.reset();
  std::error_code error;
  if (part_ != file_) fs::remove(part_, error);
}

void TopicFile::write(const TopicDescription& topic, std::int64_t stamp, const RosMessage& message) {
  const auto [id, is_new] = ids_.try_emplace(topic.name, topics_.size());
  if (is_new) {
    std::map<std::string, std::string> metadata;
    if (topic.is_latched) metadata["offered_qos_profiles"] = latched_profile();
    writer_->add_topic(topic.name, topic.type, ros_definition(topic.type), metadata);
    topics_.push_back({topic.name, topic.type});
  }
  writer_->write(static_cast<int>(id->second), stamp, message);
  Topic& written = topics_[id->second];
  ++written.messages;
  written.bytes += message.size();
  if (!time_range_) time_range_ = {stamp, stamp};
  time_range_->first = std::min(time_range_->first, stamp);
  time_range_->second = std::max(time_range_->second, stamp);
}

void TopicFile::finish() {
  writer_->close();
  std::error_code error;
  if (part_ != file_) fs::rename(part_, file_, error);
  if (error)
    throw OutputError(file_.string() + ": cannot be replaced (" + error.message() + "); choose another name");
  bytes_ = writer_->bytes();
  writer_.reset();
}

}  // namespace roslam::recording
