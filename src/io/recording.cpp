#include "planar_vslam/io/recording.h"

#include <fmt/format.h>

#include "bag_recording.h"
#include "folder_layouts.h"
#include "folder_recording.h"

namespace planar_vslam {

namespace fs = std::filesystem;

Expected<std::unique_ptr<Recording>> OpenRecording(const fs::path& path, const RecordingOptions& options) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (!fs::exists(status)) return Error{fmt::format("{}: no such file or folder", path.string())};
  if (!fs::is_directory(status)) return io::OpenBagRecording({path}, options);
  if (io::IsFolderLayout(path)) return io::OpenFolderRecording(path, options);
  if (io::IsBagFolder(path)) return io::OpenBagRecording({path}, options);
  return Error{
      fmt::format("{}: not a recording; expected images.csv, rgb.txt (TUM-RGBD), image_0 and "
                  "times.txt (KITTI), or .mcap or .db3 files (ROS 2) in it",
                  path.string())};
}

Expected<std::unique_ptr<Recording>> OpenRecording(const std::vector<fs::path>& paths,
                                                   const RecordingOptions& options) {
  if (paths.size() == 1) return OpenRecording(paths.front(), options);
  for (const fs::path& path : paths) {
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    if (!fs::exists(status)) return Error{fmt::format("{}: no such file", path.string())};
    if (fs::is_directory(status) && !io::IsBagFolder(path)) {
      return Error{fmt::format("{}: a folder; expected only bags where there are several inputs", path.string())};
    }
  }
  if (paths.empty()) return Error{"no recording given"};
  return io::OpenBagRecording(paths, options);
}

}  // namespace planar_vslam
