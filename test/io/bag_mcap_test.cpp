// What is particular about MCAP files; the rest is tested with every kind of bag.
#include "bag_mcap.h"

#include <gtest/gtest.h>
#include <zstd.h>

#include <fstream>
#include <iterator>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

std::string Contents(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

template <class Number>
std::string Little(Number number) {
  return {reinterpret_cast<const char*>(&number), sizeof(Number)};
}
std::string Text(const std::string& text) { return Little(static_cast<std::uint32_t>(text.size())) + text; }
std::string Record(io::McapRecord type, const std::string& content) {
  return static_cast<char>(type) + Little(static_cast<std::uint64_t>(content.size())) + content;
}
const std::string& Magic() {
  static const std::string magic(io::kMcapMagic);
  return magic;
}

std::string Schema(std::uint16_t id, const std::string& name) {
  return Record(io::McapRecord::kSchema, Little(id) + Text(name) + Text("ros2msg") + Text(""));
}
std::string Channel(std::uint16_t id, std::uint16_t schema, const std::string& topic, const std::string& encoding) {
  return Record(io::McapRecord::kChannel, Little(id) + Little(schema) + Text(topic) + Text(encoding) + Text(""));
}
std::string MessageOf(std::uint16_t channel, double t, const std::string& bytes) {
  const std::string time = Little(StampAt(t).nanoseconds);
  return Record(io::McapRecord::kMessage, Little(channel) + Little(std::uint32_t{0}) + time + time + bytes);
}
template <class M>
std::string Message(std::uint16_t channel, double t, const M& message) {
  io::CdrWriter writer;
  writer(message);
  return MessageOf(channel, t, writer.bytes());
}
// As a stream, which does not know in the beginning how long it is going to be.
std::string Streamed(const std::string& bytes) {
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  ZSTD_outBuffer out{packed.data(), packed.size(), 0};
  ZSTD_compressStream2(context.get(), &out, &in, ZSTD_e_continue);
  ZSTD_compressStream2(context.get(), &out, &in, ZSTD_e_end);
  packed.resize(out.pos);
  return packed;
}
template <class M>
std::string PackedMessage(std::uint16_t channel, double t, const M& message) {
  io::CdrWriter writer;
  writer(message);
  std::string packed(ZSTD_compressBound(writer.bytes().size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), writer.bytes().data(), writer.bytes().size(), 1));
  return MessageOf(channel, t, packed);
}
std::string Chunk(const std::string& records, const std::string& compression, std::uint64_t size,
                  std::uint32_t checksum = 0) {
  return Record(io::McapRecord::kChunk, Little(std::uint64_t{0}) + Little(std::uint64_t{0}) + Little(size) +
                                            Little(checksum) + Text(compression) +
                                            Little(static_cast<std::uint64_t>(records.size())) + records);
}

