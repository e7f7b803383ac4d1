#pragma once
// SQLite files of ROS 2's recorder (rosbag2_storage_sqlite3): tables topics(id, name, type, serialization_format) and
// messages(topic_id, timestamp, data).
#include <filesystem>
#include <memory>
#include <string_view>

#include "bag_source.h"

namespace planar_vslam::io {

constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16};

// Throws BadBag.
std::unique_ptr<MessageSource> OpenSqliteBag(const std::filesystem::path& path);

}  // namespace planar_vslam::io
