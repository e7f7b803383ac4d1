#include "map_file_bytes.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <cstdint>
#include <fstream>
#include <iterator>

namespace planar_vslam::test {
namespace {

constexpr std::size_t kFileHeader = 12, kSectionHeader = 24;

std::uint64_t NumberAt(const std::string& bytes, std::size_t position, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i > 0; --i) value = value << 8U | static_cast<unsigned char>(bytes.at(position + i - 1));
  return value;
}

std::string Number(std::uint64_t value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<char>(value >> (8 * i) & 0xFFU));
  return bytes;
}

}  // namespace

std::string ReadBytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void WriteBytes(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path);  // some file systems wait for the disk when a file is overwritten
  std::ofstream(path, std::ios::binary) << bytes;
}

std::vector<MapFileSection> SectionsOf(const std::string& file) {
  std::vector<MapFileSection> sections;
  for (std::size_t at = kFileHeader; at < file.size();) {
    MapFileSection section;
    section.tag = file.substr(at, 4);
    section.stored = file.substr(at + kSectionHeader, NumberAt(file, at + 4, 8));
    section.plain.resize(NumberAt(file, at + 12, 8));
    if (section.plain.size() == section.stored.size()) {
      section.plain = section.stored;
    } else {
      const std::size_t size =
          ZSTD_decompress(section.plain.data(), section.plain.size(), section.stored.data(), section.stored.size());
      EXPECT_EQ(size, section.plain.size()) << section.tag;
    }
    at += kSectionHeader + section.stored.size();
    sections.push_back(section);
  }
  return sections;
}

std::string JoinSections(const std::vector<MapFileSection>& sections, unsigned char version) {
  std::string file = "PVMAP\r\n\x1A" + Number(version, 4);
  for (const MapFileSection& section : sections) {
    const std::string header = section.tag + Number(section.stored.size(), 8) + Number(section.plain.size(), 8);
    const std::string covered = header + section.stored;
    file += header + Number(::crc32_z(0, reinterpret_cast<const Bytef*>(covered.data()), covered.size()), 4);
    file += section.stored;
  }
  return file;
}

std::vector<MapFileSection> Uncompressed(std::vector<MapFileSection> sections) {
  for (MapFileSection& section : sections) section.stored = section.plain;
  return sections;
}

}  // namespace planar_vslam::test
