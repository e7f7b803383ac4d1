#pragma once
// The robot of a simulated world as a value: its drive, its sensors and what goes wrong with them.
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

enum class BaseKind { kOmnidirectional, kDifferential };

struct DriveSpec {
  BaseKind base = BaseKind::kOmnidirectional;
  Rigid2 start;                            // T_world_base at t = 0
  double shuffle = 0.0;                    // m sideways (left positive) before driving forward
  std::vector<Eigen::Vector2d> waypoints;  // m
  double laps = 0.0;                       // times round the closed polygon of waypoints; 0: once along the open line
  double speed = 0.35;                     // m/s
  double sideways_speed = 0.2;             // m/s, peak of the shuffle
  double acceleration = 0.3;               // m/s^2
  double turn_rate = 0.6;                  // rad/s
  double turn_acceleration = 1.2;          // rad/s^2
  double robot_radius = 0.25;              // m, kept clear of everything
};

// What the base can do when velocity commands move it. Its kind and radius are the drive's.
struct LimitsSpec {
  double speed = 0.55;             // m/s, ahead and back
  double sideways_speed = 0.35;    // m/s
  double acceleration = 0.5;       // m/s^2, speeding up and slowing down
  double turn_rate = 1.0;          // rad/s
  double turn_acceleration = 2.0;  // rad/s^2
  double command_timeout = 0.5;    // s without a command after which it stops
};

struct CameraSpec {
  CameraModel model{640, 480, 610.0, 610.0, 322.3, 238.6, 0.03, -0.09, 0.0, 0.0, 0.0};
  double rate = 10.0;                          // Hz
  Eigen::Vector3d position{0.06, 0.0, 1.118};  // m, of the optical centre in the base
  double tilt_down = 0.06;                     // rad, optical axis below the horizon
  double shake = 0.0;                          // rad, standard deviation of the mount about each axis
  double noise = 0.0;                          // grey levels, standard deviation at mid grey
  double exposure = 1.0;                       // factor on the grey levels, of the first image if it adjusts itself
  bool auto_exposure = false;                  // follows the light
  double exposure_target = 115.0;              // mean grey level the automatic looks for
  double exposure_response = 0.4;              // s, after which the automatic is down to 1 / e of what it was off
  double exposure_time = 0.0;                  // s the shutter is open at factor 1; 0: nothing blurs
  double longest_exposure = 0.033;             // s, beyond which darkness is amplified instead
  double rolling_shutter = 0.0;                // s from the first row to the last; 0: all at once
  double time_offset = 0.0;                    // s its stamps are ahead of the odometry's clock

  Rigid3 T_base_camera() const;
};

// Joints that pan and tilt the camera about the neck.
struct HeadPose {
  double time = 0.0;  // s
  double pan = 0.0;   // rad, to the left
  double tilt = 0.0;  // rad, down
};
struct HeadSpec {
  Eigen::Vector3d neck{0.0, 0.0, 1.02};  // m, where the joints' axes meet, in the base
  std::vector<HeadPose> motion;          // smooth in between; none: the head is still
  double period = 0.0;                   // s after which the motion starts again; 0: the last pose holds
  double backlash = 0.0;                 // rad of play in each joint, of which the robot knows nothing
};

enum class LaserKind { kFull, kPepper, kNone };

struct LaserSpec {
  // kPepper: beams only in three sectors of 60 degrees, ahead, left and right; kNone: the robot has no laser
  LaserKind kind = LaserKind::kFull;
  double rate = 5.0;                  // Hz
  double height = 0.25;               // m above the floor, over the base's origin
  double field_of_view = 1.5 * M_PI;  // rad, centred on forward
  int beams = 541;
  double range_max = 8.0;  // m
  double noise = 0.0;      // m, standard deviation

  Rigid3 T_base_laser() const;
  bool present() const { return kind != LaserKind::kNone; }
  bool Looks(double angle) const;  // whether there is a beam at all
  double angle_min() const { return -0.5 * field_of_view; }
  double angle_increment() const { return field_of_view / (beams - 1); }
};

struct OdometrySpec {
  double rate = 50.0;              // Hz
  double scale = 1.0;              // measured / true distance
  double yaw_scale = 1.0;          // measured / true rotation
  double translation_noise = 0.0;  // m per sqrt(m), each axis
  double rotation_noise = 0.0;     // rad per sqrt(m) and per sqrt(rad)
};

// While it lasts, the wheels tell `factor` times the robot's motion: above 1 they spin, below the robot skids.
struct SlipSpec {
  double at = 0.0;        // s
  double duration = 0.5;  // s
  double factor = 2.0;
};
struct RandomSlipSpec {
  double rate = 0.0;                   // per minute; 0: none
  Eigen::Vector2d duration{0.3, 1.2};  // s, from, to
  Eigen::Vector2d spinning{1.2, 2.5};  // factors, from, to, of one half of the slips
  Eigen::Vector2d skidding{0.0, 0.8};  // and of the other
};
// Someone carries the robot to where its drive would have led `skip` seconds later; the wheels do not turn.
struct KidnapSpec {
  double at = 0.0;    // s
  double skip = 5.0;  // s
};
struct SpanSpec {
  double at = 0.0;        // s
  double duration = 2.0;  // s

  bool Contains(double time) const { return time >= at && time < at + duration; }
};

// What goes wrong, and when.
struct EventsSpec {
  std::vector<SlipSpec> slips;
  RandomSlipSpec random_slips;
  std::vector<KidnapSpec> kidnaps;   // in the order of time
  std::vector<SpanSpec> blackouts;   // the camera sees nothing
  std::vector<SpanSpec> occlusions;  // somebody walks close in front of the robot
};

}  // namespace planar_vslam
