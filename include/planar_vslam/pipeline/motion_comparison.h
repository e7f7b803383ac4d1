#pragma once
// Whether the wheels went where the images went, and when: poses found by sight against odometry's, from frame to
// frame. What a drive's turns show of the two clocks, what its straights show of the camera's yaw. Poses of a map that
// the wheels helped to make lean towards them: they show about a third of a wrong yaw, and nine tenths of a clock's
// offset.
#include <optional>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/pipeline/wheel_check.h"
#include "planar_vslam/sensor/buffers.h"

namespace planar_vslam {

struct SeenPose {
  Timestamp stamp;
  Rigid2 T_map_base;
};

// How far somebody turned who saw nothing but that.
struct SeenTurn {
  Timestamp from, to;
  double angle = 0.0;  // rad
};

struct MotionAgreement {
  std::optional<Deviation> time_offset;        // s, odometry's stamps minus the images'; up to 5 s are found
  std::optional<Deviation> laser_time_offset;  // s, odometry's stamps minus the laser's
  std::optional<Deviation> turn;       // how much further the wheels turned, as a share; below -1: the other way
  std::optional<Deviation> direction;  // rad, counter-clockwise from where the images drive to where the wheels do
};

// `seen` in order of stamps, poses found by sight alone. Nothing where too little motion shows a value, and nothing of
// the laser.
MotionAgreement CompareMotions(const std::vector<SeenPose>& seen, const OdometryBuffer& wheels);

// odometry's stamps minus those of the turns, s.
std::optional<Deviation> CompareTurns(const std::vector<SeenTurn>& turns, const OdometryBuffer& wheels);

}  // namespace planar_vslam
