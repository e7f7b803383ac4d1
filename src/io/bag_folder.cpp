#include "bag_folder.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <string>

namespace planar_vslam::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMetadata = "metadata.yaml";
constexpr const char* kInformation = "rosbag2_bagfile_information";

// The file itself, or what it was unpacked to where that lies beside it.
fs::path UnpackedFile(const fs::path& file) {
  if (!IsPackedBag(file)) return file;
  std::error_code ignored;
  fs::path unpacked = file.parent_path() / file.stem();
  return fs::exists(unpacked, ignored) ? unpacked : file;
}

// In the order of their names, which recorders number.
std::vector<fs::path> FilesOf(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path& file = entry.path();
    const fs::path kind = (IsPackedBag(file) ? file.stem() : file).extension();
    if ((kind == ".mcap" || kind == ".db3") && UnpackedFile(file) == file) files.push_back(file);
  }
  // x_9 before x_10.
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    const std::string first = a.filename().string(), second = b.filename().string();
    return first.size() != second.size() ? first.size() < second.size() : first < second;
  });
  return files;
}

Expected<std::vector<fs::path>> FilesOfMetadata(const fs::path& folder) {
  const std::string metadata = (folder / kMetadata).string();
  std::vector<fs::path> files;
  try {
    const YAML::Node named = YAML::LoadFile(metadata)[kInformation]["relative_file_paths"];
    if (!named.IsSequence() || named.size() == 0) {
      return Error{fmt::format("{}: {}.relative_file_paths names no file; expected the files of the recording",
                               metadata, kInformation)};
    }
    for (const YAML::Node& name : named) {
      // Early recorders put the folder's name in front.
      const fs::path path = UnpackedFile(folder / fs::path(name.as<std::string>()).filename());
      std::error_code ignored;
      if (!fs::exists(path, ignored)) {
        return Error{fmt::format("{}: names {}, which is not beside it", metadata, path.filename().string())};
      }
      files.push_back(path);
    }
  } catch (const YAML::Exception& exception) {
    return Error{fmt::format("{}: {}; expected what ROS 2's recorder writes", metadata, exception.what())};
  }
  return files;
}

}  // namespace

bool IsPackedBag(const fs::path& path) { return path.extension() == ".zstd"; }

bool IsBagFolder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored) && !FilesOf(path).empty();
}

Expected<std::vector<fs::path>> BagsOfPath(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return std::vector<fs::path>{path};
  if (fs::exists(path / kMetadata, ignored)) return FilesOfMetadata(path);
  return FilesOf(path);
}

}  // namespace planar_vslam::io
