#pragma once
// All sensors of a simulated robot with what goes wrong with them. Whoever moves the robot asks for the measurements,
// one after the other; recorded drives and live robots share everything here.
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "planar_vslam/sensor/measurements.h"
#include "planar_vslam/sim/head.h"
#include "planar_vslam/sim/scene.h"
#include "planar_vslam/sim/sensors.h"
#include "planar_vslam/sim/slips.h"
#include "planar_vslam/sim/true_motion.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

struct SimulatedEvent {
  std::variant<CameraFrame, OdometryReading, LaserFrame> measurement;
  // Truth at the measurement's stamp. The camera's includes the shake that CameraFrame::T_base_camera does not know of.
  // A camera with a time offset made its picture earlier: T_world_camera is where it was then, T_world_base is of the
  // stamp on the odometry's clock.
  Rigid3 T_world_base;
  Rigid3 T_world_camera;  // of camera frames only
};
Timestamp StampOf(const SimulatedEvent& event);

struct SensorOptions {
  std::uint64_t seed = 1;  // same world, same seed: same bytes
  int threads = 1;         // that render; any number gives the same bytes
  bool render = true;      // false: camera frames carry empty images
};

class SensorRig {
 public:
  // Needs FindProblems(world).empty().
  SensorRig(const World& world, const SensorOptions& options);

  // The next measurement, if its stamp is not after `until` (s). Events at the same stamp come as odometry, laser,
  // camera. `motion` must be known up to lead() after the stamp.
  std::optional<SimulatedEvent> Next(const TrueMotion& motion, double until);
  double lead() const;  // s
  // The camera sees nothing from `from` on, for `seconds`.
  void CoverCamera(double from, double seconds) { world_.events.blackouts.push_back({from, seconds}); }

  bool renders() const { return options_.render; }
  const World& world() const { return world_; }
  const Scene& scene() const { return *scene_; }
  const CameraSensor& camera() const { return camera_; }

 private:
  SimulatedEvent NextOdometry(const TrueMotion& motion);
  SimulatedEvent NextScan(const TrueMotion& motion);
  SimulatedEvent NextImage(const TrueMotion& motion);
  GrayImage Photograph(const TrueMotion& motion, double time, const Rigid3& T_world_camera, std::uint64_t number);
  // T_world_camera without shake at `time`, had nobody carried the robot after `carried_until`.
  Rigid3 CameraAt(const TrueMotion& motion, double time, double carried_until) const;
  // Puts those who walk where they are at `time`.
  void MovePeople(const TrueMotion& motion, double time);

  World world_;
  SensorOptions options_;
  Head head_;
  SlipSchedule slips_;
  std::unique_ptr<Scene> scene_;
  CameraSensor camera_;
  ExposureControl exposure_;
  MountShake shake_;
  LaserSensor laser_;
  WheelOdometer odometer_;
  std::int64_t odometry_count_ = 0, scan_count_ = 0, image_count_ = 0;
};

}  // namespace planar_vslam
