#pragma once
// Whether a laser turns the way the wheels do: one that hangs upside down against what tf says turns the other way. As
// measurements come in, in bounded memory.
#include <deque>

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

 private:
  void Compare(const LaserFrame& first, const LaserFrame& second);

  OdometryBuffer odometry_;
  std::deque<LaserFrame> sweeps_;  // some of them, that wait for odometry; the first has been compared
  long agree_ = 0, mirrored_ = 0;
};

}  // namespace planar_vslam
