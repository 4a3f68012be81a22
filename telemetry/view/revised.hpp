// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace roslam::telemetry {

/// Records by key, of which a reader that comes back is given those that changed since. Each change has a
/// revision of its own, so that a reader may take them in parts. A record that is removed stays as one that
/// is gone. Not thread-safe.
template <typename Record>
class Revised {
 public:
  struct Change {
    std::uint32_t key = 0;
    bool is_gone = false;
    Record record{};
  };
  struct Changes {
    std::uint32_t revision = 0;  ///< to ask from the next time
    bool is_all = false;         ///< what the reader has is of another time and to be forgotten
    bool has_more = false;
    std::vector<Change> changes;
  };

  /// Takes over the records, by ascending key, in place of those before.
  template <typename Records>
  void replace(const Records& records) {
    auto known = entries_.begin();
    for (const auto& [key, record] : records) {
      for (; known != entries_.end() && known->first < key; ++known) remove(known->second);
      if (known == entries_.end() || known->first != key) {
        known = entries_.emplace_hint(known, key, Entry{record, false, ++revision_});
      } else if (known->second.is_gone || !(known->second.record == record)) {
        known->second = {record, false, ++revision_};
      }
      ++known;
    }
    for (; known != entries_.end(); ++known) remove(known->second);
  }

  /// What changed since a revision, the oldest first, at most so much.
  Changes since(std::uint32_t revision, std::size_t most) const {
    Changes result;
    result.is_all = revision == 0 || revision > revision_;
    const std::uint32_t from = result.is_all ? 0 : revision;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> changed;  // revision and key
    for (const auto& [key, entry] : entries_) {
      if (entry.revision > from && !(result.is_all && entry.is_gone))
        changed.emplace_back(entry.revision, key);
    }
    std::sort(changed.begin(), changed.end());
    result.has_more = changed.size() > most;
    result.revision = revision_;
    if (result.has_more) {
      changed.resize(most);
      result.revision = changed.back().first;
    }
    for (const auto& [unused, key] : changed) {
      const Entry& entry = entries_.at(key);
      result.changes.push_back({key, entry.is_gone, entry.record});
    }
    return result;
  }

  std::uint32_t revision() const { return revision_; }

 private:
  struct Entry {
    Record record{};
    bool is_gone = false;
    std::uint32_t revision = 0;
  };

  void remove(Entry& entry) {
    if (entry.is_gone) return;
    entry.is_gone = true;
    entry.revision = ++revision_;
  }

  std::map<std::uint32_t, Entry> entries_;
  std::uint32_t revision_ = 0;
};

}  // namespace roslam::telemetry
