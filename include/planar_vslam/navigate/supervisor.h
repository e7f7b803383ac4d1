#pragma once
// Whether the robot may drive at all: it must know where it is, see, and move when it is told to.
#include <optional>
#include <string>

#include "planar_vslam/navigate/surroundings.h"

namespace planar_vslam {

// What localisation says of itself. Standard deviations that are not finite are too large.
struct PoseQuality {
  double position_deviation = 0.0;  // m, along the worst direction
  double heading_deviation = 0.0;   // rad
};

struct Vitals {
  double time = 0.0;                           // s
  double transform_age = 0.0, scan_age = 0.0;  // s; not finite: there was none yet
  std::optional<PoseQuality> quality;          // of the last message on pose; none: nobody sends it
  bool new_quality = false;                    // since the last step
  Rigid2 T_odom_base;
  PlaneVelocity commanded;  // sent before this step
};

struct Permission {
  enum class Kind { kDrive, kHold, kGiveUp } kind = Kind::kDrive;
  std::string reason;  // one line; empty where it may drive
};

class Supervisor {
 public:
  explicit Supervisor(const NavigateOptions& options) : options_(options) {}

  // Once a step. A reason to hold that lasts longer than the limit is one to give up.
  Permission Check(const Vitals& vitals);
  void Reset();

 private:
  std::string ReasonToHold(const Vitals& vitals);
  bool IsStuck(const Vitals& vitals);

  NavigateOptions options_;
  std::optional<double> held_since_, told_since_;  // s
  Rigid2 T_odom_told_, T_odom_last_;
  bool has_last_ = false;
  double driven_without_pose_ = 0.0;  // m
};

}  // namespace planar_vslam
