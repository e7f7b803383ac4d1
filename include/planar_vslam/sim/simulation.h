#pragma once
// A simulated drive as a stream of measurements in time order, with the truth beside each.
#include <limits>
#include <optional>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/sensor_rig.h"
#include "planar_vslam/sim/true_motion.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

struct SimulationOptions : SensorOptions {
  double until = std::numeric_limits<double>::infinity();  // s, end of the simulation
};

// Pull style: one Next() after the other. Events at the same stamp come as odometry, laser, camera.
class Simulation {
 public:
  // Errors are one line that names the world's file and key.
  static Expected<Simulation> Create(const World& world, const SimulationOptions& options);

  std::optional<SimulatedEvent> Next();

  const World& world() const { return rig_.world(); }
  const Drive& drive() const { return motion_.drive(); }
  const Scene& scene() const { return rig_.scene(); }
  const CameraSensor& camera() const { return rig_.camera(); }
  bool renders() const { return rig_.renders(); }
  double end_time() const { return end_; }  // s

 private:
  Simulation(const World& world, const SimulationOptions& options, Drive drive);

  PlannedMotion motion_;
  double end_;  // s
  SensorRig rig_;
};

}  // namespace planar_vslam
