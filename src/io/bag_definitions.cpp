#include <fmt/format.h>

#include <array>
#include <set>

#include "bag_sink.h"
#include "bag_topics.h"

namespace planar_vslam::io {
namespace {

struct Definition {
  const char* type;
  const char* fields;
};

constexpr std::array<Definition, 18> kDefinitions = {{
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"sensor_msgs/Image",
     "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
     "uint8[] data\n"},
    {"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    {"sensor_msgs/RegionOfInterest",
     "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    {"sensor_msgs/CameraInfo",
     "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
     "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"},
    {"sensor_msgs/LaserScan",
     "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\n"
     "float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n"},
}};

std::string FieldsOf(const std::string& type) {
  for (const Definition& definition : kDefinitions) {
    if (type == definition.type) return definition.fields;
  }
  return "";
}

// The types in `fields` and those that they are made of, each once.
void AppendParts(const std::string& fields, std::set<std::string>* done, std::string* text) {
  for (const Definition& part : kDefinitions) {
    const std::string type = part.type;
    const bool named = ("\n" + fields).find("\n" + type + " ") != std::string::npos ||
                       ("\n" + fields).find("\n" + type + "[") != std::string::npos;
    if (!named || !done->insert(type).second) continue;
    constexpr std::size_t kRule = 80;
    *text += std::string(kRule, '=') + "\nMSG: " + type + "\n" + part.fields;
    AppendParts(part.fields, done, text);
  }
}

constexpr const char* kForever = "{sec: 9223372036, nsec: 854775807}";

}  // namespace

std::string OfferedQos(const std::string& topic) {
  if (!IsStaticTf(topic)) return "";
  // The numbers of rmw: keep last, reliable, transient local, automatic.
  return fmt::format(
      "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline: {0}\n  lifespan: {0}\n"
      "  liveliness: 1\n  liveliness_lease_duration: {0}\n  avoid_ros_namespace_conventions: false\n",
      kForever);
}

std::string Ros2Definition(const std::string& type) {
  std::string text = FieldsOf(type);
  std::set<std::string> done;
  AppendParts(FieldsOf(type), &done, &text);
  return text;
}

std::string Ros2Type(const std::string& type) {
  std::string ros2_type = type;
  return ros2_type.insert(type.find('/'), "/msg");
}

}  // namespace planar_vslam::io
