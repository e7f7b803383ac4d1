#pragma once
// Self-calibration: bundle adjustment of a whole map in which odometry's scale, the camera's mount on the base and the
// clocks' offset are unknowns beside poses and points. Minimised:
//   sum |e_mounted_reprojection|^2 (Huber) + sum |e_odometry_calibration|^2 (Huber) + sum |e_delayed_laser|^2 (Huber)
//   + sum |e_floor|^2 + sum |e_sway|^2 + sum ((value - prior) / prior sigma)^2
// over the map's poses, points and the values below. A keyframe has two poses: the base that its image shows, if the
// camera sits where the mount says, and the base that wheels, laser and floor are about. Between them is the sway of
// the camera, a rotation about itself: e_sway = Ad(T_base_camera^-1) Log(T_image^-1 T_base). Without it, what the
// camera sways by when the robot starts to turn is taken for a delay of its clock. Which of them a drive shows depends
// on the drive: turning shows the mount's position and yaw scale, a laser the scale of distance, speed changes the
// offset; a floor the mount's tilt. A value whose posterior sigma stays near its prior's was not seen, and keeps the
// prior's value.
#include <array>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/optimize/bundle_adjustment.h"
#include "planar_vslam/planar/odometry_calibration.h"

namespace planar_vslam {

// Corrections to what the recording says of its sensors.
struct SensorCorrection {
  OdometryCorrection odometry;
  // m = [d, w] of mounted_reprojection_factor.h, base axes: position x y z (m), roll pitch yaw (rad, a rotation
  // vector).
  Vector6d camera_mount = Vector6d::Zero();

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr double kLargestScale = 1.5;
    constexpr double kLargestOffset = 0.5;  // s: a recording is off by more for another reason
    const Bound scale = bound::Between(1.0 / kLargestScale, kLargestScale);
    v("odometry_scale_x", o.odometry.scale[0], unit::kNone, scale,
      "multiplies distance forward as the wheels read it...");
    v("odometry_scale_y", o.odometry.scale[1], unit::kNone, scale, "...sideways...");
    v("odometry_scale_yaw", o.odometry.scale[2], unit::kNone, scale, "...and rotation");
    v("time_offset", o.odometry.time_offset, unit::kSeconds, bound::FromTo(-kLargestOffset, kLargestOffset),
      "odometry's (and the laser's) clock minus the camera's");
    v("camera_x", o.camera_mount[0], unit::kMeters, bound::Finite(),
      "added to the camera's position on the base, in base axes");
    v("camera_y", o.camera_mount[1], unit::kMeters, bound::Finite(), "");
    v("camera_z", o.camera_mount[2], unit::kMeters, bound::Finite(), "");
    v("camera_roll_deg", o.camera_mount[3], unit::kDegrees, bound::Finite(),
      "turned about the base's x, y and z axes (a rotation vector)");
    v("camera_pitch_deg", o.camera_mount[4], unit::kDegrees, bound::Finite(), "");
    v("camera_yaw_deg", o.camera_mount[5], unit::kDegrees, bound::Finite(), "");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

struct CalibrationOptions {
  double odometry_scale_sigma = 0.05;                 // of the prior: share of 1
  double camera_position_sigma = 0.05;                // m, x and y; planar motion says nothing of z
  double camera_angle_sigma = DegreesToRadians(3.0);  // rad, each
  double time_offset_sigma = 0.1;                     // s
  double camera_sway_sigma = DegreesToRadians(0.16);  // rad about each axis, from image to image
  double max_sigma_ratio = 0.3;                       // posterior over prior sigma up to which a value counts as seen
  int max_iterations = 30;
};

struct CalibratedValue {
  std::string name;  // as in the configuration, without "calibration."
  std::string unit;
  double value = 0.0;
  double sigma = 0.0;  // posterior
  double prior_sigma = 0.0;
  bool observed = false;
};
inline constexpr std::size_t kCalibratedValues = 9;

struct CalibrationResult {
  SensorCorrection correction;                            // values not observed as they were before
  std::array<CalibratedValue, kCalibratedValues> values;  // scale x y yaw, camera x y, roll pitch yaw, time offset
};

// `map` was made with `present` applied to `readings`, the odometry of the whole recording as it was read. The prior is
// centred on no correction at all. Errors: a map that is not metric, or an adjustment that fails.
Expected<CalibrationResult> CalibrateMap(const Map& map, const std::vector<OdometryReading>& readings,
                                         const SensorCorrection& present, const MeasurementModel& context,
                                         const CalibrationOptions& options);

}  // namespace planar_vslam
