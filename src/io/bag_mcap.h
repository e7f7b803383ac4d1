#pragma once
// MCAP files (mcap.dev/spec), as ROS 2 records by default. The file is walked once from front to back; its indexes and
// its summary are not needed, so that files that were never closed are read like others.
#include <filesystem>
#include <memory>
#include <string_view>

#include "bag_source.h"

namespace planar_vslam::io {

constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n";

// Record types.
enum class McapRecord : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F
};

// Throws BadBag.
std::unique_ptr<MessageSource> OpenMcap(const std::filesystem::path& path);

}  // namespace planar_vslam::io