class Mcap : public ::testing::Test {
 protected:
  fs::path Path() const { return folder_.path() / "drive.mcap"; }
  // A second of a robot.
  fs::path Drive(const io::McapLayout& layout = {}) const {
    BagWriter writer(io::CreateMcap(Path(), layout));
    writer.PutInfo();
    writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
    for (int i = 1; i <= 50; ++i) {
      writer.PutOdometry(0.02 * i, 0.01 * i);
      if (i % 5 == 0) writer.PutImage(0.02 * i);
    }
    return Path();
  }
  fs::path Write(const std::string& bytes) const {
    std::ofstream(Path(), std::ios::binary) << bytes;
    return Path();
  }
  std::string ErrorOf(const std::string& records) const { return OpenError(Write(Magic() + records)); }
  // The camera's records, outside of a chunk; its image comes at second 1.
  static std::string Camera(const std::string& encoding = "cdr") {
    sensor_msgs::Image image = RawImage(RampImage(), "mono8");
    image.header.stamp = At(1.0);
    return Schema(1, "sensor_msgs/msg/CameraInfo") + Schema(2, "sensor_msgs/msg/Image") +
           Channel(1, 1, "/camera/camera_info", "cdr") + Channel(2, 2, "/camera/image_raw", encoding) +
           Message(1, 1.0, Info()) + Message(2, 1.0, image);
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(Mcap, EveryLayoutIsTheSameDrive) {
  const Replay usual = Play(Drive());
  ASSERT_EQ(usual.error, "");
  ASSERT_EQ(usual.images.size(), 10U);
  EXPECT_TRUE(usual.info.notes.empty());
  for (const io::McapLayout& layout : {io::McapLayout{true, "lz4", true}, io::McapLayout{true, "", true},
                                       io::McapLayout{false, "", true}, io::McapLayout{true, "zstd", false}}) {
    const Replay replay = Play(Drive(layout));
    EXPECT_EQ(replay.error, "");
    EXPECT_EQ(replay.order, usual.order);
    EXPECT_EQ(replay.stamps, usual.stamps);
  }
}

TEST_F(Mcap, ARecordingThatWasCutOffIsUsedUpToThere) {
  const std::string whole = Contents(Drive({false, "", true}));
  std::size_t images = 0;
  for (const double share : {0.5, 0.7, 0.9}) {
    const Replay replay = Play(Write(whole.substr(0, static_cast<std::size_t>(share * double(whole.size())))));
    EXPECT_EQ(replay.error, "");
    EXPECT_GT(replay.images.size(), images);
    images = replay.images.size();
    ASSERT_EQ(replay.info.notes.size(), 1U);
    EXPECT_NE(replay.info.notes[0].find("cut off"), std::string::npos) << replay.info.notes[0];
  }
  ExpectInError(OpenError(Write(whole.substr(0, 5))), {"drive.mcap", "magic"});
  ExpectInError(OpenError(Write("")), {"drive.mcap", "magic"});
  ExpectInError(OpenError(Write(whole.substr(0, 20))), {"drive.mcap", "no images"});
}

TEST_F(Mcap, ChunksThatCannotBeUnpackedAreErrors) {
  const std::string camera = Camera();
  EXPECT_EQ(ErrorOf(Chunk(camera, "", camera.size())), "");
  ExpectInError(ErrorOf(Chunk(camera, "bz2", camera.size())), {"byte 8", "'bz2'", "zstd, lz4"});
  ExpectInError(ErrorOf(Chunk(camera, "zstd", camera.size())), {"byte 8", "zstd"});
  ExpectInError(ErrorOf(Chunk(camera, "lz4", camera.size())), {"byte 8", "cannot be unpacked"});
  ExpectInError(ErrorOf(Chunk(camera, "", camera.size() + 1)), {"byte 8", "another length"});
  ExpectInError(ErrorOf(Chunk(camera, "", camera.size(), 7)), {"byte 8", "checksum"});
  for (const char* compression : {"", "zstd", "lz4"}) {
    ExpectInError(ErrorOf(Chunk(camera, compression, std::uint64_t{1} << 60U)), {"byte 8", "claims"});
  }
  ExpectInError(ErrorOf(Chunk(camera, "lz4", 1'000'000'000U)), {"byte 8", "claims"});
  ExpectInError(ErrorOf(Chunk(camera.substr(0, camera.size() - 3), "", camera.size() - 3)), {"byte 8", "block of"});
}

TEST_F(Mcap, ChunksPackedAsStreamsAreUnpacked) {
  const std::string camera = Camera(), packed = Streamed(camera);
  ASSERT_EQ(ZSTD_getFrameContentSize(packed.data(), packed.size()), ZSTD_CONTENTSIZE_UNKNOWN);
  EXPECT_EQ(ErrorOf(Chunk(packed, "zstd", camera.size())), "");
  ExpectInError(ErrorOf(Chunk(packed, "zstd", camera.size() + 1)), {"byte 8", "another length"});
  ExpectInError(ErrorOf(Chunk(packed, "zstd", camera.size() - 1)), {"byte 8", "unpacked"});
}

// Compression mode `message` of ROS 2's recorder.
TEST_F(Mcap, MessagesPackedOneByOneAreUnpacked) {
  sensor_msgs::Image image = RawImage(RampImage(), "mono8");
  image.header.stamp = At(1.0);
  EXPECT_EQ(ErrorOf(Schema(1, "sensor_msgs/msg/CameraInfo") + Schema(2, "sensor_msgs/msg/Image") +
                    Channel(1, 1, "/camera/camera_info", "cdr") + Channel(2, 2, "/camera/image_raw", "cdr") +
                    PackedMessage(1, 1.0, Info()) + PackedMessage(2, 1.0, image)),
            "");
}

TEST_F(Mcap, RecordsThatReferToNothingAreErrors) {
  ExpectInError(ErrorOf(Channel(1, 3, "/camera/image_raw", "cdr")), {"/camera/image_raw", "schema"});
  ExpectInError(ErrorOf(Message(4, 1.0, Info())), {"channel"});
  ExpectInError(ErrorOf(Camera() + Record(io::McapRecord::kDataEnd, Little(std::uint32_t{7}))), {"checksum"});
}

TEST_F(Mcap, UnknownRecordsAndTypesAreIgnored) {
  const std::string others = Record(static_cast<io::McapRecord>(0x90), "anything") + Channel(7, 0, "/json", "json") +
                             Schema(8, "foxglove.CompressedImage") + Channel(8, 8, "/other", "protobuf") +
                             Message(8, 0.5, Info());
  EXPECT_EQ(Play(Write(Magic() + others + Camera())).images.size(), 1U);
}

TEST_F(Mcap, MessagesOfRos1AreReadToo) {
  sensor_msgs::Image image = RawImage(RampImage(), "mono8");
  image.header.stamp = At(1.0);
  std::string bytes(ros::serialization::serializationLength(image), '\0');
  ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                     static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, image);
  const std::string time = Little(StampAt(1.0).nanoseconds);
  const std::string records =
      Schema(1, "sensor_msgs/msg/CameraInfo") + Schema(2, "sensor_msgs/Image") +
      Channel(1, 1, "/camera/camera_info", "cdr") + Channel(2, 2, "/camera/image_raw", "ros1") +
      Message(1, 1.0, Info()) +
      Record(io::McapRecord::kMessage, Little(std::uint16_t{2}) + Little(std::uint32_t{0}) + time + time + bytes);
  EXPECT_EQ(Play(Write(Magic() + records)).images.size(), 1U);
  ExpectInError(ErrorOf(Camera("json")), {"/camera/image_raw", "'json'", "cdr or ros1"});
}

TEST_F(Mcap, SeveralChannelsOfATopicAreOneTopic) {
  sensor_msgs::Image image = RawImage(RampImage(), "mono8");
  image.header.stamp = At(2.0);
  const std::string more = Channel(5, 2, "/camera/image_raw", "cdr") + Message(5, 2.0, image);
  EXPECT_EQ(Play(Write(Magic() + Camera() + more)).images.size(), 2U);
}

}  // namespace
}  // namespace planar_vslam::test
