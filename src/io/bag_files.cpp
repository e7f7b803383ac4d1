#include "bag_files.h"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <rosbag/view.h>

#include <algorithm>

#include "bag_bytes.h"
#include "bag_check.h"
#include "bag_folder.h"
#include "bag_mcap.h"
#include "bag_sqlite.h"

namespace planar_vslam::io {
namespace {

namespace fs = std::filesystem;

// The function that opens a file of ROS 2; nothing for others. By how it begins, or, where that is damaged, by its
// name.
auto OpenerOf(const fs::path& path, std::string_view bytes) {
  const auto is = [&](std::string_view magic, const char* extension) {
    return bytes.substr(0, magic.size()) == magic || path.extension() == extension;
  };
  std::unique_ptr<MessageSource> (*open)(const fs::path&) = nullptr;
  if (is(kMcapMagic, ".mcap")) {
    open = &OpenMcap;
  } else if (is(kSqliteMagic, ".db3")) {
    open = &OpenSqliteBag;
  }
  return open;
}

std::optional<Error> OpenBag(const fs::path& path, Bags* bags) {
  if (IsPackedBag(path)) {
    return Error{fmt::format("{}: compressed as a whole; expected it unpacked, as `zstd -d` does", path.string())};
  }
  const MappedFile file(path);
  if (!file.problem().empty()) {
    return Error{
        fmt::format("{}: cannot be read: {}; expected a file that may be read", path.string(), file.problem())};
  }
  if (const auto open = OpenerOf(path, file.bytes())) {
    try {
      bags->sources.push_back(open(path));
    } catch (const BadBag& bad) {
      return Error{fmt::format("{}: {}", path.string(), bad.what())};
    }
    for (const std::string& note : bags->sources.back()->notes()) {
      bags->notes.push_back(fmt::format("{}: {}", path.string(), note));
    }
    return std::nullopt;
  }
  if (const auto damage = CheckBag(path)) return *damage;
  bags->rosbags.push_back(std::make_unique<rosbag::Bag>());
  bags->rosbags.back()->open(path.string(), rosbag::bagmode::Read);
  return std::nullopt;
}

// Where one source has got to.
struct Cursor {
  MessageSource* source;
  std::size_t next = 0;
  const SourceMessage& message() const { return source->messages()[next]; }
};

void ForEachOfSources(const std::vector<std::unique_ptr<MessageSource>>& sources,
                      const std::vector<std::string>& topics, const std::function<bool(const StoredMessage&)>& visit) {
  const auto wanted = [&topics](const Cursor& cursor) {
    const std::string& topic = cursor.source->topics()[cursor.message().topic].name;
    return std::find(topics.begin(), topics.end(), topic) != topics.end();
  };
  std::vector<Cursor> cursors;
  for (const auto& source : sources) cursors.push_back({source.get()});
  for (;;) {
    Cursor* earliest = nullptr;
    for (Cursor& cursor : cursors) {
      while (cursor.next < cursor.source->messages().size() && !wanted(cursor)) ++cursor.next;
      if (cursor.next == cursor.source->messages().size()) continue;
      if (earliest == nullptr || cursor.message().recorded < earliest->message().recorded) earliest = &cursor;
    }
    if (earliest == nullptr) return;
    if (!visit(StoredMessage(earliest->source, earliest->message()))) return;
    ++earliest->next;
  }
}

}  // namespace

Expected<Bags> OpenBags(const std::vector<fs::path>& paths) {
  // Its own words on stderr would come beside our one line.
  console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE);
  Bags bags;
  for (const fs::path& path : paths) {
    const Expected<std::vector<fs::path>> files = BagsOfPath(path);
    if (!files) return files.error();
    for (const fs::path& file : *files) {
      if (const auto error = OpenBag(file, &bags)) return *error;
    }
  }
  if (!bags.rosbags.empty() && !bags.sources.empty()) {
    return Error{fmt::format("{}: rosbags (v2) and ROS 2 recordings; expected all of one kind", NameOf(paths))};
  }
  return bags;
}

std::string NameOf(const std::vector<fs::path>& paths) {
  if (paths.size() == 1) return paths.front().string();
  return fmt::format("{} and {} more", paths.front().string(), paths.size() - 1);
}

std::map<std::string, std::string> TypesOfTopics(const Bags& bags) {
  std::map<std::string, std::string> types;
  rosbag::View everything;
  for (const auto& bag : bags.rosbags) everything.addQuery(*bag);
  for (const rosbag::ConnectionInfo* connection : everything.getConnections()) {
    types[connection->topic] = connection->datatype;
  }
  for (const auto& source : bags.sources) {
    for (const SourceTopic& topic : source->topics()) types[topic.name] = topic.type;
  }
  return types;
}

void ForEachMessage(const Bags& bags, const std::vector<std::string>& topics,
                    const std::function<bool(const StoredMessage&)>& visit) {
  rosbag::View view;
  for (const auto& bag : bags.rosbags) view.addQuery(*bag, rosbag::TopicQuery(topics));
  for (const rosbag::MessageInstance& message : view) {
    if (!visit(StoredMessage(message))) return;
  }
  ForEachOfSources(bags.sources, topics, visit);
}

}  // namespace planar_vslam::io
