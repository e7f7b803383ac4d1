#include "bag_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bag_bytes.h"

namespace planar_vslam::io {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";

// Kinds of records, as the field "op" says.
constexpr char kMessage = 0x02, kBagHeader = 0x03, kIndex = 0x04, kChunk = 0x05;

struct Record {
  std::map<std::string_view, std::string_view> fields;
  std::string_view data;

  std::string_view Field(std::string_view name) const {
    const auto found = fields.find(name);
    if (found == fields.end()) throw BadBag{fmt::format("a record has no field '{}'", name)};
    return found->second;
  }
  char kind() const { return ReadNumber<char>(Field("op")); }
};

Record TakeRecord(std::string_view* rest) {
  Record record;
  std::string_view header = TakeBlock(rest);
  while (!header.empty()) {
    const std::string_view field = TakeBlock(&header);
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) throw BadBag{"a header field has no '='"};
    record.fields.emplace(field.substr(0, equals), field.substr(equals + 1));
  }
  record.data = TakeBlock(rest);
  return record;
}

// The chunk the index records behind it point into.
struct Chunk {
  bool compressed = false;
  std::size_t size = 0;                       // uncompressed bytes
  std::vector<std::uint32_t> message_starts;  // of an uncompressed chunk, ascending
};

Chunk WalkChunk(const Record& record) {
  Chunk chunk;
  chunk.compressed = record.Field("compression") != "none";
  chunk.size = ReadNumber<std::uint32_t>(record.Field("size"));
  if (chunk.compressed) return chunk;
  if (chunk.size != record.data.size()) throw BadBag{"a chunk's size is not the size of its data"};
  std::string_view rest = record.data;
  while (!rest.empty()) {
    const std::size_t start = record.data.size() - rest.size();
    if (TakeRecord(&rest).kind() == kMessage) chunk.message_starts.push_back(static_cast<std::uint32_t>(start));
  }
  return chunk;
}

void CheckIndex(const Record& record, const Chunk& chunk) {
  constexpr std::size_t kEntryBytes = 12, kOffsetInEntry = 8;  // 8 bytes of time, 4 of offset
  const auto count = ReadNumber<std::uint32_t>(record.Field("count"));
  if (record.data.size() != count * kEntryBytes) throw BadBag{"an index has another length than its count says"};
  for (std::size_t i = 0; i < count; ++i) {
    const auto offset = ReadNumber<std::uint32_t>(record.data.substr(i * kEntryBytes + kOffsetInEntry));
    const bool points_at_message =
        chunk.compressed ? offset < chunk.size
                         : std::binary_search(chunk.message_starts.begin(), chunk.message_starts.end(), offset);
    if (!points_at_message) throw BadBag{"an index points at no message"};
  }
}

void CheckBagHeader(const Record& record, std::size_t file_size) {
  const auto index = ReadNumber<std::uint64_t>(record.Field("index_pos"));
  if (index == 0)
    throw BadBag{"no index, its recording was cut off; expected a closed bag (rosbag reindex repairs it)"};
  if (index > file_size) {
    throw BadBag{
        fmt::format("cut off at byte {}; expected its index at byte {} (`rosbag reindex` keeps what is left of it)",
                    file_size, index)};
  }
  const auto encryptor = record.fields.find("encryptor");
  if (encryptor != record.fields.end() && !encryptor->second.empty()) throw BadBag{"encrypted; expected a plain bag"};
}

void Walk(std::string_view bytes) {
  if (bytes.substr(0, kMagic.size()) != kMagic) {
    throw BadBag{"does not start with '#ROSBAG V2.0'; expected a rosbag v2, an .mcap, a .db3 or a folder"};
  }
  std::string_view rest = bytes.substr(kMagic.size());
  Record record = TakeRecord(&rest);
  if (record.kind() != kBagHeader) throw BadBag{"damaged: its first record is not the bag header"};
  CheckBagHeader(record, bytes.size());
  Chunk chunk;
  while (!rest.empty()) {
    const std::size_t position = bytes.size() - rest.size();
    try {
      record = TakeRecord(&rest);
      if (record.kind() == kChunk) chunk = WalkChunk(record);
      if (record.kind() == kIndex) CheckIndex(record, chunk);
    } catch (const BadBag& bad) {
      throw BadBag{fmt::format(
          "damaged in the record at byte {}: {}; expected an intact rosbag v2 (`rosbag reindex` keeps what is left "
          "of it)",
          position, bad.what())};
    }
  }
}

}  // namespace

std::optional<Error> CheckBag(const std::filesystem::path& path) {
  const MappedFile file(path);
  try {
    Walk(file.bytes());
  } catch (const BadBag& bad) {
    return Error{fmt::format("{}: {}", path.string(), bad.what())};
  }
  return std::nullopt;
}

}  // namespace planar_vslam::io
