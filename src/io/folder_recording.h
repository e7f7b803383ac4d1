#pragma once
#include <filesystem>
#include <memory>

#include "planar_vslam/io/recording.h"

namespace planar_vslam::io {

Expected<std::unique_ptr<Recording>> OpenFolderRecording(const std::filesystem::path& folder,
                                                         const RecordingOptions& options);

}  // namespace planar_vslam::io
