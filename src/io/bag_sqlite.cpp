#include "bag_sqlite.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>

#include "bag_bytes.h"
#include "bag_message.h"

namespace planar_vslam::io {
namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};

class SqliteFile : public MessageSource {
 public:
  explicit SqliteFile(const std::filesystem::path& path);
  std::string_view Bytes(const SourceMessage& message, std::size_t limit) override;

 private:
  using Statement = std::unique_ptr<sqlite3_stmt, Close>;
  [[noreturn]] void Fail() const;
  Statement Prepare(const char* query) const;
  // Whether there is a next row.
  bool Step(const Statement& statement) const;
  void ReadTopics();
  void ReadMessages();

  std::unique_ptr<sqlite3, Close> database_;
  std::unique_ptr<sqlite3_blob, Close> blob_;
  std::map<std::int64_t, std::optional<std::uint32_t>> topic_of_id_;  // where it is one that is read
  std::string bytes_, unpacked_;
};

// Where nothing waits beside the file to be put into it, it is said not to change: SQLite then writes nothing beside
// it, which it may not where recordings are kept read-only.
std::string Uri(const std::filesystem::path& path) {
  std::string uri = "file://";  // with no host: a path may begin with two slashes
  for (const char c : std::filesystem::absolute(path).string()) {
    const bool special = c == '%' || c == '?' || c == '#';
    uri += special ? fmt::format("%{:02x}", static_cast<int>(c)) : std::string(1, c);
  }
  std::error_code ignored;
  for (const char* beside : {"-wal", "-journal"}) {
    const std::uintmax_t waiting = std::filesystem::file_size(path.string() + beside, ignored);
    if (!ignored && waiting > 0) return uri;
  }
  return uri + "?immutable=1";
}

SqliteFile::SqliteFile(const std::filesystem::path& path) {
  sqlite3* opened = nullptr;
  const int result = sqlite3_open_v2(Uri(path).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  database_.reset(opened);
  if (result != SQLITE_OK) Fail();
  ReadTopics();
  ReadMessages();
}

void SqliteFile::Fail() const {
  const char* why = sqlite3_errmsg(database_.get());
  const int code = sqlite3_errcode(database_.get());
  if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB) {
    throw BadBag{
        fmt::format("damaged or cut off: {}; expected an intact file (`sqlite3 FILE .recover` keeps what is left "
                    "of it)",
                    why)};
  }
  throw BadBag{fmt::format("{}; expected the tables topics and messages of a ROS 2 recording", why)};
}

SqliteFile::Statement SqliteFile::Prepare(const char* query) const {
  sqlite3_stmt* prepared = nullptr;
  if (sqlite3_prepare_v2(database_.get(), query, -1, &prepared, nullptr) != SQLITE_OK) Fail();
  return Statement(prepared);
}

bool SqliteFile::Step(const Statement& statement) const {
  const int result = sqlite3_step(statement.get());
  if (result != SQLITE_ROW && result != SQLITE_DONE) Fail();
  return result == SQLITE_ROW;
}

std::string_view TextColumn(sqlite3_stmt* statement, int column) {
  const unsigned char* text = sqlite3_column_text(statement, column);
  const int length = sqlite3_column_bytes(statement, column);
  return text == nullptr ? std::string_view()
                         : std::string_view(reinterpret_cast<const char*>(text), static_cast<std::size_t>(length));
}

void SqliteFile::ReadTopics() {
  const Statement rows = Prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  while (Step(rows)) {
    std::optional<std::uint32_t>& topic = topic_of_id_[sqlite3_column_int64(rows.get(), 0)];
    std::optional<SourceTopic> read =
        ToSourceTopic(TextColumn(rows.get(), 1), TextColumn(rows.get(), 2), TextColumn(rows.get(), 3));
    if (!read.has_value()) continue;
    topic = static_cast<std::uint32_t>(contents.topics.size());
    contents.topics.push_back(std::move(*read));
  }
}

void SqliteFile::ReadMessages() {
  const Statement rows = Prepare("SELECT rowid, topic_id, timestamp FROM messages ORDER BY timestamp, rowid");
  long of_no_topic = 0;
  while (Step(rows)) {
    const auto topic = topic_of_id_.find(sqlite3_column_int64(rows.get(), 1));
    of_no_topic += topic == topic_of_id_.end() ? 1 : 0;
    if (topic == topic_of_id_.end() || !topic->second.has_value()) continue;
    contents.messages.push_back({*topic->second, sqlite3_column_int64(rows.get(), 2), 0,
                                 static_cast<std::uint64_t>(sqlite3_column_int64(rows.get(), 0))});
  }
  if (of_no_topic > 0) {
    contents.notes.push_back(fmt::format("{} messages are of a topic that table topics does not have", of_no_topic));
  }
}

std::string_view SqliteFile::Bytes(const SourceMessage& message, std::size_t limit) {
  const auto row = static_cast<std::int64_t>(message.position);
  sqlite3_blob* opened = blob_.release();
  if (opened == nullptr || sqlite3_blob_reopen(opened, row) != SQLITE_OK) {
    sqlite3_blob_close(opened);
    if (sqlite3_blob_open(database_.get(), "main", "messages", "data", row, 0, &opened) != SQLITE_OK) {
      sqlite3_blob_close(opened);
      throw DamagedMessage();  // another type than bytes, or nothing
    }
  }
  blob_.reset(opened);
  constexpr std::size_t kToTell = 4;  // bytes that tell whether it is packed
  const auto size = static_cast<std::size_t>(sqlite3_blob_bytes(opened));
  const auto read = [this, opened](std::size_t count) {
    bytes_.resize(count);
    if (sqlite3_blob_read(opened, bytes_.data(), static_cast<int>(count), 0) != SQLITE_OK) {
      throw BadBag{sqlite3_errmsg(database_.get())};
    }
  };
  read(std::min(size, std::max(limit, kToTell)));
  if (IsZstd(bytes_)) read(size);
  return Unpacked(bytes_, &unpacked_).substr(0, limit);
}

}  // namespace

std::unique_ptr<MessageSource> OpenSqliteBag(const std::filesystem::path& path) {
  return std::make_unique<SqliteFile>(path);
}

}  // namespace planar_vslam::io
