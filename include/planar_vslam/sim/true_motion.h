#pragma once
// Where the robot truly is at any time: along a planned drive, or wherever velocity commands have led it so far.
#include <cstdint>
#include <deque>
#include <vector>

#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/floor.h"
#include "planar_vslam/sim/robot_spec.h"

namespace planar_vslam {

// What the sensors are carried by.
class TrueMotion {
 public:
  virtual ~TrueMotion() = default;
  Rigid3 At(double time) const { return At(time, time); }  // T_world_base
  // T_world_base at `time` had nobody carried the robot after `carried_until`.
  virtual Rigid3 At(double time, double carried_until) const = 0;
  virtual bool Carried(double after, double until) const = 0;  // within (after, until]
  // A person's own time at `time`, s: behind where they waited for the robot.
  virtual double PersonTime(std::size_t /*person*/, double time) const { return time; }
};

// The drive on the floor it leads over, with the places the robot is carried to.
class PlannedMotion : public TrueMotion {
 public:
  PlannedMotion(Drive drive, Floor floor, std::vector<KidnapSpec> kidnaps);

  double duration() const { return duration_; }  // s; afterwards the robot rests
  const Drive& drive() const { return drive_; }
  using TrueMotion::At;
  Rigid3 At(double time, double carried_until) const override;
  bool Carried(double after, double until) const override;
  Rigid2 PlaceAt(double time, double carried_until) const;  // T_world_base, in the plane

 private:
  Drive drive_;
  Floor floor_;
  std::vector<KidnapSpec> kidnaps_;
  double duration_;
};

// The last seconds of a way that is only known up to now.
class DrivenMotion : public TrueMotion {
 public:
  static constexpr double kMemory = 3.0;  // s, longer than any sensor looks back

  // Step `first` of the way: the robot stood at `start` until then.
  DrivenMotion(Floor floor, const Rigid2& start, std::int64_t first = 0)
      : floor_(std::move(floor)), poses_{start}, last_(first) {}

  // Where the robot is Drive::kStep after the last pose.
  void Append(const Rigid2& T_world_base);
  // People's own times at the last pose, s. Without them they go by everybody's.
  void AppendPeople(const std::vector<double>& times);
  // Somebody carries the robot there now, in no time.
  void Carry(const Rigid2& T_world_base);
  double now() const { return Drive::kStep * static_cast<double>(last_); }  // s, of the last pose
  using TrueMotion::At;
  Rigid3 At(double time, double carried_until) const override;
  bool Carried(double after, double until) const override;
  double PersonTime(std::size_t person, double time) const override;

 private:
  struct Carrying {
    double at;                 // s
    Rigid2 T_world_uncarried;  // where it has led, in all
  };
  Floor floor_;
  std::vector<Carrying> carried_;
  std::deque<Rigid2> poses_;                // had nobody ever carried it
  std::int64_t last_ = 0;                   // number of the last pose
  std::deque<std::vector<double>> people_;  // s; the last one is of the last pose
};

}  // namespace planar_vslam
