#include "map_files.h"

#include <fmt/format.h>

#include "planar_vslam/pipeline/navigation_map.h"

namespace planar_vslam::ros_face {

namespace fs = std::filesystem;

Expected<fs::path> ResolveMapName(const fs::path& directory, const std::string& name, const std::string& extension) {
  fs::path relative(name);
  if (relative.extension() == extension) relative.replace_extension();
  if (name.empty() || relative.filename().empty()) return Error{"name: is empty; expected a file name"};
  if (name.find('\0') != std::string::npos) return Error{"name: has a zero byte; expected a file name"};
  if (relative.is_absolute())
    return Error{fmt::format("name: '{}' is absolute; expected one below ~map_directory", name)};
  std::error_code failure;
  const fs::path root = fs::weakly_canonical(directory, failure);
  if (failure) return Error{fmt::format("map_directory: {}: {}", directory.string(), failure.message())};
  // With the extension: the file itself may be a link that leads elsewhere.
  const fs::path file = fs::weakly_canonical(root / (relative.string() + extension), failure);
  if (failure) return Error{fmt::format("name: '{}': {}", name, failure.message())};
  const fs::path inside = file.lexically_relative(root);
  if (inside.empty() || inside == "." || *inside.begin() == ".." || relative.filename() == "." ||
      relative.filename() == "..") {
    return Error{fmt::format("name: '{}' leaves ~map_directory ({})", name, root.string())};
  }
  return file;
}

OccupancyGrid2d BuildGrid(const EstimatorSnapshot& snapshot, const PipelineOptions& options) {
  return BuildNavigationMap(*snapshot.map, snapshot.camera, options.mapping2d,
                            LandmarkAcceptance::For(options.pixel_sigma))
      .Grid();
}

Expected<fs::path> SaveMapFiles(const EstimatorSnapshot& snapshot, const NodeSettings& settings,
                                const std::string& name) {
  std::string stem = name;
  constexpr const char* kGrid = ".yaml";
  if (fs::path(name).extension() == kGrid) stem = fs::path(name).replace_extension().string();
  // Each of them might be a link of its own.
  for (const char* extension : {".pgm", ".pvm"}) {
    const Expected<fs::path> file = ResolveMapName(settings.map_directory, stem, extension);
    if (!file.ok()) return file;
  }
  const Expected<fs::path> file = ResolveMapName(settings.map_directory, stem, kGrid);
  if (!file.ok()) return file;
  if (!snapshot.map->metric) return Error{"the map's scale is not known yet; a grid needs metres"};
  std::error_code failure;
  fs::create_directories(file->parent_path(), failure);
  if (failure) return Error{fmt::format("{}: {}", file->parent_path().string(), failure.message())};
  const Expected<bool> written = WriteMapServerFiles(BuildGrid(snapshot, settings.pipeline), *file);
  if (!written.ok()) return written.error();
  const Expected<bool> saved = SaveMapFile(*snapshot.map, snapshot.camera, fs::path(*file).replace_extension(".pvm"));
  if (!saved.ok()) return saved.error();
  return *file;
}

}  // namespace planar_vslam::ros_face
