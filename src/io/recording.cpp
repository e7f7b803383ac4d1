#include "planar_vslam/io/recording.h"

#include <fmt/format.h>

#include <algorithm>

#include "bag_recording.h"
#include "folder_layouts.h"
#include "folder_recording.h"

namespace planar_vslam {

namespace fs = std::filesystem;

namespace {

Error NotThere(const fs::path& path, const std::error_code& why) {
  if (why && why != std::errc::no_such_file_or_directory && why != std::errc::not_a_directory) {
    return Error{fmt::format("{}: cannot be read: {}", path.string(), why.message())};
  }
  return Error{fmt::format("{}: no such file or folder", path.string())};
}

bool HoldsRosbags(const fs::path& folder) {
  std::error_code ignored;
  const fs::directory_iterator entries(folder, ignored);
  return std::any_of(begin(entries), end(entries),
                     [](const auto& entry) { return entry.path().extension() == ".bag"; });
}

}  // namespace

Expected<std::unique_ptr<Recording>> OpenRecording(const fs::path& path, const RecordingOptions& options) {
  std::error_code why;
  const fs::file_status status = fs::status(path, why);
  if (!fs::exists(status)) return NotThere(path, why);
  if (!fs::is_directory(status)) return io::OpenBagRecording({path}, options);
  if (io::IsFolderLayout(path)) return io::OpenFolderRecording(path, options);
  if (io::IsBagFolder(path)) return io::OpenBagRecording({path}, options);
  if (HoldsRosbags(path)) {
    return Error{fmt::format("{0}: a folder of rosbags; expected those of one drive by name, as in {0}/*.bag",
                             (path / "").parent_path().string())};
  }
  return Error{
      fmt::format("{}: not a recording; expected images.csv, rgb.txt (TUM-RGBD), image_0 and "
                  "times.txt (KITTI), or .mcap or .db3 files (ROS 2) in it",
                  path.string())};
}

Expected<std::unique_ptr<Recording>> OpenRecording(const std::vector<fs::path>& paths,
                                                   const RecordingOptions& options) {
  if (paths.size() == 1) return OpenRecording(paths.front(), options);
  for (const fs::path& path : paths) {
    std::error_code why;
    const fs::file_status status = fs::status(path, why);
    if (!fs::exists(status)) return NotThere(path, why);
    if (fs::is_directory(status) && !io::IsBagFolder(path)) {
      return Error{fmt::format("{}: a folder; expected only bags where there are several inputs", path.string())};
    }
  }
  if (paths.empty()) return Error{"no recording given"};
  return io::OpenBagRecording(paths, options);
}

}  // namespace planar_vslam
