#pragma once
// The saved map's frame as map_file.h documents it, taken apart and put together again: what the tests damage.
#include <filesystem>
#include <string>
#include <vector>

namespace planar_vslam::test {

std::string ReadBytes(const std::filesystem::path& path);
void WriteBytes(const std::filesystem::path& path, const std::string& bytes);

constexpr unsigned char kVersion = 3;  // that is written

struct MapFileSection {
  std::string tag;
  std::string stored;
  std::string plain;
};
std::vector<MapFileSection> SectionsOf(const std::string& file);
// A whole file of version `version` with right CRCs.
std::string JoinSections(const std::vector<MapFileSection>& sections, unsigned char version = kVersion);
// The same with nothing compressed, so that a changed byte is a changed field.
std::vector<MapFileSection> Uncompressed(std::vector<MapFileSection> sections);

}  // namespace planar_vslam::test
