#include "planar_vslam/map/map_file.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "atomic_file.h"
#include "byte_stream.h"
#include "map_sections.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;
using map_file::ByteReader;
using map_file::ByteWriter;
using map_file::kTags;
using map_file::Sections;

constexpr std::string_view kMagic = "PVMAP\r\n\x1A";  // line ends and end-of-file mark: text-mode copying breaks them
constexpr std::uint32_t kVersion = 3;
constexpr std::size_t kFileHeaderBytes = 8 + 4;
constexpr std::size_t kSectionHeaderBytes = 4 + 8 + 8 + 4;
constexpr std::size_t kTagBytes = 4;
constexpr std::size_t kCrcOffset = 4 + 8 + 8;
constexpr int kCompressionLevel = 3;  // zstd's default; descriptors are noise, higher levels gain 1 %

// More than any real map shrinks (descriptors are noise). Bounds what reading a section allocates.
constexpr std::uint64_t LargestPlainSize(std::uint64_t stored_bytes) { return (1U << 20U) + 64 * stored_bytes; }

std::uint32_t Crc32(std::string_view header, std::string_view stored) {
  const auto add = [](uLong crc, std::string_view bytes) {
    return ::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  };
  return static_cast<std::uint32_t>(add(add(::crc32_z(0, nullptr, 0), header), stored));
}

// A zstd frame, or the bytes themselves where that is not shorter or would look like a broken length.
std::string Compress(const std::string& plain) {
  std::string frame(ZSTD_compressBound(plain.size()), '\0');
  const std::size_t size = ZSTD_compress(frame.data(), frame.size(), plain.data(), plain.size(), kCompressionLevel);
  PV_CHECK(ZSTD_isError(size) == 0, ZSTD_getErrorName(size));
  frame.resize(size);
  return size < plain.size() && plain.size() <= LargestPlainSize(size) ? frame : plain;
}

std::optional<std::string> Decompress(std::string_view stored, std::uint64_t plain_bytes) {
  if (stored.size() == plain_bytes) return std::string(stored);
  if (ZSTD_getFrameContentSize(stored.data(), stored.size()) != plain_bytes) return std::nullopt;
  std::string plain(plain_bytes, '\0');
  const std::size_t size = ZSTD_decompress(plain.data(), plain.size(), stored.data(), stored.size());
  if (ZSTD_isError(size) != 0 || size != plain_bytes) return std::nullopt;
  return plain;
}

std::string PackedSection(const char* tag, const std::string& plain) {
  const std::string stored = Compress(plain);
  ByteWriter lengths;
  lengths.Number(static_cast<std::uint64_t>(stored.size()));
  lengths.Number(static_cast<std::uint64_t>(plain.size()));
  const std::string header = tag + lengths.bytes();
  ByteWriter crc;
  crc.Number(Crc32(header, stored));
  return header + crc.bytes() + stored;
}

// Takes the section `tag` off the front of `rest`.
Expected<std::string> UnpackSection(const char* tag, std::string_view* rest) {
  const std::string name = std::string("section ") + tag;
  if (rest->size() < kSectionHeaderBytes) return Error{"file ends too early, expected " + name};
  const std::string header(rest->substr(0, kSectionHeaderBytes));
  if (header.compare(0, kTagBytes, tag) != 0) return Error{"expected " + name + ", found another"};
  const std::string numbers = header.substr(kTagBytes);
  ByteReader reader(numbers);
  std::uint64_t stored_bytes = 0, plain_bytes = 0;
  std::uint32_t crc = 0;
  reader.Number(stored_bytes);
  reader.Number(plain_bytes);
  reader.Number(crc);
  rest->remove_prefix(kSectionHeaderBytes);
  if (stored_bytes > rest->size()) {
    return Error{name + ": file ends too early, expected " + std::to_string(stored_bytes) + " bytes, found " +
                 std::to_string(rest->size())};
  }
  const std::string_view stored = rest->substr(0, stored_bytes);
  rest->remove_prefix(stored_bytes);
  if (Crc32(std::string_view(header).substr(0, kCrcOffset), stored) != crc) {
    return Error{name + ": content is damaged, expected another CRC-32"};
  }
  if (plain_bytes > LargestPlainSize(stored_bytes)) {
    return Error{name + ": length " + std::to_string(plain_bytes) + ", expected at most " +
                 std::to_string(LargestPlainSize(stored_bytes))};
  }
  std::optional<std::string> plain = Decompress(stored, plain_bytes);
  if (!plain) return Error{name + ": expected a zstd frame of " + std::to_string(plain_bytes) + " bytes"};
  return *std::move(plain);
}

