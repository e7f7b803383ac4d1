#pragma once
// Whether a laser turns the way the wheels do: one that hangs upside down against what tf says turns the other way.
// Whether it looks where tf says. As measurements come in, in bounded memory.
#include <deque>
#include <optional>
#include <vector>

#include "planar_vslam/pipeline/laser_direction.h"
#include "planar_vslam/pipeline/motion_comparison.h"
#include "planar_vslam/sensor/buffers.h"

namespace planar_vslam {

class LaserCheck {
 public:
  // Each in order of its stamps.
  void Add(const LaserFrame& frame);
  void Add(const OdometryReading& reading);

  // Of the turns between sweeps: how many the sweeps show as the wheels have them, and how many mirrored.
  long agree() const { return agree_; }
  long mirrored() const { return mirrored_; }
  // Whether so many more are mirrored that the mount is wrong.
  bool IsUpsideDown() const;
  // How the laser turned from sweep to sweep by the sweeps alone, in bounded number: for the clocks to be compared. A
  // pair that does not show by how much is none of them.
  const std::vector<SeenTurn>& turns() const { return turns_; }
  // rad, to the left: see LaserDirection. Nothing where it hangs upside down against tf.
  std::optional<double> Turned() const;

 private:
  void Compare(const LaserFrame& first, const LaserFrame& second);
  void AddTurn(const LaserFrame& first, const LaserFrame& second);
  void CompareWay(const LaserFrame& frame, const Rigid2& T_odom_base);

  OdometryBuffer odometry_;
  std::deque<LaserFrame> sweeps_;  // some of them, that wait for odometry; the first has been compared
  long agree_ = 0, mirrored_ = 0;
  std::vector<SeenTurn> turns_;
  LaserDirection direction_;
  std::optional<std::pair<LaserFrame, Rigid2>> way_start_;  // a sweep, and T_odom_base there
};

}  // namespace planar_vslam
