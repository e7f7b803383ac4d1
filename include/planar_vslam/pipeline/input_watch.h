#pragma once
// What the streams of measurements look like as they come in: how often, with what holes, how bright, how fast. In
// bounded memory.
#include <optional>
#include <vector>

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
  // Seconds from the other's first stamp to its own, and from its own last one to the other's; 0 where one is empty.
  double StartsAfter(const StreamRhythm& other) const;
  double EndsBefore(const StreamRhythm& other) const;

 private:
  std::optional<Timestamp> first_, last_;
};

class InputWatch {
 public:
  void Add(const CameraFrame& frame);
  void Add(const OdometryReading& reading);
  // Whether the sweep is new: false where it is the same as before to the last bit, although the wheels drove on.
  bool Add(const LaserFrame& frame);

  const StreamRhythm& images() const { return images_; }
  const StreamRhythm& odometry() const { return odometry_; }
  const StreamRhythm& scans() const { return scans_; }
  const LaserCheck& laser() const { return laser_; }
  long old_sweeps() const { return old_sweeps_; }  // that were not new
  long old_images() const { return old_images_; }
  // s, the longest time that one after the other was not new.
  double sweeps_hung() const { return sweep_.longest; }
  double images_hung() const { return image_.longest; }
  // Shares of the images whose mean grey is under 25 or over 230 of 255.
  double dark_images() const { return ShareOf(dark_); }
  double bright_images() const { return ShareOf(bright_); }
  // m/s, faster than all but a tenth of the steps in which the wheels moved; 0 where they never did.
  double wheel_speed() const;
  double wheel_way() const { return way_; }  // m, that the wheels drove
  // m/s^2, of bends, more than in all but a tenth of the time in which the wheels drove one; 0 where they never did.
  double wheel_sideways() const;
  // Share of odometry's steps that take back the one before, faster than a robot can: two publishers on one topic.
  double odometry_back_and_forth() const;
  // The first image's place on the base.
  const std::optional<Rigid3>& T_base_camera() const { return T_base_camera_; }

 private:
  void AddBend(const OdometryReading& reading);
  template <class Content>
  struct StandStill {
    std::optional<Content> content;
    Rigid2 T_odom_base;
    std::optional<Timestamp> old;  // since when the wheels had driven on
    double longest = 0.0;          // s that it was old
  };
  // Whether the wheels have driven on since what came in was first the same as now.
  template <class Content, class Same>
  bool IsOld(const Content& content, Timestamp stamp, const Same& same, StandStill<Content>* since) const;
  double ShareOf(long count) const { return looked_at_ > 0 ? static_cast<double>(count) / looked_at_ : 0.0; }

  StreamRhythm images_, odometry_, scans_;
  LaserCheck laser_;
  double looked_at_ = 0.0;  // images
  long dark_ = 0, bright_ = 0;
  DurationHistogram speeds_;    // m/s
  DurationHistogram sideways_;  // m/s^2
  std::optional<OdometryReading> bend_start_;
  double way_ = 0.0;  // m
  long back_and_forth_ = 0;
  std::optional<OdometryReading> last_reading_;
  Eigen::Vector2d last_step_ = Eigen::Vector2d::Zero();  // m, in odometry's frame
  double last_seconds_ = 0.0;
  std::optional<Rigid3> T_base_camera_;
  StandStill<std::vector<float>> sweep_;
  StandStill<std::uint64_t> image_;  // a sum of its pixels
  long old_sweeps_ = 0, old_images_ = 0;
};

}  // namespace planar_vslam
