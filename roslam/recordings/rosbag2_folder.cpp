// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/rosbag2_folder.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <tuple>

#include "roslam/common/error.hpp"

namespace roslam {

namespace fs = std::filesystem;

namespace {
constexpr const char* kMetadata = "metadata.yaml";
constexpr const char* kInformation = "rosbag2_bagfile_information";
constexpr std::uintmax_t kMaxMetadataBytes = 16 << 20;

bool is_part(const fs::path& file) { return file.extension() == ".db3" || file.extension() == ".mcap"; }

// The text of metadata.yaml; empty if there is none of rosbag2.
std::string metadata_of(const fs::path& folder) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(folder / kMetadata, error);
  if (error || size > kMaxMetadataBytes) return {};
  std::ifstream in(folder / kMetadata, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return text.find(kInformation) == std::string::npos ? std::string() : text;
}

// The recordings in a folder: name_2.db3 comes before name_10.db3.
std::vector<fs::path> parts_by_number(const fs::path& folder) {
  std::vector<std::tuple<std::string, std::size_t, std::string, fs::path>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!is_part(entry.path()) || !entry.is_regular_file(error)) continue;
    const std::string stem = entry.path().stem().string();
    const std::size_t last = stem.find_last_not_of("0123456789");
    std::string digits = stem.substr(last == std::string::npos ? 0 : last + 1);
    const std::string name = stem.substr(0, stem.size() - digits.size());
    digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
    found.emplace_back(name, digits.size(), digits, entry.path());
  }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> files;
  for (const auto& part : found) files.push_back(std::get<3>(part));
  return files;
}
}  // namespace

bool Rosbag2Folder::recognises(const fs::path& folder) {
  return !metadata_of(folder).empty() || !parts_by_number(folder).empty();
}

Rosbag2Folder::Rosbag2Folder(const fs::path& folder) : folder_(folder), topics_(folder.string()) {
  std::vector<fs::path> files = listed_files(metadata_of(folder));
  if (files.empty()) files = parts_by_number(folder);
  for (const fs::path& file : files) add(file);
  if (parts_.empty() && !unread_.empty()) throw InputError(unread_);
  if (parts_.empty())
    throw InputError(folder.string() +
                     ": no .db3 or .mcap file in it; give the folder that rosbag2 recorded");
  select({});
}

// The files that metadata.yaml lists and that exist. Only their names count, as some versions of rosbag2
// write paths relative to the folder above.
std::vector<fs::path> Rosbag2Folder::listed_files(const std::string& metadata) {
  std::vector<fs::path> files;
  if (metadata.empty()) return files;
  try {
    const YAML::Node read = YAML::Load(metadata);
    for (const auto& listed : read[kInformation]["relative_file_paths"]) {
      fs::path file = folder_ / fs::path(listed.as<std::string>()).filename();
      if (file.extension() == ".zstd" && !fs::exists(file)) file.replace_extension();  // unpacked since
      if (fs::is_regular_file(file)) {
        files.push_back(file);
      } else {
        ++notes_["file that metadata.yaml lists is missing"];
      }
    }
  } catch (const std::exception&) {
    ++notes_["metadata.yaml is damaged; all .db3 and .mcap files of the folder are read"];
    files.clear();
  }
  return files;
}

// The last file of a recording that was cut may not be readable at all.
void Rosbag2Folder::add(const fs::path& file) {
  std::unique_ptr<Recording> recording;
  try {
    recording = open_recording(file);
  } catch (const InputError& error) {
    if (unread_.empty()) unread_ = error.what();
    ++notes_["file that cannot be read, left out"];
    return;
  }
  Part part{file, {}, recording->notes(), recording->notes()};
  for (const RecordedTopic& topic : recording->topics()) part.topics.push_back(topics_.add(topic));
  parts_.push_back(std::move(part));
  container_ = recording->container();
  if (const auto times = recording->time_range()) {
    times_ = times_
                 ? std::pair(std::min(times_->first, times->first), std::max(times_->second, times->second))
                 : *times;
  }
}

void Rosbag2Folder::select(const std::set<int>& topics) {
  selected_ = topics;
  for (Part& part : parts_) part.notes = part.opened_notes;
  part_ = 0;
  open_part();
}

// Opens the file of part_ with the selected topics; one that has none of them is passed over.
void Rosbag2Folder::open_part() {
  current_.reset();
  for (; part_ < parts_.size(); ++part_) {
    std::set<int> selected;
    const std::vector<int>& topics = parts_[part_].topics;
    for (std::size_t id = 0; id < topics.size(); ++id) {
      if (selected_.contains(topics[id])) selected.insert(static_cast<int>(id));
    }
    if (selected.empty() && !selected_.empty()) continue;
    current_ = open_recording(parts_[part_].file);
    current_->select(selected);
    return;
  }
}

std::optional<RecordedMessage> Rosbag2Folder::next() {
  while (current_) {
    if (auto message = current_->next()) {
      message->topic = parts_[part_].topics.at(static_cast<std::size_t>(message->topic));
      return message;
    }
    parts_[part_].notes = current_->notes();
    ++part_;
    open_part();
  }
  return std::nullopt;
}

std::map<std::string, std::size_t> Rosbag2Folder::notes() const {
  auto all = notes_;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto notes = current_ && i == part_ ? current_->notes() : parts_[i].notes;
    for (const auto& [what, count] : notes) all[what] += count;
  }
  return all;
}

}  // namespace roslam
