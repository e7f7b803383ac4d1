#pragma once
// The robot's sensors. Each is a function of the scene, a pose and a seed or its own random stream; none knows a drive,
// so that a recorded drive, a test or a live robot can move them.
#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "planar_vslam/sensor/measurements.h"
#include "planar_vslam/sim/scene.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

// Rays through pixel centres, unit length, camera frame; one more column and row than the image has.
struct RayTable {
  int columns = 0;
  std::vector<float> x, y, z;

  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
  Eigen::Vector3f At(int column, int row) const {
    const std::size_t i = Index(column, row);
    return {x[i], y[i], z[i]};
  }
};

// How the shutter was set.
struct Exposure {
  double factor = 1.0;      // on the grey levels; 0 for a covered lens
  double time = 0.0;        // s it is open: what moves meanwhile blurs
  double noise_gain = 1.0;  // on the noise's deviation
};

// Where and how a picture is taken.
struct CameraShot {
  Rigid3 T_world_camera;                 // optical frame, in the middle of the exposure of the middle row
  Vector6d velocity = Vector6d::Zero();  // of the camera along its own axes, m/s and rad/s
  std::uint64_t noise_seed = 0;          // one seed, one picture
  Exposure exposure;
};

class CameraSensor {
 public:
  // Needs spec.model.Problems().empty(). The threads do not change the pictures.
  explicit CameraSensor(const CameraSpec& spec, int threads = 1);

  GrayImage Render(const Scene& scene, const CameraShot& shot) const;

 private:
  void Develop(const float* grey, std::size_t first, const CameraShot& shot, std::uint8_t* pixels) const;

  CameraSpec spec_;
  int threads_;
  RayTable rays_;
  std::vector<float> normals_;  // standard normal deviates that the noise draws from
};

// The shutter: fixed, or following the mean grey level of the pictures it made.
class ExposureControl {
 public:
  explicit ExposureControl(const CameraSpec& spec);
  Exposure Next() const;
  void Observe(const GrayImage& image);

 private:
  CameraSpec spec_;
  double factor_;
};

class LaserSensor {
 public:
  LaserSensor(const LaserSpec& spec, std::uint64_t seed);
  // Beams with nothing within range_max give infinity.
  PlanarScan Scan(const Scene& scene, Timestamp stamp, const Rigid3& T_world_laser);

 private:
  LaserSpec spec_;
  std::mt19937_64 generator_;
};

// Dead reckoning with scale errors and noise; starts at the identity. Wheels roll along the floor: on a slope they
// measure its length, in the robot's own plane. Two driven wheels tell of no way sideways.
class WheelOdometer {
 public:
  WheelOdometer(const OdometrySpec& spec, BaseKind base, std::uint64_t seed);
  // The first call anchors the odometry frame. `slip` is the factor between what wheels and robot do.
  OdometryReading Update(Timestamp stamp, const Rigid3& T_world_base, double slip = 1.0);
  // The robot is somewhere else without its wheels having turned.
  void Carry(const Rigid3& T_world_base) { T_world_base_ = T_world_base; }

 private:
  OdometrySpec spec_;
  BaseKind base_;
  std::mt19937_64 generator_;
  bool anchored_ = false;
  Rigid3 T_world_base_;  // at the last call
  Rigid2 T_odom_base_;   // measured, at the last call
};

// Wobble of the camera's mount: independent, exponentially forgetting rotations about the camera's axes.
class MountShake {
 public:
  MountShake(double standard_deviation, double interval, std::uint64_t seed);  // rad, s between calls
  Eigen::Quaterniond Next();

 private:
  double standard_deviation_;
  double memory_;  // correlation from one call to the next
  Eigen::Vector3d angles_ = Eigen::Vector3d::Zero();
  bool started_ = false;
  std::mt19937_64 generator_;
};

}  // namespace planar_vslam
