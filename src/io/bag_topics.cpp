#include "bag_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

namespace planar_vslam::io {
namespace {

constexpr const char* kRawImage = "sensor_msgs/Image";
constexpr const char* kCompressedImage = "sensor_msgs/CompressedImage";
constexpr std::string_view kCompressedSuffix = "/compressed";
constexpr std::string_view kDepthSuffix = "/compressedDepth";  // of image_transport: no picture

using TypeByTopic = std::map<std::string, std::string>;

bool EndsWith(const std::string& text, std::string_view end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string WithoutCompressed(const std::string& topic) {
  return EndsWith(topic, kCompressedSuffix) ? topic.substr(0, topic.size() - kCompressedSuffix.size()) : topic;
}

// Below the camera's own name, which may have the word in it.
bool IsOfDepth(const std::string& topic) {
  const std::size_t below = topic.find('/', 1);
  return topic.rfind("/depth/", 0) == 0 ||
         topic.find("depth", below == std::string::npos ? 0 : below) != std::string::npos;
}

std::string LastName(const std::string& topic) { return topic.substr(topic.rfind('/') + 1); }

// One role a topic can have; `option` is how the user would name it.
struct Role {
  const char* option;
  std::vector<std::string> types;
};

class Chooser {
 public:
  Chooser(TypeByTopic topics, const std::string& file) : topics_(std::move(topics)), file_(file) {}

  std::vector<std::string> OfRole(const Role& role) const {
    std::vector<std::string> names;
    for (const auto& [topic, type] : topics_) {
      const bool of_type = std::find(role.types.begin(), role.types.end(), type) != role.types.end();
      if (of_type && !EndsWith(topic, kDepthSuffix)) names.push_back(topic);
    }
    return names;
  }

  // The topic the user named, or the only one; empty when there is none and none was named.
  Expected<std::string> Choose(const Role& role, const std::string& wanted) const {
    std::vector<std::string> names = OfRole(role);
    if (!wanted.empty()) {
      // image_transport users name the base topic; the bag may hold only its compressed form.
      const std::string compressed = wanted + std::string(kCompressedSuffix);
      for (const std::string& candidate : {wanted, "/" + wanted, compressed, "/" + compressed}) {
        if (std::find(names.begin(), names.end(), candidate) != names.end()) return candidate;
      }
      return Error{fmt::format("{}: {} {} is not a {} topic of this bag; there is {}", file_, role.option, wanted,
                               fmt::join(role.types, " or "),
                               names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")))};
    }
    // Of an image that was recorded in both forms the raw one is as it was taken.
    const auto is_there_raw = [all = names](const std::string& topic) {
      const std::string raw = WithoutCompressed(topic);
      return raw != topic && std::find(all.begin(), all.end(), raw) != all.end();
    };
    names.erase(std::remove_if(names.begin(), names.end(), is_there_raw), names.end());
    // Depth is an image, too, but none to see by.
    if (role.option == std::string("topics.image") &&
        std::any_of(names.begin(), names.end(), [](const std::string& topic) { return !IsOfDepth(topic); })) {
      names.erase(std::remove_if(names.begin(), names.end(), IsOfDepth), names.end());
    }
    if (names.size() > 1) {
      return Error{fmt::format("{}: several {} topics ({}); expected --set {}=TOPIC to say which", file_,
                               role.types.front(), fmt::join(names, ", "), role.option)};
    }
    return names.empty() ? std::string() : names.front();
  }

  std::vector<std::string> WithTypes(const Role& role) const {
    std::vector<std::string> names = OfRole(role);
    for (std::string& name : names) name += " (" + topics_.at(name) + ")";
    return names;
  }

  bool Is(const std::string& topic, const std::string& type) const {
    const auto found = topics_.find(topic);
    return found != topics_.end() && found->second == type;
  }

  std::vector<std::string> TfTopics() const {
    std::vector<std::string> names;
    for (const std::string& topic : OfRole({"tf", {"tf2_msgs/TFMessage", "tf/tfMessage"}})) {
      if (LastName(topic) == "tf" || LastName(topic) == "tf_static") names.push_back(topic);
    }
    return names;
  }

 private:
  TypeByTopic topics_;
  std::string file_;
};

// The camera_info beside the image, as image_transport expects it, before any other.
Expected<std::string> ChooseCameraInfo(const Chooser& chooser, const std::string& file, const std::string& image,
                                       const std::string& wanted) {
  const std::string raw_image = WithoutCompressed(image);
  const std::string sibling = raw_image.substr(0, raw_image.rfind('/') + 1) + "camera_info";
  if (wanted.empty() && chooser.Is(sibling, "sensor_msgs/CameraInfo")) return sibling;
  Expected<std::string> topic = chooser.Choose({"topics.camera_info", {"sensor_msgs/CameraInfo"}}, wanted);
  if (topic && topic->empty()) {
    return Error{
        fmt::format("{}: no sensor_msgs/CameraInfo topic; expected {} with the camera's intrinsics", file, sibling)};
  }
  return topic;
}

}  // namespace

Expected<BagTopics> ChooseTopics(const Bags& bags, const std::string& file, const BagOptions& options) {
  const Chooser chooser(TypesOfTopics(bags), file);
  const Expected<std::string> image =
      chooser.Choose({"topics.image", {kRawImage, kCompressedImage}}, options.image_topic);
  if (!image) return image.error();
  if (image->empty())
    return Error{fmt::format("{}: no images; expected a {} or {} topic", file, kRawImage, kCompressedImage)};
  const Expected<std::string> info = ChooseCameraInfo(chooser, file, *image, options.camera_info_topic);
  if (!info) return info.error();
  BagTopics topics;
  topics.image = *image;
  topics.image_compressed = chooser.Is(*image, kCompressedImage);
  topics.camera_info = *info;
  topics.tf = chooser.TfTopics();
  if (options.base_frame.empty()) return topics;
  const Expected<std::string> odometry =
      chooser.Choose({"topics.odometry", {"nav_msgs/Odometry"}}, options.odometry_topic);
  if (!odometry) return odometry.error();
  const Expected<std::string> scan = chooser.Choose({"topics.scan", {"sensor_msgs/LaserScan"}}, options.scan_topic);
  if (!scan) return scan.error();
  topics.odometry = *odometry;
  topics.scan = *scan;
  topics.like_odometry = chooser.WithTypes(
      {"",
       {"geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/PoseStamped", "geometry_msgs/TwistStamped",
        "geometry_msgs/TwistWithCovarianceStamped", "geometry_msgs/Twist", "geometry_msgs/TransformStamped"}});
  return topics;
}

bool IsStaticTf(const std::string& topic) { return LastName(topic) == "tf_static"; }

bool IsRectifiedImage(const std::string& topic, RectifiedImages said) {
  if (said != RectifiedImages::kAuto) return said == RectifiedImages::kYes;
  const std::string name = "_" + LastName(WithoutCompressed(topic)) + "_";
  return name.find("_rect_") != std::string::npos || name.find("_rectified_") != std::string::npos;
}

}  // namespace planar_vslam::io
