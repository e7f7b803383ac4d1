#pragma once
// octomap_msgs/Octomap on the wire, for machines without that package: who has it reads these messages as its own.
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <std_msgs/Header.h>

#include <cstdint>
#include <string>
#include <vector>

namespace planar_vslam::ros_face {

struct OctomapMessage {
  std_msgs::Header header;
  std::uint8_t binary = 0;  // occupied or free only
  std::string id;           // of the tree's class
  double resolution = 0.0;  // m
  std::vector<std::int8_t> data;
};

}  // namespace planar_vslam::ros_face

namespace ros {
namespace message_traits {

template <>
struct IsMessage<planar_vslam::ros_face::OctomapMessage> : TrueType {};
template <>
struct HasHeader<planar_vslam::ros_face::OctomapMessage> : TrueType {};

template <>
struct DataType<planar_vslam::ros_face::OctomapMessage> {
  static const char* value() { return "octomap_msgs/Octomap"; }
  static const char* value(const planar_vslam::ros_face::OctomapMessage&) { return value(); }
};

// Of the definition below; roscpp connects only where both sides agree on it.
template <>
struct MD5Sum<planar_vslam::ros_face::OctomapMessage> {
  static const char* value() { return "9a45536b45c5e409cd49f04bb2d9999f"; }
  static const char* value(const planar_vslam::ros_face::OctomapMessage&) { return value(); }
};

template <>
struct Definition<planar_vslam::ros_face::OctomapMessage> {
  static const char* value() {
    return "Header header\nbool binary\nstring id\nfloat64 resolution\nint8[] data\n"
           "================================================================================\n"
           "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
  }
  static const char* value(const planar_vslam::ros_face::OctomapMessage&) { return value(); }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<planar_vslam::ros_face::OctomapMessage> {
  template <class Stream, class Message>
  static void allInOne(Stream& stream, Message message) {
    stream.next(message.header);
    stream.next(message.binary);
    stream.next(message.id);
    stream.next(message.resolution);
    stream.next(message.data);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

}  // namespace serialization
}  // namespace ros
