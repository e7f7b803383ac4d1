#pragma once
// When the rows of an image were exposed. A cheap camera reads them one after the other (a rolling shutter): while it
// turns, its images are skewed, a map made of them bends, and no covariance has that in it. Keypoints are put where
// they would be had all rows been taken with the middle one, by the readout that is configured; how much longer the
// readout looks is told from the images themselves.
//
// A keypoint seen a share b of the image's height below the middle is displaced, while the base turns by w, by
//   r w k,   k = -b J_pi (up x p_camera)
// with the readout r and `up` the base's axis in the camera. A landmark stands where its keyframes saw it, displaced by
// their mean w_l. Of the residuals e of a located frame, the part that its pose may have taken up is eliminated,
// P = 1 - J (J^T J)^-1 J^T with six columns J, and what is there without a turn, an error of the lens, is a second
// unknown c:
//   e = P k (r (w - w_l) + c),  by least squares over all frames.
// Landmarks have errors in common, so how well r is known is told by the scatter of blocks of frames, not by the
// pixels' noise.
#include <Eigen/Core>
#include <map>
#include <optional>

#include "planar_vslam/feature/features.h"
#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/pipeline/options.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/pipeline/wheel_check.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// The base's mean motion over the last 0.04 s before the packet's image, or the last reading where these are rarer,
// [m/s, m/s, rad/s] in its own axes; none where odometry does not tell.
std::optional<Eigen::Vector3d> VelocityAt(const FramePacket& packet);
// Of the packet's image, as odometry tells.
ImageMoment MomentOf(const FramePacket& packet);

class ImageTiming {
 public:
  ImageTiming(const ImageTimingOptions& options, const CameraModel& camera) : options_(options), camera_(camera) {}

  // The keypoints where they would be had all rows been taken at once.
  FrameFeaturesPtr Straightened(FrameFeaturesPtr features, const FramePacket& packet) const;
  // Takes a frame that was located by sight; `features` as straightened.
  void Watch(const FramePacket& packet, const FrameFeatures& features, const TrackResult& track, const Map& map);
  // By how much the readout looks longer than the configured one, s; none where the robot has turned too little to
  // tell. A lower bound: keyframes that were adjusted with the landmarks have taken up a part, often most of it.
  std::optional<Deviation> MissedReadout() const;
  // Of a published pose, by clocks that disagree: [x, y, angle], right tangent.
  Eigen::Matrix3d ClockCovariance(const FramePacket& packet) const;

 private:
  // Of ten frames: [g_r, g_c, I_rr, I_rc, I_cc], gradient and information of [r, c] in s and rad.
  using Block = Eigen::Matrix<double, 5, 1>;
  // The mean turn rate of the keyframes that see it; none where no keyframe's is known.
  std::optional<double> RateOf(const Landmark& landmark, const Map& map) const;
  void Add(const Eigen::Matrix2d& information, const Eigen::Vector2d& gradient);
  // Forgets rates of keyframes that are gone.
  void Prune(const Map& map);

  ImageTimingOptions options_;
  CameraModel camera_;
  std::optional<Rigid3> T_base_camera_;  // mount of the image before: a head that turns is no turn of the base
  std::map<Timestamp, double> rates_;    // rad/s, of keyframes
  Block block_ = Block::Zero();          // under way, ...
  int frames_ = 0;                       // ...its frames
  Block sum_ = Block::Zero();            // of all blocks
  Eigen::Matrix<double, 5, 5> squares_ = Eigen::Matrix<double, 5, 5>::Zero();  // sum of their outer products
};

}  // namespace planar_vslam
