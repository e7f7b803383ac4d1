#pragma once
// A simulated drive as a stream of measurements in time order, with the truth beside each.
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <variant>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sensor/measurements.h"
#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/head.h"
#include "planar_vslam/sim/robot_motion.h"
#include "planar_vslam/sim/scene.h"
#include "planar_vslam/sim/sensors.h"
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

struct SimulationOptions {
  std::uint64_t seed = 1;                                  // same world, same seed: same bytes
  double until = std::numeric_limits<double>::infinity();  // s, end of the simulation
  int threads = 1;                                         // that render; any number gives the same bytes
  bool render = true;                                      // false: camera frames carry empty images
};

// Pull style: one Next() after the other. Events at the same stamp come as odometry, laser, camera.
class Simulation {
 public:
  // Errors are one line that names the world's file and key.
  static Expected<Simulation> Create(const World& world, const SimulationOptions& options);

  std::optional<SimulatedEvent> Next();

  const World& world() const { return world_; }
  const Drive& drive() const { return motion_.drive(); }
  const Scene& scene() const { return *scene_; }
  const CameraSensor& camera() const { return camera_; }
  double end_time() const { return end_; }  // s

 private:
  Simulation(const World& world, const SimulationOptions& options, Drive drive);
  SimulatedEvent NextOdometry();
  SimulatedEvent NextScan();
  SimulatedEvent NextImage();
  GrayImage Photograph(double time, const Rigid3& T_world_camera, std::uint64_t number);
  // T_world_camera without shake at `time`, had nobody carried the robot after `carried_until`.
  Rigid3 CameraAt(double time, double carried_until) const;
  // Puts those who walk where they are at `time`.
  void MovePeople(double time);

  World world_;
  SimulationOptions options_;
  RobotMotion motion_;
  Head head_;
  std::vector<SlipSpec> slips_;  // in the order of time
  double end_;                   // s
  std::unique_ptr<Scene> scene_;
  CameraSensor camera_;
  ExposureControl exposure_;
  MountShake shake_;
  LaserSensor laser_;
  WheelOdometer odometer_;
  std::int64_t odometry_count_ = 0, scan_count_ = 0, image_count_ = 0;
};

}  // namespace planar_vslam
