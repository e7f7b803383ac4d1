#pragma once
// One stored message, whatever file it is in. From here on it is a ROS 1 message: ROS 2's hold the same fields.
#include <rosbag/message_instance.h>
#include <std_msgs/Header.h>

#include <limits>
#include <new>
#include <stdexcept>
#include <string>
#include <variant>

#include "bag_cdr.h"
#include "bag_source.h"
#include "planar_vslam/sensor/timestamp.h"

namespace planar_vslam::io {

// Recordings of robots hold single messages that are damaged. The reason is one to count them by.
struct DamagedMessage : std::runtime_error {
  explicit DamagedMessage(const char* reason = "message cut short") : std::runtime_error(reason) {}
};

class StoredMessage {
 public:
  explicit StoredMessage(const rosbag::MessageInstance& message) : place_(message) {}
  // The source outlives the message.
  StoredMessage(MessageSource* source, const SourceMessage& message) : place_(InSource{source, message}) {}

  const std::string& topic() const;
  Timestamp recorded() const;
  // The message as M. Throws DamagedMessage; std::exception where the file has another definition of the type, or is
  // broken.
  template <class M>
  boost::shared_ptr<M> Read() const;
  // The same; null where it is damaged.
  template <class M>
  boost::shared_ptr<M> ReadIfWhole() const;
  // The header that every message of ours but tf begins with.
  std_msgs::Header ReadHeader() const;

 private:
  struct InSource {
    MessageSource* source;
    SourceMessage message;
  };
  const SourceTopic& topic(const InSource& place) const { return place.source->topics()[place.message.topic]; }
  [[noreturn]] void RefuseType(const std::string& type) const;
  template <class M>
  void Decode(const InSource& place, std::size_t limit, M* message) const;

  std::variant<rosbag::MessageInstance, InSource> place_;
};

template <class M>
boost::shared_ptr<M> StoredMessage::Read() const {
  if (const auto* bag = std::get_if<rosbag::MessageInstance>(&place_)) {
    try {
      boost::shared_ptr<M> message = bag->instantiate<M>();
      if (message == nullptr) RefuseType(bag->getDataType());
      return message;
    } catch (const ros::serialization::StreamOverrunException&) {
      throw DamagedMessage();
    }
  }
  const InSource& place = std::get<InSource>(place_);
  if (topic(place).type != ros::message_traits::datatype<M>()) RefuseType(topic(place).type);
  auto message = boost::make_shared<M>();
  Decode(place, std::numeric_limits<std::size_t>::max(), message.get());
  return message;
}

template <class M>
boost::shared_ptr<M> StoredMessage::ReadIfWhole() const {
  try {
    return Read<M>();
  } catch (const DamagedMessage&) {
    return nullptr;
  }
}

template <class M>
void StoredMessage::Decode(const InSource& place, std::size_t limit, M* message) const {
  const std::string_view bytes = place.source->Bytes(place.message, limit);
  if (topic(place).encoding == MessageEncoding::kCdr) {
    CdrReader reader(bytes);
    reader(*message);
    return;
  }
  try {
    std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());  // its stream takes no const bytes
    ros::serialization::IStream stream(copy.data(), static_cast<std::uint32_t>(copy.size()));
    ros::serialization::deserialize(stream, *message);
  } catch (const ros::serialization::StreamOverrunException&) {
    throw DamagedMessage();
  } catch (const std::bad_alloc&) {  // by a damaged count
    throw DamagedMessage();
  }
}

}  // namespace planar_vslam::io
