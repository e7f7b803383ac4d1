#pragma once
// A recorded drive, streamed in time order: bags and dataset folders look the same from here.
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/lens.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

using RecordedEvent = std::variant<CameraFrame, OdometryReading, LaserFrame>;

struct RecordingInfo {
  CameraModel camera;
  bool has_odometry = false;
  bool has_laser = false;
  bool has_base_transform = false;  // whether base -> camera is known; otherwise base is the camera's optical frame
  Timestamp first_image, last_image;
  long image_count = 0;
  // Bags: which topic each sensor is read from, and the ways of tf to their frames. Empty for folders.
  std::string topics, frames;
  // One line each: what was found odd and is read in a way that the user should know.
  std::vector<std::string> notes;
};

// Names of topics and frames in a bag; an empty topic means: the only one of its type, an error when there are several
// (camera_info: first the one beside the images). An empty base frame means: a handheld camera, odometry and scans
// unused.
struct BagOptions {
  std::string image_topic, camera_info_topic, odometry_topic, scan_topic;
  std::string base_frame = "base_footprint";
  std::string odom_frame = "odom";
  RectifiedImages rectified = RectifiedImages::kAuto;
};

struct RecordingOptions {
  BagOptions bag;
  std::optional<std::filesystem::path> odometry_file;  // dataset folders: instead of odometry.csv
  bool require_odometry = false;                       // absent odometry is an error
};

class Recording {
 public:
  virtual ~Recording() = default;
  virtual const RecordingInfo& info() const = 0;
  // Next event in time order; nothing at the end. Bad single messages are skipped, counted, and named once on stderr;
  // an error means the recording cannot be read on.
  virtual Expected<std::optional<RecordedEvent>> Next() = 0;
  // Skipped messages by reason ("image of changed size", "odometry stamp not increasing", ...).
  virtual const std::map<std::string, long>& skipped() const = 0;
};

// Opens a bag (rosbag v2; .mcap, .db3 or their folder as ROS 2 records them), a dataset folder (images.csv, ...), a
// TUM-RGBD folder (rgb.txt) or a KITTI odometry folder (image_0, times.txt, calib.txt). One-line errors: file, field or
// topic, what was expected.
Expected<std::unique_ptr<Recording>> OpenRecording(const std::filesystem::path& path, const RecordingOptions& options);
// Several bags of one drive as one recording, in any order: what one holds, such as tf_static, counts for all.
Expected<std::unique_ptr<Recording>> OpenRecording(const std::vector<std::filesystem::path>& paths,
                                                   const RecordingOptions& options);

}  // namespace planar_vslam
