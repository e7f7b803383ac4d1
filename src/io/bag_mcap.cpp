#include "bag_mcap.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <map>

#include "bag_bytes.h"
#include "bag_mcap_chunk.h"

namespace planar_vslam::io {
namespace {

constexpr std::uint64_t kNoChunk = 0;  // where the file's magic is

class McapFile : public MessageSource {
 public:
  explicit McapFile(const std::filesystem::path& path) : file_(path), chunks_(file_.bytes()) { Walk(); }
  std::string_view Bytes(const SourceMessage& message, std::size_t limit) override;

 private:
  void Walk();
  // Whether there may be more records.
  bool WalkRecord(std::string_view* rest);
  void WalkChunk(std::uint64_t position);
  // A record of a chunk, or beside them; `position` is that of its type.
  void Add(McapRecord type, std::string_view content, std::uint64_t chunk, std::uint64_t position);
  void AddChannel(std::string_view content);
  void AddMessage(std::string_view content, std::uint64_t chunk, std::uint64_t position);
  std::uint64_t PositionOf(std::string_view rest) const { return file_.bytes().size() - rest.size(); }

  MappedFile file_;
  McapChunks chunks_;
  std::string unpacked_;  // the last message that was packed by itself
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::optional<std::uint32_t>> channels_;  // topic, where it is one that is read
};

struct Record {
  McapRecord type;
  std::string_view content;
};

Record TakeRecord(std::string_view* rest) {
  const auto type = TakeNumber<std::uint8_t>(rest);
  if (type == 0) throw BadBag{"a record has type 0"};
  return {static_cast<McapRecord>(type), TakeBlock<std::uint64_t>(rest)};
}

void McapFile::Walk() {
  std::string_view rest = file_.bytes();
  if (rest.substr(0, kMcapMagic.size()) != kMcapMagic)
    throw BadBag{"does not start with MCAP's magic; expected an .mcap file as ROS 2 records it"};
  rest.remove_prefix(kMcapMagic.size());
  while (WalkRecord(&rest)) {
  }
  std::stable_sort(contents.messages.begin(), contents.messages.end(),
                   [](const SourceMessage& a, const SourceMessage& b) { return a.recorded < b.recorded; });
}

bool McapFile::WalkRecord(std::string_view* rest) {
  const std::uint64_t position = PositionOf(*rest);
  Record record{};
  try {
    record = TakeRecord(rest);
  } catch (const BadBag& bad) {
    contents.notes.push_back(fmt::format("cut off in the record at byte {} of {}, {}: what comes before it is used",
                                         position, file_.bytes().size(), bad.what()));
    return false;
  }
  try {
    if (record.type == McapRecord::kDataEnd) {
      const auto checksum = ReadNumber<std::uint32_t>(record.content);
      if (checksum != 0 && checksum != crc32_z(0, reinterpret_cast<const Bytef*>(file_.bytes().data()), position)) {
        throw BadBag{"the data before it do not have their checksum"};
      }
      return false;
    }
    if (record.type == McapRecord::kChunk) {
      WalkChunk(position + 1);
    } else {
      Add(record.type, record.content, kNoChunk, position);
    }
  } catch (const OtherBag&) {
    throw;
  } catch (const BadBag& bad) {
    throw BadBag{
        fmt::format("damaged in the record at byte {}: {}; expected an intact file (`mcap recover` keeps what is "
                    "left of it)",
                    position, bad.what())};
  }
  return record.type != McapRecord::kFooter;
}

void McapFile::WalkChunk(std::uint64_t position) {
  const std::string_view records = chunks_.At(position);
  std::string_view rest = records;
  while (!rest.empty()) {
    const std::uint64_t inside = records.size() - rest.size();
    const Record record = TakeRecord(&rest);
    Add(record.type, record.content, position, inside);
  }
}

void McapFile::Add(McapRecord type, std::string_view content, std::uint64_t chunk, std::uint64_t position) {
  if (type == McapRecord::kSchema) {
    const auto id = TakeNumber<std::uint16_t>(&content);
    schemas_.emplace(id, TakeBlock(&content));
  } else if (type == McapRecord::kChannel) {
    AddChannel(content);
  } else if (type == McapRecord::kMessage) {
    AddMessage(content, chunk, position);
  }
}

void McapFile::AddChannel(std::string_view content) {
  const auto id = TakeNumber<std::uint16_t>(&content);
  const auto schema = TakeNumber<std::uint16_t>(&content);
  const std::string_view topic = TakeBlock(&content);
  const std::string_view encoding = TakeBlock(&content);
  if (channels_.count(id) != 0) return;  // writers repeat them
  channels_[id] = std::nullopt;
  if (schema == 0) return;  // says that there is none
  const auto type = schemas_.find(schema);
  if (type == schemas_.end()) throw BadBag{fmt::format("the channel of {} has a schema that was not there", topic)};
  if (std::optional<SourceTopic> read = ToSourceTopic(topic, type->second, encoding)) {
    channels_[id] = static_cast<std::uint32_t>(contents.topics.size());
    contents.topics.push_back(std::move(*read));
  }
}

void McapFile::AddMessage(std::string_view content, std::uint64_t chunk, std::uint64_t position) {
  const auto channel = channels_.find(TakeNumber<std::uint16_t>(&content));
  TakeNumber<std::uint32_t>(&content);  // its number in the sequence
  const auto recorded = TakeNumber<std::uint64_t>(&content);
  TakeNumber<std::uint64_t>(&content);  // when it was published
  if (channel == channels_.end()) throw BadBag{"a message of a channel that was not there"};
  if (!channel->second.has_value()) return;
  contents.messages.push_back({*channel->second, static_cast<std::int64_t>(recorded), chunk, position});
}

std::string_view McapFile::Bytes(const SourceMessage& message, std::size_t limit) {
  constexpr std::size_t kBeforeData = 2 + 4 + 8 + 8;  // channel, sequence, times
  std::string_view rest = message.block == kNoChunk ? file_.bytes() : chunks_.At(message.block);
  rest.remove_prefix(message.position);
  return Unpacked(TakeRecord(&rest).content.substr(kBeforeData), &unpacked_).substr(0, limit);
}

}  // namespace

std::unique_ptr<MessageSource> OpenMcap(const std::filesystem::path& path) { return std::make_unique<McapFile>(path); }

}  // namespace planar_vslam::io
