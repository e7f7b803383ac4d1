#pragma once
// The simulated robot under somebody's control: commands in, measurements out, time in fixed steps. The same world,
// seed and commands at the same steps give the same bytes.
#include <memory>
#include <optional>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/mobile_base.h"
#include "planar_vslam/sim/people_motion.h"
#include "planar_vslam/sim/sensor_rig.h"

namespace planar_vslam {

struct LiveOptions : SensorOptions {
  std::optional<Rigid2> start;  // T_world_base; none: where the world's drive starts
  bool follow_drive = false;    // follows the world's drive before it obeys commands
  bool people_wait = false;     // people see the robot that obeys commands and stop in front of it; else they do not
};

class LiveSimulation {
 public:
  // Errors are one line that names the world's file and key.
  static Expected<LiveSimulation> Create(const World& world, const LiveOptions& options);

  // From now on, until the next one or until the limits' command_timeout has passed. One that is not finite stops the
  // robot. While a drive is followed it changes nothing.
  void Command(const VelocityCommand& command);
  // Somebody carries the robot there, in no time: its wheels do not turn, it stands. The reason where that cannot be:
  // the place is not free, or a drive is followed.
  std::optional<Error> Carry(const Rigid2& T_world_base);
  // The camera sees nothing for so many seconds from now.
  void CoverCamera(double seconds) { rig_.CoverCamera(now(), seconds); }
  // Drive::kStep later.
  void Step();
  // The next measurement that is due: SensorRig::lead() after its stamp. None: step on.
  std::optional<SimulatedEvent> Next();

  double now() const;           // s
  BaseState base() const;       // without velocity where a drive is followed
  Rigid3 T_world_base() const;  // now
  // From then on commands are obeyed: sensors no longer look back into the drive. False where none was followed.
  bool drive_is_over() const { return drive_is_over_; }
  const World& world() const { return rig_.world(); }

 private:
  LiveSimulation(const World& world, const LiveOptions& options, std::unique_ptr<PlannedMotion> planned);
  void EndDrive();
  void StepPeople();

  SensorRig rig_;
  Obstacles obstacles_;
  BaseState base_;
  std::optional<PeopleMotion> people_;  // none: they wait for nobody
  DrivenMotion driven_;
  std::unique_ptr<PlannedMotion> planned_;  // null: commands
  bool drive_is_over_ = false;
  VelocityCommand command_;
  double commanded_at_ = 0.0;  // s
  std::int64_t steps_ = 0;
};

}  // namespace planar_vslam
