#include "bag_mcap_chunk.h"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zlib.h>

#include <algorithm>
#include <memory>

#include "bag_bytes.h"
#include "bag_source.h"

namespace planar_vslam::io {
namespace {

std::string UnpackLz4(std::string_view packed, std::uint64_t size) {
  constexpr std::uint64_t kMostPerByte = 255;  // of the format: a run grows by at most that much for each byte
  if (size / kMostPerByte > packed.size()) {
    throw BadBag{fmt::format("a chunk claims {} bytes out of {} packed by lz4", size, packed.size())};
  }
  LZ4F_dctx* created = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&created, LZ4F_VERSION)) != 0) throw BadBag{"lz4 has no memory"};
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(created,
                                                                                     &LZ4F_freeDecompressionContext);
  std::string bytes(size, '\0');
  std::size_t written = 0, read = 0;
  while (read < packed.size()) {
    std::size_t room = bytes.size() - written, left = packed.size() - read;
    const std::size_t result =
        LZ4F_decompress(context.get(), bytes.data() + written, &room, packed.data() + read, &left, nullptr);
    if (LZ4F_isError(result) != 0) {
      throw BadBag{fmt::format("a chunk cannot be unpacked: {}", LZ4F_getErrorName(result))};
    }
    if (room == 0 && left == 0) break;
    written += room;
    read += left;
  }
  if (written != size || read != packed.size()) throw BadBag{"a chunk unpacks to another length than it says"};
  return bytes;
}

std::string Unpack(std::string_view packed, std::string_view compression, std::uint64_t size) {
  if (size > kLargestBlock) throw BadBag{fmt::format("a chunk claims {} bytes", size)};
  std::string bytes;
  if (compression.empty()) {
    bytes = packed;
  } else if (compression == "zstd") {
    if (size > 0 || !packed.empty()) bytes = UnpackZstd(packed, size);
  } else if (compression == "lz4") {
    bytes = UnpackLz4(packed, size);
  } else {
    throw BadBag{fmt::format("a chunk is compressed by '{}', not by zstd, lz4 or nothing", compression)};
  }
  if (bytes.size() != size) throw BadBag{"a chunk unpacks to another length than it says"};
  return bytes;
}

}  // namespace

std::string UnpackMcapChunk(std::string_view content) {
  TakeNumber<std::uint64_t>(&content);  // times of its first and last message
  TakeNumber<std::uint64_t>(&content);
  const auto size = TakeNumber<std::uint64_t>(&content);
  const auto checksum = TakeNumber<std::uint32_t>(&content);
  const std::string_view compression = TakeBlock(&content);
  const std::string_view packed = TakeBlock<std::uint64_t>(&content);
  std::string records = Unpack(packed, compression, size);
  if (checksum != 0 && checksum != crc32_z(0, reinterpret_cast<const Bytef*>(records.data()), records.size())) {
    throw BadBag{"a chunk does not have its checksum"};
  }
  return records;
}

std::string_view McapChunks::At(std::uint64_t position) {
  const auto known = std::find_if(recent_.begin(), recent_.end(),
                                  [position](const Unpacked& chunk) { return chunk.position == position; });
  if (known != recent_.end()) {
    recent_.splice(recent_.begin(), recent_, known);
    return recent_.front().records;
  }
  std::string_view rest = file_.substr(position);
  recent_.push_front({position, UnpackMcapChunk(TakeBlock<std::uint64_t>(&rest))});
  constexpr std::size_t kKept = std::size_t{32} << 20U;  // bytes; a chunk of ROS 2's recorder has less than one MiB
  std::size_t bytes = 0;
  for (auto chunk = recent_.begin(); chunk != recent_.end();) {
    bytes += chunk->records.size();
    chunk = bytes > kKept && chunk != recent_.begin() ? recent_.erase(chunk, recent_.end()) : std::next(chunk);
  }
  return recent_.front().records;
}

}  // namespace planar_vslam::io
