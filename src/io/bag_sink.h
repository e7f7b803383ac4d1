#pragma once
// A file of ROS 2 messages being written.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace planar_vslam::io {

class MessageSink {
 public:
  virtual ~MessageSink() = default;
  // `type` as ROS 1 spells it, `recorded` in ns, `data` in CDR. Throws BadBag.
  virtual void Write(const std::string& topic, const std::string& type, std::int64_t recorded,
                     std::string_view data) = 0;
  // Throws BadBag. Nothing can be written afterwards.
  virtual void Close() = 0;
};

// How an MCAP file is laid out. The default is as ROS 2's recorder does it.
struct McapLayout {
  bool chunks = true;
  std::string compression = "zstd";  // of chunks; or lz4, or none
  bool summary = true;
};

// These replace the file and throw BadBag where it cannot be written.
std::unique_ptr<MessageSink> CreateMcap(const std::filesystem::path& path, const McapLayout& layout = {});
std::unique_ptr<MessageSink> CreateSqliteBag(const std::filesystem::path& path);
// By the end of the name; nothing where it is neither of them.
std::unique_ptr<MessageSink> CreateSink(const std::filesystem::path& path);

// The definition of a message type with all it is made of, as ROS 2 writes it into MCAP files.
std::string Ros2Definition(const std::string& type);
// What ROS 2 offers a topic with when it is played, as its recorder writes it; empty for the usual. Without it nobody
// who comes late would hear /tf_static.
std::string OfferedQos(const std::string& topic);
// sensor_msgs/msg/Image for sensor_msgs/Image.
std::string Ros2Type(const std::string& type);

}  // namespace planar_vslam::io
