#include "planar_vslam/planar/floor_monitor.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/planar/planar_prior.h"

namespace planar_vslam {
namespace {

// Fitted. 7 sigma: 3.5 degrees or 7 cm within a metre at the default sigmas.
constexpr double kReleaseChangeSquared = 49.0;
// Fitted. 11 sigma: 11 cm or 5.5 degrees at the default sigmas, an empirical limit between the bends of maps on flat
// floors and a street, see BENCHMARK.md.
constexpr double kReleaseSquared = 121.0;
constexpr int kReleaseAfter = 3;
constexpr int kResumeAfter = 5;
// Sigmas of the height, so that what counts as back on the floor is not beyond what releases it.
const double kMostDrift = 0.8 * std::sqrt(kReleaseSquared / kChi2ThreeDof90);
constexpr double kSpan = 1.0;  // m: a ramp has tilted the robot by then, drift of a map has not

}  // namespace

double FloorReading::SquaredDistance() const { return error.dot(covariance.ldlt().solve(error)); }

FloorReading ReadFloor(Timestamp stamp, const Rigid3& T_map_base, const Matrix6d& covariance, double sigma_height,
                       double sigma_tilt) {
  Eigen::Matrix<double, 3, 6> J;
  const Eigen::Vector3d whitened = PlanarPriorResidual(T_map_base, {sigma_height, sigma_tilt}, &J);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  // of the tilt, from the base's heading to the map's axes
  turn.bottomRightCorner<2, 2>() = ProjectToPlane(T_map_base).R();
  FloorReading reading;
  reading.stamp = stamp;
  reading.error = turn * whitened;
  // Residual and Jacobian are divided by the prior's sigmas, so the prior's own covariance is the identity.
  reading.covariance = turn * (J * covariance * J.transpose() + Eigen::Matrix3d::Identity()) * turn.transpose();
  reading.place = T_map_base.translation.head<2>();
  reading.drift = sigma_tilt / sigma_height;
  return reading;
}

double FloorMonitor::WayTo(const FloorReading& reading) const {
  return way_.empty() ? 0.0 : way_.back().way + (reading.place - way_.back().reading.place).norm();
}

double FloorMonitor::ChangeSquared(const FloorReading& reading) const {
  const double now = WayTo(reading);
  const auto before = std::find_if(way_.rbegin(), way_.rend(), [now](const Step& s) { return now - s.way >= kSpan; });
  FloorReading change = reading;
  if (before != way_.rend()) {  // else it began on the floor
    change.error -= before->reading.error;
    change.covariance += before->reading.covariance;
  }
  return change.SquaredDistance();
}

bool FloorMonitor::Returns(FloorReading reading) {
  const Eigen::Vector2d tilt = reading.error.tail<2>();
  const bool level = tilt.dot(reading.covariance.bottomRightCorner<2, 2>().ldlt().solve(tilt)) < kChi2TwoDof95;
  if (!level) sloped_ += WayTo(reading) - way_.back().way;
  const double drift = std::min(reading.drift * sloped_, kMostDrift);
  reading.covariance(0, 0) += drift * drift;
  return reading.SquaredDistance() < kChi2ThreeDof90;
}

std::optional<Timestamp> FloorMonitor::Add(const FloorReading& reading) {
  const auto leaves = [&] {
    return reading.SquaredDistance() > kReleaseSquared || ChangeSquared(reading) > kReleaseChangeSquared;
  };
  const bool against = on_floor_ ? leaves() : Returns(reading);
  streak_ = against ? streak_ + 1 : 0;
  const bool changes = streak_ >= (on_floor_ ? kReleaseAfter : kResumeAfter);
  way_.push_back({reading, WayTo(reading)});
  while (way_.size() > 2 && way_.back().way - way_[1].way >= kSpan) way_.pop_front();
  if (!changes) return std::nullopt;
  on_floor_ = !on_floor_;
  streak_ = 0;
  if (on_floor_) return std::nullopt;
  sloped_ = way_.back().way - way_.front().way;
  return way_.front().reading.stamp;
}

}  // namespace planar_vslam
