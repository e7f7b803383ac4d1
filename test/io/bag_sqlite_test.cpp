// What is particular about the SQLite files of ROS 2's recorder; the rest is tested with every kind of bag.
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <zstd.h>

#include <fstream>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

class SqliteBag : public ::testing::Test {
 protected:
  fs::path Path() const { return folder_.path() / "drive.db3"; }
  // A camera's ten images, then `statements` on the tables.
  fs::path Camera(const std::string& statements = "") const {
    {
      BagWriter writer(Path());
      writer.PutInfo();
      for (int i = 1; i <= 10; ++i) writer.PutImage(0.1 * i);
    }
    sqlite3* database = nullptr;
    sqlite3_open(Path().c_str(), &database);
    EXPECT_EQ(sqlite3_exec(database, statements.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database);
    sqlite3_close(database);
    return Path();
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(SqliteBag, MissingTablesAndColumnsAreNamed) {
  ExpectInError(OpenError(Camera("DROP TABLE topics")), {"drive.db3", "topics", "ROS 2 recording"});
  ExpectInError(OpenError(Camera("DROP TABLE messages")), {"drive.db3", "messages", "ROS 2 recording"});
  ExpectInError(OpenError(Camera("ALTER TABLE topics RENAME COLUMN type TO kind")), {"drive.db3", "type"});
}

TEST_F(SqliteBag, FilesThatAreNoDatabasesAreErrors) {
  for (const char* text : {"", "hello world, this is no database", "SQLite format 3"}) {
    WriteText(Path(), text);
    ExpectInError(OpenError(Path()), {"drive.db3"});
  }
}

TEST_F(SqliteBag, ARecordingThatWasCutOffSaysSo) {
  const fs::path path = Camera();
  fs::resize_file(path, fs::file_size(path) / 2);
  ExpectInError(OpenError(path), {"drive.db3", "cut off", "sqlite3 FILE .recover"});
}

TEST_F(SqliteBag, AJournalledRecordingIsReadWhereNothingMayBeWritten) {
  const fs::path path = Camera("PRAGMA journal_mode = WAL; DELETE FROM messages WHERE id = 2");
  const AsReader reader(path);
  if (!reader.works()) GTEST_SKIP() << "root that cannot be anybody else, or a folder of root's";
  EXPECT_EQ(Play(path).images.size(), 9U) << OpenError(path);
}

TEST_F(SqliteBag, RowsWithoutBytesAreCounted) {
  const Replay replay =
      Play(Camera("UPDATE messages SET data = 'text' WHERE id = 3;"
                  "UPDATE messages SET data = x'0001' WHERE id = 5;"
                  "UPDATE messages SET data = 7 WHERE id = 7;"));
  EXPECT_EQ(replay.images.size(), 7U);
  EXPECT_EQ(replay.skipped.at("message cut short"), 2);
  EXPECT_EQ(replay.skipped.at("message not in plain CDR"), 1);
}

TEST_F(SqliteBag, MessagesOfNoTopicAreSaid) {
  const Replay replay = Play(Camera("UPDATE messages SET topic_id = 99 WHERE id IN (3, 4)"));
  EXPECT_EQ(replay.images.size(), 8U);
  ASSERT_EQ(replay.info.notes.size(), 1U);
  EXPECT_NE(replay.info.notes[0].find("2 messages are of a topic"), std::string::npos) << replay.info.notes[0];
}

TEST_F(SqliteBag, OtherSerialisationsAreNamedOtherTypesIgnored) {
  ExpectInError(OpenError(Camera("UPDATE topics SET serialization_format = 'yaml'")), {"'yaml'", "cdr"});
  ExpectInError(OpenError(Camera("UPDATE topics SET type = 'my_msgs/msg/Image' WHERE name LIKE '%image%'")),
                {"no images"});
  // Bytes of another type: every message ends before its fields.
  ExpectInError(
      OpenError(Camera("UPDATE topics SET type = 'sensor_msgs/msg/CompressedImage' WHERE name LIKE '%image%'")),
      {"no usable image"});
}

// Compression mode `message` of ROS 2's recorder.
TEST_F(SqliteBag, MessagesPackedOneByOneAreUnpacked) {
  {
    BagWriter writer(Path());
    writer.PutInfo();
    sensor_msgs::Image image = RawImage(RampImage(), "mono8");
    for (int i = 1; i <= 3; ++i) {
      image.header.stamp = At(0.1 * i);
      io::CdrWriter cdr;
      cdr(image);
      std::string packed(ZSTD_compressBound(cdr.bytes().size()), '\0');
      packed.resize(ZSTD_compress(packed.data(), packed.size(), cdr.bytes().data(), cdr.bytes().size(), 1));
      if (i == 2) packed.resize(packed.size() / 2);
      writer.PutBytes("/camera/image_raw", "sensor_msgs/Image", packed, 0.1 * i);
    }
  }
  const Replay replay = Play(Path());
  EXPECT_EQ(replay.images.size(), 2U);
  EXPECT_EQ(replay.skipped.at("message cut short"), 1);
}

}  // namespace
}  // namespace planar_vslam::test
