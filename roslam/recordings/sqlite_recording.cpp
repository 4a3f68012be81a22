// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/sqlite_recording.hpp"

#include <sqlite3.h>

#include <string>

#include "roslam/common/error.hpp"
#include "roslam/recordings/message_unpacker.hpp"
#include "roslam/recordings/recording_file.hpp"
#include "roslam/recordings/topic_table.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMaxDefinitionBytes = std::size_t{64} << 20;
constexpr std::uintmax_t kMaxCountedBytes = std::uintmax_t{1} << 30;  // counting reads a part of the file

// A URI, as only it can say that nothing may be written.
std::string uri_of(const std::filesystem::path& path) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                          std::string_view("/._-").find(c) != std::string_view::npos;
    const auto byte = static_cast<unsigned char>(c);
    if (is_plain) {
      uri += c;
    } else {
      uri += {'%', kHex[byte >> 4U], kHex[byte & 15U]};
    }
  }
  return uri + "?mode=ro&immutable=1";
}

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

std::string text_of(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text == nullptr ? std::string() : text;
}

class SqliteRecording : public Recording {
 public:
  explicit SqliteRecording(const std::filesystem::path& path)
      : name_(path.string()), file_size_(std::filesystem::file_size(path)), topics_(name_) {
    require_whole(path);
    open();
    require_tables();
    read_topics();
    read_times();
    note_journal(path);
    select({});
  }

  const std::vector<RecordedTopic>& topics() const override { return topics_.all(); }
  std::string container() const override { return "rosbag2 SQLite"; }
  std::optional<std::pair<std::int64_t, std::int64_t>> time_range() const override { return times_; }

  void select(const std::set<int>& topics) override {
    selected_ = topics;
    notes_[1].clear();
    order_ = prepare("SELECT id, topic_id, timestamp FROM messages ORDER BY timestamp, id");
    content_ = prepare("SELECT data FROM messages WHERE id = ?");
  }

  std::optional<RecordedMessage> next() override {
    while (order_) {
      const int state = sqlite3_step(order_.get());
      if (state != SQLITE_ROW) {
        order_.reset();
        if (state != SQLITE_DONE) ++notes_[1]["damaged page; what follows was left out"];
        break;
      }
      if (auto message = message_of_row()) return message;
    }
    return std::nullopt;
  }

  std::map<std::string, std::size_t> notes() const override {
    auto all = notes_[0];
    for (const auto& [what, count] : notes_[1]) all[what] += count;
    return all;
  }

 private:
  // A database that lacks pages cannot be read in order, and one page that is cut would give damaged data.
  void require_whole(const std::filesystem::path& path) const {
    RecordingFile file(path);
    const ByteSpan header = file.view(0, 100);
    const auto big_endian = [&](std::size_t offset, std::size_t count) {
      std::uint64_t value = 0;
      for (std::size_t i = offset; i < offset + count; ++i) value = value << 8U | header[i];
      return value;
    };
    std::uint64_t needed = 100;
    if (header.size() == 100) {
      const std::uint64_t page = big_endian(16, 2) == 1 ? 65536 : big_endian(16, 2);
      const bool is_counted = big_endian(24, 4) == big_endian(92, 4);  // else an old program wrote it
      needed = page * (is_counted ? big_endian(28, 4) : 1);
    }
    if (file.size() >= needed) return;
    throw InputError(name_ + ": truncated, it has " + std::to_string(file.size()) + " of " +
                     std::to_string(needed) +
                     " bytes; copy it again, or recover what is left with sqlite3 FILE .recover");
  }

  void open() {
    sqlite3* opened = nullptr;
    const int state =
        sqlite3_open_v2(uri_of(name_).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    database_.reset(opened);
    if (state != SQLITE_OK) fail();
    sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(kMaxChunkBytes));
    // The schema is of a file that anybody may have made: nothing in it is executed.
    sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  }

  [[noreturn]] void fail() const {
    const char* why = database_ ? sqlite3_errmsg(database_.get()) : "out of memory";
    throw InputError(name_ + ": not a readable rosbag2 recording (" + why +
                     "); recover it with sqlite3 FILE .recover, or give another file");
  }

