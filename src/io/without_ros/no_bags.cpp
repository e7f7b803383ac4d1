// Instead of the reader and writer of rosbags where there is no ROS.
#include <fmt/format.h>

#include "../bag_recording.h"
#include "planar_vslam/io/bag_writer.h"

namespace planar_vslam {

namespace fs = std::filesystem;

namespace io {

Expected<std::unique_ptr<Recording>> OpenBagRecording(const std::vector<fs::path>& paths, const RecordingOptions&) {
  return Error{
      fmt::format("{}: a bag; this build is without ROS and reads none of them (.bag, .mcap, .db3). Expected a "
                  "dataset folder, or a build with ROS",
                  paths.front().string())};
}

}  // namespace io

struct BagWriter::Impl {};

BagWriter::BagWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;
BagWriter::~BagWriter() = default;

Expected<BagWriter> BagWriter::Create(const fs::path& path, const BagRobot&) {
  return Error{fmt::format("{}: not written: this build is without ROS and has no bags", path.string())};
}

// Create gives no writer to call these on.
void BagWriter::Write(const CameraFrame&) {}
void BagWriter::Write(const OdometryReading&) {}
void BagWriter::Write(const LaserFrame&) {}
Expected<bool> BagWriter::Close() { return true; }

}  // namespace planar_vslam
