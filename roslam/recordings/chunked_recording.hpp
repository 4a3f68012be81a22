// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "roslam/recordings/decompress.hpp"
#include "roslam/recordings/recording.hpp"
#include "roslam/recordings/recording_file.hpp"
#include "roslam/recordings/topic_table.hpp"

namespace roslam {

// Notes on chunks that every format finds.
constexpr const char* kDamagedChunk = "damaged chunk, left out";
constexpr const char* kCutChunk = "cut or damaged record; the rest of its chunk was left out";

/// A recording whose messages lie in chunks: merges them in the order of time. A chunk is loaded when its
/// first time is reached and dropped after its last message, so that only chunks that overlap are in memory.
/// What the formats have in common is here; a format finds the chunks when it opens the file, and lists their
/// messages.
class ChunkedRecording : public Recording {
 public:
  const std::vector<RecordedTopic>& topics() const override { return topics_.all(); }
  void select(const std::set<int>& topics) override;
  std::optional<RecordedMessage> next() override;
  std::optional<std::pair<std::int64_t, std::int64_t>> time_range() const override;
  std::map<std::string, std::size_t> notes() const override;

 protected:
  explicit ChunkedRecording(const std::filesystem::path& path) : file_(path), topics_(file_.name()) {}

  /// Messages outside chunks are loaded in runs of so many bytes, or one by one if they are larger.
  static constexpr std::uint64_t kRunBytes = std::uint64_t{4} << 20;

  /// A part of the file that is loaded at once.
  struct Chunk {
    std::uint64_t offset = 0;                // in the file, of its record
    std::size_t run = 0;                     // bytes, if it is a run of records outside chunks; else 0
    std::int64_t first = 0;                  // time of its first message
    std::int64_t last = 0;                   // time of its last message
    std::optional<std::vector<int>> topics;  // where known
    bool is_scanned = false;                 // what its notes are was noted when the file was opened
  };

  /// Content of a chunk as its header describes it.
  struct PackedChunk {
    Compression method = Compression::kNone;
    std::uint64_t offset = 0;  // in the file, of the packed bytes
    std::uint64_t packed = 0;  // bytes
    std::uint64_t unpacked = 0;
    std::uint32_t crc = 0;  // of the unpacked bytes (CRC-32); 0: not known
  };

  /// A message within the unpacked bytes of a chunk.
  struct Entry {
    std::int64_t time = 0;
    std::size_t offset = 0;
    std::uint32_t size = 0;
    int topic = 0;
  };

  /// The header of the chunk at this place of the file, or nothing if there is none; says why in the notes.
  virtual std::optional<PackedChunk> chunk_at(std::uint64_t offset) = 0;

  /// The messages among records of a chunk, in the order of the file. While the file is opened also adds
  /// the topics that the records describe.
  virtual std::vector<Entry> list(ByteSpan records) = 0;

  /// Loads a chunk that no index describes, for its topics and times, and adds it. run: as in Chunk.
  void add_unindexed(std::uint64_t offset, std::size_t run);
  void add(Chunk chunk);
  /// To be called once, when all chunks are added. Throws InputError if a library is missing that they need.
  void finish_opening();
  /// Forgets all chunks, to begin anew without the index.
  void clear_chunks() { chunks_.clear(); }

  bool is_opening() const { return is_opening_; }
  void note(const std::string& what) {
    if (!is_noted_) ++notes_[is_opening_ ? 0 : 1][what];
  }

  RecordingFile file_;
  TopicTable topics_;
  bool is_counted_ = false;  // the index says how many messages the topics have

 private:
  struct Loaded {
    ByteBuffer bytes;
    std::vector<Entry> messages;
    std::size_t next = 0;
    std::size_t memory() const { return bytes.size() + messages.size() * sizeof(Entry); }
  };
  using Open =
      std::map<std::pair<std::int64_t, std::uint64_t>, Loaded>;  // by next time, then offset of chunk

  std::optional<ByteBuffer> unpack(const PackedChunk& chunk);
  std::optional<Loaded> load(const Chunk& chunk);
  bool is_selected(const Chunk& chunk) const;
  void load_up_to_date();

  std::vector<Chunk> chunks_;  // in the order of their first time, once opened
  std::set<int> selected_;
  Open open_;
  std::size_t open_bytes_ = 0;
  Open::node_type current_;     // of the message given last
  std::size_t next_chunk_ = 0;  // to be loaded
  std::size_t refused_ = 0;     // chunks whose loading had to wait: index + 1 of the last
  std::optional<std::int64_t> last_time_;
  bool is_opening_ = true;
  bool is_noted_ = false;                        // while a chunk is loaded again
  std::map<std::string, std::size_t> notes_[2];  // found out when opened, since reading last began
};

}  // namespace roslam
