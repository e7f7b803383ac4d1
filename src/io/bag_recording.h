#pragma once
#include <filesystem>
#include <memory>
#include <vector>

#include "bag_folder.h"
#include "planar_vslam/io/recording.h"

namespace planar_vslam::io {

Expected<std::unique_ptr<Recording>> OpenBagRecording(const std::vector<std::filesystem::path>& paths,
                                                      const RecordingOptions& options);

}  // namespace planar_vslam::io
