#include "bag_source.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>

#include "bag_bytes.h"
#include "bag_message.h"

namespace planar_vslam::io {

std::optional<SourceTopic> ToSourceTopic(std::string_view name, std::string_view type, std::string_view encoding) {
  constexpr std::array<std::string_view, 6> kTypes = {"sensor_msgs/Image",      "sensor_msgs/CompressedImage",
                                                      "sensor_msgs/CameraInfo", "sensor_msgs/LaserScan",
                                                      "nav_msgs/Odometry",      "tf2_msgs/TFMessage"};
  constexpr std::string_view kRos2Folder = "/msg/";
  std::string ros1_type(type);
  if (const std::size_t folder = ros1_type.find(kRos2Folder); folder != std::string::npos) {
    ros1_type.replace(folder, kRos2Folder.size(), "/");
  }
  if (ros1_type == "tf/tfMessage") ros1_type = "tf2_msgs/TFMessage";  // what the first tf called the same
  if (std::find(kTypes.begin(), kTypes.end(), ros1_type) == kTypes.end()) return std::nullopt;
  if (encoding != "cdr" && encoding != "ros1") {
    throw OtherBag{fmt::format("messages on {} are encoded as '{}'; expected cdr or ros1", name, encoding)};
  }
  return SourceTopic{std::string(name), ros1_type, encoding == "cdr" ? MessageEncoding::kCdr : MessageEncoding::kRos1};
}

std::string UnpackZstd(std::string_view packed) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN) {
    throw BadBag{"a zstd block does not say how long it is"};
  }
  return UnpackZstd(packed, size);
}

std::string UnpackZstd(std::string_view packed, std::uint64_t size) {
  if (size > kLargestBlock) throw BadBag{fmt::format("a zstd block claims {} bytes", size)};
  std::string bytes(size, '\0');
  const std::size_t unpacked = ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
  if (ZSTD_isError(unpacked) != 0) {
    throw BadBag{fmt::format("a zstd block cannot be unpacked: {}", ZSTD_getErrorName(unpacked))};
  }
  if (unpacked != bytes.size()) throw BadBag{"a zstd block has another length than it says"};
  return bytes;
}

bool IsZstd(std::string_view bytes) {
  return bytes.size() >= sizeof(std::uint32_t) && ReadNumber<std::uint32_t>(bytes) == ZSTD_MAGICNUMBER;
}

std::string_view Unpacked(std::string_view bytes, std::string* memory) {
  if (!IsZstd(bytes)) return bytes;
  try {
    *memory = UnpackZstd(bytes);
  } catch (const BadBag&) {
    throw DamagedMessage();
  }
  return *memory;
}

}  // namespace planar_vslam::io
