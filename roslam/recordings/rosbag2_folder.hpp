// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "roslam/recordings/recording.hpp"
#include "roslam/recordings/topic_table.hpp"

namespace roslam {

/// A folder that rosbag2 recorded to: the files that metadata.yaml lists, or else all .db3 and .mcap files by
/// their numbers, one after another. Only one is open at a time.
class Rosbag2Folder : public Recording {
 public:
  /// Throws InputError.
  explicit Rosbag2Folder(const std::filesystem::path& folder);

  const std::vector<RecordedTopic>& topics() const override { return topics_.all(); }
  void select(const std::set<int>& topics) override;
  std::optional<RecordedMessage> next() override;
  std::optional<std::pair<std::int64_t, std::int64_t>> time_range() const override { return times_; }
  std::string container() const override { return container_; }
  std::map<std::string, std::size_t> notes() const override;

  /// True if the folder is of rosbag2.
  static bool recognises(const std::filesystem::path& folder);

 private:
  struct Part {
    std::filesystem::path file;
    std::vector<int> topics;  // of the folder, by the id in the file
    std::map<std::string, std::size_t> opened_notes;
    std::map<std::string, std::size_t> notes;  // with those of reading it, once it was read
  };

  std::vector<std::filesystem::path> listed_files(const std::string& metadata);
  void add(const std::filesystem::path& file);
  void open_part();

  std::filesystem::path folder_;
  TopicTable topics_;
  std::vector<Part> parts_;
  std::string container_;
  std::optional<std::pair<std::int64_t, std::int64_t>> times_;
  std::set<int> selected_;
  std::unique_ptr<Recording> current_;
  std::size_t part_ = 0;                      // that current_ is of
  std::map<std::string, std::size_t> notes_;  // of the folder itself
  std::string unread_;                        // why the first file that cannot be read cannot
};

}  // namespace roslam