// The sections of a file, as many as its version has.
struct Unpacked {
  Sections sections;
  std::uint32_t version = 0;
};

Expected<Unpacked> Unpack(const std::string& file) {
  if (file.compare(0, kMagic.size(), kMagic) != 0) return Error{"not a saved map, expected PVMAP at the start"};
  const std::string after_magic = file.substr(kMagic.size(), kFileHeaderBytes - kMagic.size());
  ByteReader reader(after_magic);
  std::uint32_t version = 0;
  reader.Number(version);
  if (!reader.ok()) return Error{"file ends too early, expected a version"};
  if (version > kVersion) {
    return Error{"version " + std::to_string(version) + " is of a newer planar_vslam, expected at most version " +
                 std::to_string(kVersion)};
  }
  if (version == 0) return Error{"version 0, expected 1 to " + std::to_string(kVersion)};
  Unpacked unpacked;
  unpacked.version = version;
  const std::size_t count = version == map_file::kVersionWithoutLaser ? kTags.size() - 1 : kTags.size();
  std::string_view rest = std::string_view(file).substr(kFileHeaderBytes);
  for (std::size_t i = 0; i < count; ++i) {
    Expected<std::string> section = UnpackSection(kTags[i], &rest);
    if (!section) return section.error();
    unpacked.sections[i] = std::move(section).value();
  }
  if (!rest.empty()) return Error{std::to_string(rest.size()) + " bytes after the last section, expected none"};
  return unpacked;
}

Expected<std::string> ReadBytes(const fs::path& path) {
  std::error_code failed;
  if (!fs::is_regular_file(path, failed)) return Error{"expected a file that exists"};
  const std::uintmax_t size = fs::file_size(path, failed);
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(failed ? 0 : size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (failed || !stream) return Error{"cannot be read"};
  return bytes;
}

// Errors here do not name the file.
Expected<SavedMap> ReadSavedMap(const fs::path& path) {
  const Expected<std::string> file = ReadBytes(path);
  if (!file) return file.error();
  const Expected<Unpacked> unpacked = Unpack(*file);
  if (!unpacked) return unpacked.error();
  return map_file::Decode(unpacked->sections, unpacked->version);
}

std::vector<std::string> ContentProblems(const Map& map, const CameraModel& camera) {
  std::vector<std::string> problems = camera.Problems();
  for (const std::string& problem : Validate(map)) problems.push_back(problem);
  return problems;
}

Error ContentError(const fs::path& path, const std::vector<std::string>& problems) {
  const std::string more = problems.size() > 1 ? " (and " + std::to_string(problems.size() - 1) + " more)" : "";
  return Error{path.string() + ": expected a sound map: " + problems.front() + more};
}

}  // namespace

Expected<bool> SaveMapFile(const Map& map, const CameraModel& camera, const fs::path& path) {
  const std::vector<std::string> problems = ContentProblems(map, camera);
  if (!problems.empty()) return ContentError(path, problems);
  const Sections sections = map_file::Encode(map, camera);
  ByteWriter version;
  version.Number(kVersion);
  std::string file = std::string(kMagic) + version.bytes();
  for (std::size_t i = 0; i < kTags.size(); ++i) file += PackedSection(kTags[i], sections[i]);
  return WriteFileAtomically(path, file);
}

Expected<SavedMap> LoadMapFile(const fs::path& path) {
  Expected<SavedMap> saved = ReadSavedMap(path);
  if (!saved) return Error{path.string() + ": " + saved.error().message};
  const std::vector<std::string> problems = ContentProblems(saved->map, saved->camera);
  if (!problems.empty()) return ContentError(path, problems);
  return saved;
}

std::vector<std::string> MapFileProblems(const fs::path& path) {
  const Expected<SavedMap> saved = ReadSavedMap(path);
  if (!saved) return {saved.error().message};
  return ContentProblems(saved->map, saved->camera);
}

}  // namespace planar_vslam
