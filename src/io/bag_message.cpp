#include "bag_message.h"

#include <fmt/format.h>

namespace planar_vslam::io {

const std::string& StoredMessage::topic() const {
  if (const auto* bag = std::get_if<rosbag::MessageInstance>(&place_)) return bag->getTopic();
  return topic(std::get<InSource>(place_)).name;
}

Timestamp StoredMessage::recorded() const {
  if (const auto* bag = std::get_if<rosbag::MessageInstance>(&place_)) {
    return {static_cast<std::int64_t>(bag->getTime().toNSec())};
  }
  return {std::get<InSource>(place_).message.recorded};
}

std_msgs::Header StoredMessage::ReadHeader() const {
  std_msgs::Header header;
  const auto* bag = std::get_if<rosbag::MessageInstance>(&place_);
  if (bag == nullptr) {
    constexpr std::size_t kHeader = 4096;  // bytes: more than any name of a frame
    Decode(std::get<InSource>(place_), kHeader, &header);
    return header;
  }
  std::vector<std::uint8_t> bytes(bag->size());
  ros::serialization::OStream copy(bytes.data(), bag->size());
  bag->write(copy);
  try {
    ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, header);
  } catch (const ros::serialization::StreamOverrunException&) {
    throw DamagedMessage();
  }
  return header;
}

void StoredMessage::RefuseType(const std::string& type) const {
  throw std::runtime_error(fmt::format("topic {} has another definition of {}", topic(), type));
}

}  // namespace planar_vslam::io
