#include "bag_index.h"

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>

#include <algorithm>

#include "bag_messages.h"
#include "stamp_text.h"

namespace planar_vslam::io {
namespace {

struct Stream {
  const char* name;
  const std::string& topic;
  StreamIndex* index;
  std::optional<Timestamp> newest{};
  double furthest_back = 0.0;  // s that a stamp was before one recorded earlier
};

void Follow(Timestamp stamp, Stream* stream) {
  if (stream->newest.has_value()) {
    stream->furthest_back = std::max(stream->furthest_back, SecondsBetween(stamp, *stream->newest));
  }
  stream->newest = stream->newest.has_value() ? std::max(*stream->newest, stamp) : stamp;
}

// Bags of robots hold topics that are damaged in single messages.
Expected<Timestamp> StampOf(const StoredMessage& message, OdometrySurvey* odometry) {
  try {
    if (odometry == nullptr) return ToTimestamp(message.ReadHeader().stamp);
    const auto content = message.Read<nav_msgs::Odometry>();
    odometry->Add(*content);
    return ToTimestamp(content->header.stamp);
  } catch (const DamagedMessage& damaged) {
    return Error{damaged.what()};
  }
}

}  // namespace

void StreamIndex::Add(Timestamp stamp, const StoredMessage& message) {
  entries_.push_back({stamp, messages_.size()});
  messages_.push_back(message);
}

long StreamIndex::Sort() {
  std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.stamp < b.stamp; });
  const auto end =
      std::unique(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.stamp == b.stamp; });
  const long repeated = entries_.end() - end;
  entries_.erase(end, entries_.end());
  return repeated;
}

BagIndex ReadIndex(const Bags& bags, const BagTopics& topics, SkipLog* skipped) {
  BagIndex index;
  Stream streams[] = {{"image", topics.image, &index.images},
                      {"odometry", topics.odometry, &index.odometry},
                      {"scan", topics.scan, &index.scans}};
  std::vector<std::string> names;
  for (const Stream& stream : streams) {
    if (!stream.topic.empty()) names.push_back(stream.topic);
  }
  ForEachMessage(bags, names, [&](const StoredMessage& message) {
    const std::string& topic = message.topic();
    Stream& stream = *std::find_if(std::begin(streams), std::end(streams),
                                   [&topic](const Stream& candidate) { return candidate.topic == topic; });
    const bool is_odometry = stream.index == &index.odometry;
    const Expected<Timestamp> stamp = StampOf(message, is_odometry ? &index.odometry_survey : nullptr);
    const auto recorded = [&] { return fmt::format("{} recorded at {}", topic, FormatStamp(message.recorded())); };
    if (!stamp) {
      skipped->Count(stamp.error().message, recorded());
    } else if (stamp->nanoseconds == 0) {
      skipped->Count(fmt::format("{} stamp zero", stream.name), recorded());
    } else {
      stream.index->Add(*stamp, message);
      Follow(*stamp, &stream);
    }
    return true;
  });
  constexpr double kSet = 1.0;  // s; messages overtake each other by less
  for (const Stream& stream : streams) {
    if (stream.furthest_back < kSet) continue;
    index.notes.push_back(
        fmt::format("{}: stamps go back by {:.1f} s: the clock was set while recording, or the bag was "
                    "put together out of order",
                    stream.topic, stream.furthest_back));
  }
  bool all_repeat = true;
  for (const Stream& stream : streams) {
    const long repeated = stream.index->Sort();
    for (long left = repeated; left > 0; --left) {
      skipped->Count(fmt::format("{} with the stamp of another", stream.name), stream.topic);
    }
    constexpr double kMany = 0.05;
    const auto left = static_cast<double>(stream.index->size());
    all_repeat = all_repeat && (left == 0.0 || static_cast<double>(repeated) > kMany * left);
  }
  if (all_repeat && index.images.size() > 0) {
    index.notes.emplace_back(
        "stamps come twice in every stream: the clock was set back while recording, or a drive is in it twice; record "
        "again, or cut it (rosbag filter)");
  }
  return index;
}

}  // namespace planar_vslam::io
