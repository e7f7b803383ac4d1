#pragma once
// What the three folder layouts have in common once their lists are read: stamped image files, a camera, perhaps wheels
// and a laser.
#include <filesystem>
#include <optional>
#include <vector>

#include "calibration_file.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/recording.h"
#include "planar_vslam/sensor/buffers.h"
#include "skip_log.h"

namespace planar_vslam::io {

struct ImageFile {
  Timestamp stamp;
  std::filesystem::path path;
};

struct FolderContents {
  Calibration calibration;  // calibration.camera: 0 x 0 px where only the images tell their size (KITTI)
  std::filesystem::path calibration_file;
  std::vector<ImageFile> images;               // increasing stamps
  std::vector<OdometryReading> odometry;       // increasing stamps
  std::optional<std::filesystem::path> scans;  // scan.csv
  std::optional<TransformBuffer> head;         // T_base_camera over time; otherwise the calibration's holds

  bool has_base_transform() const { return head.has_value() || calibration.T_base_camera.has_value(); }
};

bool IsFolderLayout(const std::filesystem::path& folder);

// Entries with a stamp that is not later than the one before, or not a number, are counted in `skipped`.
Expected<FolderContents> ReadFolder(const std::filesystem::path& folder, const RecordingOptions& options,
                                    SkipLog* skipped);

}  // namespace planar_vslam::io
