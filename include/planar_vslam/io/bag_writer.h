#pragma once
// Writes measurements as a bag with a robot's usual topics: /camera/image_raw/compressed (JPEG),
// /camera/camera_info, /odom, /scan, /tf, /tf_static. The same measurements give the same bytes.
#include <filesystem>
#include <memory>
#include <optional>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct BagRobot {
  CameraModel camera;
  Rigid3 T_base_camera;
  bool camera_moves = false;  // then base -> camera is a transform of /tf at every image, not a static one
  Rigid3 T_base_laser;
};

class BagWriter {
 public:
  // Replaces the file. By the end of its name: an .mcap or .db3 as ROS 2 records them, else a rosbag (v2).
  static Expected<BagWriter> Create(const std::filesystem::path& path, const BagRobot& robot);
  BagWriter(BagWriter&&) noexcept;
  BagWriter& operator=(BagWriter&&) noexcept;
  ~BagWriter();

  // In the order of time; second 0 becomes 1.7e9 in the bag, since stamps of zero are not valid in ROS. A frame without
  // pixels leaves only its transform.
  void Write(const CameraFrame& frame);
  void Write(const OdometryReading& reading);
  void Write(const LaserFrame& frame);
  // The first thing that went wrong, if anything. Nothing can be written afterwards.
  Expected<bool> Close();

 private:
  struct Impl;
  explicit BagWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_vslam
