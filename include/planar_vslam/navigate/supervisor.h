#pragma once
// Whether the robot may drive at all: it must know where it is, see, and move when it is told to. A robot in doubt
// about its place looks round.
#include <optional>
#include <string>

#include "planar_vslam/navigate/surroundings.h"

namespace planar_vslam {

// What localisation says of itself. Standard deviations that are not finite are too large.
struct PoseQuality {
  double position_deviation = 0.0;  // m, along the worst direction
  double heading_deviation = 0.0;   // rad
};

// What tells localisation where the robot is: landmarks or the laser confirm the pose, wheels carry it along.
enum class PoseSource { kUnsaid, kNothing, kWheels, kConfirmed };

struct Vitals {
  double time = 0.0;                           // s
  double transform_age = 0.0, scan_age = 0.0;  // s; not finite: there was none yet
  std::optional<PoseQuality> quality;          // of the last message on pose; none: nobody sends it
  bool new_quality = false;                    // since the last step
  PoseSource source = PoseSource::kUnsaid;
  bool arrived = false;  // by that pose
  Rigid2 T_odom_base;
  PlaneVelocity commanded;  // sent before this step
};

struct Permission {
  enum class Kind { kDrive, kHold, kGiveUp } kind = Kind::kDrive;
  std::string reason;       // one line; empty where it may drive
  bool look_round = false;  // while it holds: what it sees then may tell where it is
};

class Supervisor {
 public:
  explicit Supervisor(const NavigateOptions& options) : options_(options) {}

  // Once a step. A reason to hold that lasts longer than the limit is one to give up.
  Permission Check(const Vitals& vitals);
  void Reset();

 private:
  std::string ReasonToHold(const Vitals& vitals) const;
  std::string ReasonToDoubt(const Vitals& vitals) const;
  void CountDistance(const Vitals& vitals);
  bool IsStuck(const Vitals& vitals);

  NavigateOptions options_;
  std::optional<double> held_since_, told_since_;  // s
  Rigid2 T_odom_told_, T_odom_last_;
  bool has_last_ = false;
  double driven_without_pose_ = 0.0, driven_unconfirmed_ = 0.0;  // m
};

}  // namespace planar_vslam
