#pragma once
// CDR, as ROS 2 serialises messages: 4 bytes that say the byte order, then the fields one after the other, each number
// at a multiple of its size from there; strings and sequences behind their length (OMG DDSI-RTPS 10.5, CORBA CDR). The
// fields of each type are listed once, for reading and for writing, in the order of ROS 2's definitions.
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace planar_vslam::io {

// The fields of M: Visit(archive, message) hands them to the archive. A message type has none that is not listed here.
template <class M>
struct CdrFields;

class CdrReader {
 public:
  // Throws DamagedMessage where the byte order is none of plain CDR's.
  explicit CdrReader(std::string_view bytes);

  // Reads the fields; throws DamagedMessage where the bytes end before them.
  template <class... Fields>
  void operator()(Fields&... fields) {
    (Read(&fields), ...);
  }

 private:
  template <class Number>
  std::enable_if_t<std::is_arithmetic_v<Number>> Read(Number* number) {
    ReadNumbers(number, 1, sizeof(Number));
  }
  template <class T, std::size_t N>
  void Read(boost::array<T, N>* array) {
    ReadNumbers(array->data(), N, sizeof(T));
  }
  template <class T>
  void Read(std::vector<T>* sequence) {
    constexpr bool kNumbers = std::is_arithmetic_v<T>;
    std::size_t count = ReadCount(kNumbers ? sizeof(T) : 1);
    if constexpr (kNumbers) {
      sequence->resize(count);
      if (count > 0) ReadNumbers(sequence->data(), count, sizeof(T));
    } else {
      sequence->clear();  // grows as it is read: what a count claims is no reason to allocate
      for (; count > 0; --count) Read(&sequence->emplace_back());
    }
  }
  template <class M>
  std::enable_if_t<!std::is_arithmetic_v<M>> Read(M* message) {
    CdrFields<M>::Visit(*this, *message);
  }
  void Read(std::string* text);
  void Read(ros::Time* time);

  // The length of a sequence; no longer than elements of that size fit into the bytes that are left.
  std::size_t ReadCount(std::size_t element_size);
  void ReadNumbers(void* numbers, std::size_t count, std::size_t size);

  std::string_view bytes_;  // from behind the 4 bytes
  std::size_t position_ = 0;
  bool swap_;
};

// Little-endian unless told otherwise.
class CdrWriter {
 public:
  explicit CdrWriter(bool big_endian = false);

  template <class... Fields>
  void operator()(const Fields&... fields) {
    (Write(fields), ...);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class Number>
  std::enable_if_t<std::is_arithmetic_v<Number>> Write(const Number& number) {
    WriteNumbers(&number, 1, sizeof(Number));
  }
  template <class T, std::size_t N>
  void Write(const boost::array<T, N>& array) {
    WriteNumbers(array.data(), N, sizeof(T));
  }
  template <class T>
  void Write(const std::vector<T>& sequence) {
    Write(static_cast<std::uint32_t>(sequence.size()));
    if constexpr (std::is_arithmetic_v<T>) {
      if (!sequence.empty()) WriteNumbers(sequence.data(), sequence.size(), sizeof(T));
    } else {
      for (const T& element : sequence) Write(element);
    }
  }
  template <class M>
  std::enable_if_t<!std::is_arithmetic_v<M>> Write(const M& message) {
    CdrFields<M>::Visit(*this, message);
  }
  void Write(const std::string& text);
  void Write(const ros::Time& time);
  void WriteNumbers(const void* numbers, std::size_t count, std::size_t size);

  std::string bytes_;
  bool swap_;
};

template <>
struct CdrFields<std_msgs::Header> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.stamp, m.frame_id);  // no seq, unlike ROS 1
  }
};
template <>
struct CdrFields<geometry_msgs::Point> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.x, m.y, m.z);
  }
};
template <>
struct CdrFields<geometry_msgs::Vector3> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.x, m.y, m.z);
  }
};
template <>
struct CdrFields<geometry_msgs::Quaternion> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.x, m.y, m.z, m.w);
  }
};
template <>
struct CdrFields<geometry_msgs::TransformStamped> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.header, m.child_frame_id, m.transform.translation, m.transform.rotation);
  }
};
template <>
struct CdrFields<tf2_msgs::TFMessage> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.transforms);
  }
};
template <>
struct CdrFields<nav_msgs::Odometry> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.header, m.child_frame_id);
    archive(m.pose.pose.position, m.pose.pose.orientation, m.pose.covariance);
    archive(m.twist.twist.linear, m.twist.twist.angular, m.twist.covariance);
  }
};
template <>
struct CdrFields<sensor_msgs::Image> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.header, m.height, m.width, m.encoding, m.is_bigendian, m.step, m.data);
  }
};
template <>
struct CdrFields<sensor_msgs::CompressedImage> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.header, m.format, m.data);
  }
};
template <>
struct CdrFields<sensor_msgs::CameraInfo> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.header, m.height, m.width, m.distortion_model, m.D, m.K, m.R, m.P, m.binning_x, m.binning_y);
    archive(m.roi.x_offset, m.roi.y_offset, m.roi.height, m.roi.width, m.roi.do_rectify);
  }
};
template <>
struct CdrFields<sensor_msgs::LaserScan> {
  template <class Archive, class M>
  static void Visit(Archive& archive, M& m) {
    archive(m.header, m.angle_min, m.angle_max, m.angle_increment, m.time_increment, m.scan_time, m.range_min,
            m.range_max, m.ranges, m.intensities);
  }
};

}  // namespace planar_vslam::io
