#pragma once
// What the streams of measurements look like as they come in: how often, with what holes, how bright, how fast. In
// bounded memory.
#include <optional>

#include "planar_vslam/pipeline/laser_check.h"
#include "planar_vslam/pipeline/stage_statistics.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct StreamRhythm {
  DurationHistogram intervals;                 // ms between stamps
  long holes = 0;                              // intervals of over a second
  double longest_hole = 0.0, all_holes = 0.0;  // s

  void Add(Timestamp stamp);
  // Seconds by which all its stamps lie after those of another stream; negative: before them; 0 where they meet,
  // or nearly.
  double Apart(const StreamRhythm& other) const;

 private:
  std::optional<Timestamp> first_, last_;
};

class InputWatch {
 public:
  void Add(const CameraFrame& frame);
  void Add(const OdometryReading& reading);
  void Add(const LaserFrame& frame);

  const StreamRhythm& images() const { return images_; }
  const StreamRhythm& odometry() const { return odometry_; }
  const StreamRhythm& scans() const { return scans_; }
  const LaserCheck& laser() const { return laser_; }
  // Shares of the images whose mean grey is under 25 or over 230 of 255.
  double dark_images() const { return ShareOf(dark_); }
  double bright_images() const { return ShareOf(bright_); }
  // m/s, faster than all but a tenth of the steps in which the wheels moved; 0 where they never did.
  double wheel_speed() const;
  double wheel_way() const { return way_; }  // m, that the wheels drove
  // Share of odometry's steps that take back the one before, faster than a robot can: two publishers on one topic.
  double odometry_back_and_forth() const;
  // The first image's place on the base.
  const std::optional<Rigid3>& T_base_camera() const { return T_base_camera_; }

 private:
  double ShareOf(long count) const { return looked_at_ > 0 ? static_cast<double>(count) / looked_at_ : 0.0; }

  StreamRhythm images_, odometry_, scans_;
  LaserCheck laser_;
  double looked_at_ = 0.0;  // images
  long dark_ = 0, bright_ = 0;
  DurationHistogram speeds_;  // m/s
  double way_ = 0.0;          // m
  long back_and_forth_ = 0;
  std::optional<OdometryReading> last_reading_;
  Eigen::Vector2d last_step_ = Eigen::Vector2d::Zero();  // m, in odometry's frame
  double last_seconds_ = 0.0;
  std::optional<Rigid3> T_base_camera_;
};

}  // namespace planar_vslam
