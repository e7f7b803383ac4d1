#pragma once
// A file of messages that rosbag does not read: which messages are where in it. What they say: bag_message.h.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace planar_vslam::io {

enum class MessageEncoding { kCdr, kRos1 };

struct SourceTopic {
  std::string name;
  std::string type;  // as ROS 1 spells it: sensor_msgs/Image
  MessageEncoding encoding = MessageEncoding::kCdr;
};

struct SourceMessage {
  std::uint32_t topic = 0;                // of MessageSource::topics
  std::int64_t recorded = 0;              // ns
  std::uint64_t block = 0, position = 0;  // where it is, for its source
};

class MessageSource {
 public:
  virtual ~MessageSource() = default;
  // The first bytes of a message, at most `limit`; they stay until the next call. Throws BadBag, and DamagedMessage
  // where only this message is damaged.
  virtual std::string_view Bytes(const SourceMessage& message, std::size_t limit) = 0;

  // Only those of the types that are read.
  const std::vector<SourceTopic>& topics() const { return contents.topics; }
  // In the order of recording.
  const std::vector<SourceMessage>& messages() const { return contents.messages; }
  // What the user should know.
  const std::vector<std::string>& notes() const { return contents.notes; }

 protected:
  struct Contents {
    std::vector<SourceTopic> topics;
    std::vector<SourceMessage> messages;
    std::vector<std::string> notes;
  };
  Contents contents;
};

// Nothing for a type that is not read, in ROS 1's spelling or ROS 2's (sensor_msgs/msg/Image). Throws OtherBag where
// one that is read has an encoding (cdr, ros1) that is not.
std::optional<SourceTopic> ToSourceTopic(std::string_view name, std::string_view type, std::string_view encoding);

// The decompressed bytes of a zstd frame, which has to say how many; throws BadBag.
std::string UnpackZstd(std::string_view packed);
// The `size` decompressed bytes of zstd frames: some writers' do not say how many. Throws BadBag.
std::string UnpackZstd(std::string_view packed, std::uint64_t size);
// Whether they are a zstd frame.
bool IsZstd(std::string_view bytes);
// A message as it was before ROS 2's recorder packed it, where it did (compression mode `message`): the bytes, or
// `memory` that holds them now, which is not what `bytes` are in. Throws DamagedMessage.
std::string_view Unpacked(std::string_view bytes, std::string* memory);

// The most bytes that a block of a file may say it unpacks to: far more than recorders write, far less than would
// exhaust a machine.
constexpr std::uint64_t kLargestBlock = std::uint64_t{1} << 30U;

}  // namespace planar_vslam::io
