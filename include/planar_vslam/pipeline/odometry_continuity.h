#pragma once
// Odometry without its jumps. A base that is restarted, a filter that is corrected, memory that was never filled in:
// the pose jumps, and the robot does not. What chains odometry must not take such a step for motion, least of all
// before there is a map to tell.
//
// A step is a jump where it is fast (4 m/s over 5 cm, or 6 rad/s over 0.1 rad), and three times as fast as the step
// before and three times as long as any of the ten before: a car may be fast, but does not become it at once, and
// stamps that come in bursts make a step fast, but not long. Before the first step 50 m/s or 30 rad/s is a jump. A jump
// is replaced by the motion of the step before, and from there on poses are continued from it.
//
// Poses that only jumped, or never moved, then jumped and are in full motion at once, were not odometry: what hangs on
// them is worthless.
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

class OdometryContinuity {
 public:
  // The reading, continued; nothing where it is no number. One whose stamp is not later than the last one's is handed
  // on as it is.
  std::optional<OdometryReading> Push(const OdometryReading& reading);
  // Whether the readings up to the last jump have just turned out to be worthless; true once.
  bool TakeWorthlessStart();
  // Readings dropped, and jumps, by reason.
  const std::map<std::string, long>& counted() const { return counted_; }

 private:
  struct Step {
    double way = 0.0, turn = 0.0, seconds = 0.0;  // m, rad without sign, s
  };
  bool IsJump(const Step& step) const;
  void Remember(const Step& step);

  std::optional<OdometryReading> last_;  // as it came
  bool jumped_ = false;
  Rigid2 T_here_odom_;             // from the source's frame to the one that goes on
  std::deque<Step> steps_;         // the last ones that are no jumps, newest last
  bool moved_ = false;             // in one of them, ever
  bool jumped_from_rest_ = false;  // by the last step, and had never moved before
  bool only_jumped_ = false;       // in every step so far
  bool worthless_start_ = false;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  std::map<std::string, long> counted_;
};

}  // namespace planar_vslam
