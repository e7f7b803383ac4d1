#include <sqlite3.h>

#include <map>

#include "bag_bytes.h"
#include "bag_sink.h"

namespace planar_vslam::io {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, CloseDatabase>;

// Of an empty file, in one transaction.
constexpr const char* kTables =
    "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; BEGIN;"
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
    " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,"
    " data BLOB NOT NULL);"
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC);";

class SqliteWriter : public MessageSink {
 public:
  explicit SqliteWriter(const std::filesystem::path& path) {
    std::filesystem::remove(path);
    sqlite3* opened = nullptr;
    const int result = sqlite3_open(path.c_str(), &opened);
    database_.reset(opened);
    Check(result == SQLITE_OK);
    Run(kTables);
    add_topic_ = Prepare(
        "INSERT INTO topics(id, name, type, serialization_format, offered_qos_profiles) VALUES(?, ?, ?, 'cdr', ?)");
    add_message_ = Prepare("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)");
  }
  void Write(const std::string& topic, const std::string& type, std::int64_t recorded, std::string_view data) override {
    const auto known = topics_.find(topic);
    const std::int64_t id = known != topics_.end() ? known->second : AddTopic(topic, Ros2Type(type));
    sqlite3_bind_int64(add_message_.get(), 1, id);
    sqlite3_bind_int64(add_message_.get(), 2, recorded);
    sqlite3_bind_blob64(add_message_.get(), 3, data.data(), data.size(), SQLITE_STATIC);
    Insert(add_message_.get());
  }
  void Close() override { Run("COMMIT;"); }

 private:
  void Check(bool done) const {
    if (!done) throw BadBag{sqlite3_errmsg(database_.get())};
  }
  void Run(const char* statements) {
    Check(sqlite3_exec(database_.get(), statements, nullptr, nullptr, nullptr) == SQLITE_OK);
  }
  Statement Prepare(const char* statement) {
    sqlite3_stmt* prepared = nullptr;
    Check(sqlite3_prepare_v2(database_.get(), statement, -1, &prepared, nullptr) == SQLITE_OK);
    return Statement(prepared);
  }
  void Insert(sqlite3_stmt* statement) {
    Check(sqlite3_step(statement) == SQLITE_DONE);
    Check(sqlite3_reset(statement) == SQLITE_OK);
  }
  std::int64_t AddTopic(const std::string& topic, const std::string& type) {
    const auto id = static_cast<std::int64_t>(topics_.size()) + 1;
    topics_.emplace(topic, id);
    sqlite3_bind_int64(add_topic_.get(), 1, id);
    const std::string qos = OfferedQos(topic);
    int column = 2;
    for (const std::string* text : {&topic, &type, &qos}) {
      sqlite3_bind_text(add_topic_.get(), column++, text->data(), static_cast<int>(text->size()), SQLITE_TRANSIENT);
    }
    Insert(add_topic_.get());
    return id;
  }

  std::unique_ptr<sqlite3, CloseDatabase> database_;
  Statement add_topic_, add_message_;
  std::map<std::string, std::int64_t> topics_;
};

}  // namespace

std::unique_ptr<MessageSink> CreateSqliteBag(const std::filesystem::path& path) {
  return std::make_unique<SqliteWriter>(path);
}

}  // namespace planar_vslam::io