  Statement prepare(const char* sql) const {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr) != SQLITE_OK) fail();
    return Statement(statement);
  }

  void require_tables() const {
    const Statement tables = prepare(
        "SELECT count(*) FROM sqlite_master WHERE name IN ('topics', 'messages') AND sql LIKE 'CREATE "
        "TABLE%'");
    if (sqlite3_step(tables.get()) != SQLITE_ROW) fail();
    if (sqlite3_column_int(tables.get(), 0) != 2) {
      throw InputError(name_ +
                       ": a database without the tables topics and messages of rosbag2; give another "
                       "file");
    }
  }

  // By type. They are in a table of their own, since ROS 2 Iron.
  std::map<std::string, std::string> definitions() const {
    std::map<std::string, std::string> found;
    sqlite3_stmt* statement = nullptr;
    constexpr const char* kQuery = "SELECT topic_type, encoded_message_definition FROM message_definitions";
    if (sqlite3_prepare_v2(database_.get(), kQuery, -1, &statement, nullptr) != SQLITE_OK) return found;
    const Statement rows(statement);
    std::size_t bytes = 0;
    while (bytes < kMaxDefinitionBytes && sqlite3_step(rows.get()) == SQLITE_ROW) {
      const std::string type = text_of(rows.get(), 0);
      const std::string definition = text_of(rows.get(), 1);
      bytes += type.size() + definition.size();
      found.try_emplace(type, definition);
    }
    return found;
  }

  void read_topics() {
    const std::map<std::string, std::string> described = definitions();
    const Statement rows = prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    while (sqlite3_step(rows.get()) == SQLITE_ROW) {
      RecordedTopic topic;
      topic.name = text_of(rows.get(), 1);
      topic.type = text_of(rows.get(), 2);
      topic.encoding = text_of(rows.get(), 3);
      if (const auto found = described.find(topic.type); found != described.end())
        topic.definition = found->second;
      topics_.assign(static_cast<std::uint32_t>(sqlite3_column_int64(rows.get(), 0)), topics_.add(topic));
    }
    if (file_size_ > kMaxCountedBytes) return;
    for (const RecordedTopic& topic : topics_.all()) topics_.count(topic.id, 0);
    const Statement counts = prepare("SELECT topic_id, count(*) FROM messages GROUP BY topic_id");
    while (sqlite3_step(counts.get()) == SQLITE_ROW) {
      if (const auto topic = topics_.of(static_cast<std::uint32_t>(sqlite3_column_int64(counts.get(), 0))))
        topics_.count(*topic, static_cast<std::size_t>(sqlite3_column_int64(counts.get(), 1)));
    }
  }

  void read_times() {
    std::int64_t times[2];
    const char* const kQueries[] = {"SELECT min(timestamp) FROM messages",
                                    "SELECT max(timestamp) FROM messages"};
    for (int i = 0; i < 2; ++i) {  // one by one, each is looked up in the index
      const Statement row = prepare(kQueries[i]);
      if (sqlite3_step(row.get()) != SQLITE_ROW || sqlite3_column_type(row.get(), 0) != SQLITE_INTEGER)
        return;
      times[i] = sqlite3_column_int64(row.get(), 0);
    }
    times_ = {times[0], times[1]};
  }

  void note_journal(const std::filesystem::path& path) {
    for (const char* ending : {"-wal", "-journal"}) {
      std::error_code error;
      const std::uintmax_t size = std::filesystem::file_size(path.string() + ending, error);
      if (!error && size > 0)
        ++notes_[0][std::string("a crash left a journal (") + ending +
                    "), whose messages are not read; open a copy of both files with sqlite3 to add them"];
    }
  }

  std::optional<RecordedMessage> message_of_row() {
    sqlite3_stmt* row = order_.get();
    const auto topic = topics_.of(static_cast<std::uint32_t>(sqlite3_column_int64(row, 1)));
    if (!topic || sqlite3_column_type(row, 2) != SQLITE_INTEGER) {
      ++notes_[1]["message without a time, or of a topic that the file does not describe, left out"];
      return std::nullopt;
    }
    if (!selected_.empty() && !selected_.contains(*topic)) return std::nullopt;
    sqlite3_reset(content_.get());
    sqlite3_bind_int64(content_.get(), 1, sqlite3_column_int64(row, 0));
    if (sqlite3_step(content_.get()) != SQLITE_ROW) {
      ++notes_[1]["damaged message, left out"];
      return std::nullopt;
    }
    const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(content_.get(), 0));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(content_.get(), 0));
    const auto& encoding = topics_.all()[static_cast<std::size_t>(*topic)].encoding;
    const auto data = unpacker_.unpack(encoding, {bytes, size}, name_);
    if (!data) {
      ++notes_[1][kDamagedMessage];
      return std::nullopt;
    }
    return RecordedMessage{*topic, sqlite3_column_int64(row, 2), *data};
  }

  std::string name_;
  std::uintmax_t file_size_;
  TopicTable topics_;
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  Statement order_;    // messages in the order of time, without their data
  Statement content_;  // data of one message
  std::set<int> selected_;
  std::optional<std::pair<std::int64_t, std::int64_t>> times_;
  MessageUnpacker unpacker_;
  std::map<std::string, std::size_t> notes_[2];  // found out when opened, since reading last began
};
}  // namespace

std::unique_ptr<Recording> open_sqlite_recording(const std::filesystem::path& path) {
  return std::make_unique<SqliteRecording>(path);
}

}  // namespace roslam
