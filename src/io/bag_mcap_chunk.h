#pragma once
// The chunks of an MCAP file: their records, decompressed.
#include <cstdint>
#include <list>
#include <string>
#include <string_view>

namespace planar_vslam::io {

// The records of a chunk, whose content this is. Throws BadBag, also where they do not have the checksum that the chunk
// gives.
std::string UnpackMcapChunk(std::string_view content);

// Decompresses chunks and keeps those used last. Streams read the same stretch of a file one after the other.
class McapChunks {
 public:
  explicit McapChunks(std::string_view file) : file_(file) {}
  // The records of the chunk whose length stands there in the file; they stay until the next call.
  std::string_view At(std::uint64_t position);

 private:
  struct Unpacked {
    std::uint64_t position;
    std::string records;
  };
  std::string_view file_;
  std::list<Unpacked> recent_;  // the last one used first
};

}  // namespace planar_vslam::io
