// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sqlite3.h>

#include <filesystem>
#include <memory>

#include "tests/recording_writer.hpp"

namespace roslam {

struct Db3Options {
  bool compresses_messages = false;  ///< each with zstd
  bool has_time_index = true;
  bool has_definitions = true;  ///< table of ROS 2 Iron and later
};

/// The SQLite file of rosbag2.
class Db3Writer : public RecordingWriter {
 public:
  using Options = Db3Options;

  explicit Db3Writer(const std::filesystem::path& file, Options options = {}) : options_(options) {
    std::filesystem::remove(file);
    sqlite3* opened = nullptr;
    const int state = sqlite3_open(file.c_str(), &opened);
    database_.reset(opened);
    if (state != SQLITE_OK) throw std::runtime_error("sqlite cannot open " + file.string());
    run("PRAGMA synchronous = OFF");  // faster
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)");
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT "
        "NULL, "
        "data BLOB NOT NULL)");
    if (options_.has_time_index) run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    if (options_.has_definitions)
      run("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT "
          "NOT "
          "NULL, encoded_message_definition TEXT NOT NULL)");
    run("BEGIN");
  }
  ~Db3Writer() override { insert_.reset(); }

  int add_topic(const std::string& name, const std::string& type, const std::string& definition) override {
    ++topics_;
    const Statement row = prepare("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')");
    sqlite3_bind_int(row.get(), 1, topics_);
    bind(row.get(), 2, name);
    bind(row.get(), 3, type);
    step(row.get());
    if (options_.has_definitions) {
      const Statement described = prepare("INSERT INTO message_definitions VALUES (?, ?, 'ros2msg', ?)");
      sqlite3_bind_int(described.get(), 1, topics_);
      bind(described.get(), 2, type);
      bind(described.get(), 3, definition);
      step(described.get());
    }
    return topics_;
  }

  void write(int topic, std::int64_t time, std::span<const std::uint8_t> bytes) override {
    if (!insert_) insert_ = prepare("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)");
    const std::string data = compressed(options_.compresses_messages ? "zstd" : "none",
                                        {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    sqlite3_bind_int(insert_.get(), 1, topic);
    sqlite3_bind_int64(insert_.get(), 2, time);
    sqlite3_bind_blob(insert_.get(), 3, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    step(insert_.get());
    sqlite3_reset(insert_.get());
  }

  void close() override {
    run("COMMIT");
    insert_.reset();
    database_.reset();
  }

  /// Any SQL, for tests of unusual files.
  void run(const std::string& sql) {
    if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      throw std::runtime_error(sql + ": " + sqlite3_errmsg(database_.get()));
  }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close(database); }
  };
  struct Finish {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finish>;

  Statement prepare(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK)
      throw std::runtime_error(sql + ": " + sqlite3_errmsg(database_.get()));
    return Statement(statement);
  }
  static void bind(sqlite3_stmt* statement, int column, const std::string& text) {
    sqlite3_bind_text(statement, column, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
  }
  void step(sqlite3_stmt* statement) {
    if (sqlite3_step(statement) != SQLITE_DONE) throw std::runtime_error(sqlite3_errmsg(database_.get()));
  }

  Options options_;
  std::unique_ptr<sqlite3, Close> database_;
  Statement insert_;
  int topics_ = 0;
};

}  // namespace roslam
