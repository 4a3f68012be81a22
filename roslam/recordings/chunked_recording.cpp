// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/chunked_recording.hpp"

#include <zlib.h>

#include <algorithm>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMaxOpenBytes = std::size_t{256} << 20;
constexpr std::size_t kMaxChunks = 1000000;

std::uint32_t crc_of(ByteSpan bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
}
}  // namespace

void ChunkedRecording::select(const std::set<int>& topics) {
  selected_ = topics;
  open_.clear();
  current_ = {};
  open_bytes_ = 0;
  next_chunk_ = 0;
  refused_ = 0;
  last_time_.reset();
  notes_[1].clear();
}

std::optional<RecordedMessage> ChunkedRecording::next() {
  if (!current_.empty()) {
    Loaded& loaded = current_.mapped();
    if (++loaded.next < loaded.messages.size()) {
      current_.key().first = loaded.messages[loaded.next].time;
      open_.insert(std::move(current_));
    } else {
      open_bytes_ -= loaded.memory();
    }
    current_ = {};
  }
  load_up_to_date();
  if (open_.empty()) return std::nullopt;
  current_ = open_.extract(open_.begin());
  const Loaded& loaded = current_.mapped();
  const Entry& entry = loaded.messages[loaded.next];
  if (last_time_ && entry.time < *last_time_) note("message is earlier than the one before it");
  last_time_ = entry.time;
  return RecordedMessage{entry.topic, entry.time, loaded.bytes.span().subspan(entry.offset, entry.size)};
}

// Loads the chunks that begin no later than the next message.
void ChunkedRecording::load_up_to_date() {
  while (next_chunk_ < chunks_.size()) {
    const Chunk& chunk = chunks_[next_chunk_];
    if (!open_.empty()) {
      if (chunk.first > open_.begin()->first.first) return;
      if (open_bytes_ >= kMaxOpenBytes) {
        if (refused_ != next_chunk_ + 1)
          note("chunk read late, as those that overlap it have more than 256 MB");
        refused_ = next_chunk_ + 1;
        return;
      }
    }
    ++next_chunk_;
    if (!is_selected(chunk)) continue;
    is_noted_ = chunk.is_scanned;
    auto loaded = load(chunk);
    is_noted_ = false;
    if (!loaded) continue;
    std::erase_if(loaded->messages,
                  [&](const Entry& entry) { return !selected_.empty() && !selected_.contains(entry.topic); });
    if (loaded->messages.empty()) continue;
    std::stable_sort(loaded->messages.begin(), loaded->messages.end(),
                     [](const Entry& a, const Entry& b) { return a.time < b.time; });
    open_bytes_ += loaded->memory();
    const std::pair key(loaded->messages.front().time, chunk.offset);
    open_.emplace(key, std::move(*loaded));
  }
}

bool ChunkedRecording::is_selected(const Chunk& chunk) const {
  return selected_.empty() || !chunk.topics ||
         std::any_of(chunk.topics->begin(), chunk.topics->end(),
                     [&](int topic) { return selected_.contains(topic); });
}

std::optional<ChunkedRecording::Loaded> ChunkedRecording::load(const Chunk& chunk) {
  std::optional<ByteBuffer> bytes;
  if (chunk.run > 0) {
    bytes = file_.read(chunk.offset, chunk.run);
  } else if (const auto packed = chunk_at(chunk.offset)) {
    bytes = unpack(*packed);
  }
  if (!bytes) return std::nullopt;
  Loaded loaded;
  loaded.messages = list(bytes->span());
  loaded.bytes = std::move(*bytes);
  return loaded;
}

// The content of a chunk. Of the last one of a truncated file, what its beginning gives.
std::optional<ByteBuffer> ChunkedRecording::unpack(const PackedChunk& chunk) {
  require_compression(chunk.method, file_.name());
  if (!is_plausible_size(chunk.method, chunk.packed, chunk.unpacked)) {
    note("chunk with an implausible size, left out");
    return std::nullopt;
  }
  const std::uint64_t left = file_.size() - std::min(file_.size(), chunk.offset);
  const bool is_truncated = left < chunk.packed;
  std::optional<ByteBuffer> bytes =
      file_.read(chunk.offset, static_cast<std::size_t>(std::min(left, chunk.packed)));
  if (chunk.method != Compression::kNone) {
    bytes = decompress(chunk.method, bytes->span(), static_cast<std::size_t>(chunk.unpacked), is_truncated,
                       file_.name());
  } else if (!is_truncated && chunk.unpacked != chunk.packed) {
    bytes.reset();
  }
  if (bytes && !is_truncated && chunk.crc != 0 && crc_of(bytes->span()) != chunk.crc) bytes.reset();
  if (!bytes) note(kDamagedChunk);
  return bytes;
}

void ChunkedRecording::add_unindexed(std::uint64_t offset, std::size_t run) {
  Chunk chunk;
  chunk.offset = offset;
  chunk.run = run;
  chunk.is_scanned = true;
  chunk.topics.emplace();
  const auto loaded = load(chunk);
  if (!loaded || loaded->messages.empty()) return;
  const auto [first, last] =
      std::minmax_element(loaded->messages.begin(), loaded->messages.end(),
                          [](const Entry& a, const Entry& b) { return a.time < b.time; });
  chunk.first = first->time;
  chunk.last = last->time;
  std::map<int, std::size_t> counts;
  for (const Entry& entry : loaded->messages) ++counts[entry.topic];
  for (const auto& [topic, count] : counts) {
    if (!is_counted_) topics_.count(topic, count);
    chunk.topics->push_back(topic);
  }
  add(std::move(chunk));
}

void ChunkedRecording::add(Chunk chunk) {
  if (chunks_.size() >= kMaxChunks)
    throw InputError(file_.name() + ": has more than a million chunks; split it into shorter recordings");
  chunks_.push_back(std::move(chunk));
}

void ChunkedRecording::finish_opening() {
  const auto by_offset = [](const Chunk& a, const Chunk& b) { return a.offset < b.offset; };
  std::sort(chunks_.begin(), chunks_.end(), by_offset);
  const auto is_same = [](const Chunk& a, const Chunk& b) { return a.offset == b.offset; };
  chunks_.erase(std::unique(chunks_.begin(), chunks_.end(), is_same), chunks_.end());
  std::stable_sort(chunks_.begin(), chunks_.end(),
                   [](const Chunk& a, const Chunk& b) { return a.first < b.first; });
  // A library that is missing is found out now, not while reading.
  if (!chunks_.empty() && chunks_.front().run == 0) {
    is_noted_ = true;  // when it is read
    if (const auto chunk = chunk_at(chunks_.front().offset)) require_compression(chunk->method, file_.name());
    is_noted_ = false;
  }
  is_opening_ = false;
}

std::optional<std::pair<std::int64_t, std::int64_t>> ChunkedRecording::time_range() const {
  if (chunks_.empty()) return std::nullopt;
  const auto last = std::max_element(chunks_.begin(), chunks_.end(),
                                     [](const Chunk& a, const Chunk& b) { return a.last < b.last; });
  return std::pair(chunks_.front().first, last->last);
}

std::map<std::string, std::size_t> ChunkedRecording::notes() const {
  auto all = notes_[0];
  for (const auto& [what, count] : notes_[1]) all[what] += count;
  return all;
}

}  // namespace roslam
