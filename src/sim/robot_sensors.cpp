// Laser, wheel odometry and the shaking camera mount.
#include <cmath>
#include <limits>

#include "planar_vslam/sim/random.h"
#include "planar_vslam/sim/sensors.h"

namespace planar_vslam {

LaserSensor::LaserSensor(const LaserSpec& spec, std::uint64_t seed)
    : spec_(spec), generator_(MixSeed(seed, RandomStream::kLaser)) {}

PlanarScan LaserSensor::Scan(const Scene& scene, Timestamp stamp, const Rigid3& T_world_laser) {
  constexpr double kRangeMin = 0.02;  // m
  PlanarScan scan{stamp, spec_.angle_min(), spec_.angle_increment(), kRangeMin, spec_.range_max, {}};
  std::normal_distribution<double> normal;
  for (int beam = 0; beam < spec_.beams; ++beam) {
    const double angle = scan.angle_min + beam * scan.angle_increment;
    // The draw is made for silent beams, too: a beam's noise does not depend on what the others meet.
    const double noise = spec_.noise * normal(generator_);
    const Eigen::Vector3d direction = T_world_laser.rotation * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    const double range = spec_.Looks(angle) ? scene.Range(T_world_laser.translation, direction, spec_.range_max)
                                            : std::numeric_limits<double>::infinity();
    const double measured = range + noise;
    const bool seen = measured < spec_.range_max;
    scan.ranges.push_back(seen ? static_cast<float>(std::max(measured, kRangeMin))
                               : std::numeric_limits<float>::infinity());
  }
  return scan;
}

WheelOdometer::WheelOdometer(const OdometrySpec& spec, BaseKind base, std::uint64_t seed)
    : spec_(spec), base_(base), generator_(MixSeed(seed, RandomStream::kOdometry)) {}

OdometryReading WheelOdometer::Update(Timestamp stamp, const Rigid3& T_world_base, double slip) {
  if (anchored_) {
    const Vector6d moved = slip * LogSe3(T_world_base_.Inverse() * T_world_base);
    const Eigen::Vector3d twist(moved[0], moved[1], moved[5]);
    const double distance = twist.head<2>().norm(), rotation = std::abs(twist.z());
    std::normal_distribution<double> normal;
    const double translation_noise = spec_.translation_noise * std::sqrt(distance);
    const double rotation_noise = spec_.rotation_noise * std::sqrt(distance + rotation);
    const double x = spec_.scale * twist.x() + translation_noise * normal(generator_);
    const double sideways = spec_.scale * twist.y() + translation_noise * normal(generator_);
    const double y = base_ == BaseKind::kOmnidirectional ? sideways : 0.0;
    const double yaw = spec_.yaw_scale * twist.z() + rotation_noise * normal(generator_);
    T_odom_base_ = T_odom_base_ * ExpSe2({x, y, yaw});
  }
  anchored_ = true;
  T_world_base_ = T_world_base;
  return {stamp, T_odom_base_};
}

MountShake::MountShake(double standard_deviation, double interval, std::uint64_t seed)
    : standard_deviation_(standard_deviation), generator_(MixSeed(seed, RandomStream::kCameraShake)) {
  constexpr double kMemory = 0.3;  // s, after which a deflection is down to 1 / e
  memory_ = std::exp(-interval / kMemory);
}

Eigen::Quaterniond MountShake::Next() {
  std::normal_distribution<double> normal(0.0, standard_deviation_ > 0.0 ? standard_deviation_ : 1.0);
  const double keep = started_ ? memory_ : 0.0;
  for (double& angle : angles_) angle = keep * angle + std::sqrt(1.0 - keep * keep) * normal(generator_);
  started_ = true;
  return standard_deviation_ > 0.0 ? ExpSo3(angles_) : Eigen::Quaterniond::Identity();
}

}  // namespace planar_vslam
