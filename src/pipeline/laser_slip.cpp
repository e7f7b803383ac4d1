#include "planar_vslam/pipeline/laser_slip.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

PreparedScan Prepared(const ScanPacket& sweep, const ScanMatchOptions& options) {
  return PrepareScan(sweep.scan, Embed3(sweep.T_frame_base) * sweep.T_base_laser, options);
}

// The last sweep before the image; null where it is too old for the wheels to lead from it to the image.
const ScanPacket* Latest(const FramePacket& packet) {
  constexpr double kOldest = 0.15;  // s
  if (packet.scans.empty()) return nullptr;
  const ScanPacket& latest = packet.scans.back();
  return SecondsBetween(latest.scan.stamp, packet.image.stamp) > kOldest ? nullptr : &latest;
}

// The step as wheels and match say, where they contradict each other.
std::optional<PlanarMotion> Fused(PlanarMotion step, const ScanMatch& match, const MotionFloor& floor) {
  constexpr double kChiSquare = 16.3;
  const Rigid2& T = match.T_reference_current;
  Eigen::Vector3d off;
  off << T.translation - step.T_i_j.translation, WrapAngle(T.angle - step.T_i_j.angle);
  const Eigen::Matrix3d of_match = CovarianceWithFloor(MotionOf(match, step.seconds), floor);
  if (off.dot((step.covariance + of_match).llt().solve(off)) < kChiSquare) return std::nullopt;
  step.covariance += off * off.transpose();
  const Eigen::Matrix3d gain = step.covariance * (step.covariance + of_match).inverse();
  const Eigen::Vector3d moved = gain * off;
  step.T_i_j.translation += moved.head<2>();
  step.T_i_j.angle = WrapAngle(step.T_i_j.angle + moved.z());
  const Eigen::Matrix3d left = (Eigen::Matrix3d::Identity() - gain) * step.covariance;
  step.covariance = 0.5 * (left + left.transpose());
  step.distance = std::max(step.distance, step.T_i_j.translation.norm());
  step.turn = std::max(step.turn, std::abs(step.T_i_j.angle));
  return step;
}

}  // namespace

std::optional<PlanarMotion> LaserSlip::Check(const FramePacket& packet, const PlanarMotion& step, bool blind) {
  if (!options_.enabled) return std::nullopt;
  const ScanPacket* now = Latest(packet);
  const bool goes_on = frame_.has_value() && !packet.odometry.empty() && *frame_ == packet.odometry.front().stamp;
  std::optional<PlanarMotion> slipped;
  if (blind && goes_on && now != nullptr) {
    const std::optional<ScanMatch> match =
        MatchScans(Prepared(last_, options_), Prepared(*now, options_), step.T_i_j, options_);
    if (match.has_value()) slipped = Fused(step, *match, options_.floor);
  }
  frame_.reset();
  if (now != nullptr) {
    last_ = *now;  // keeps the memory of its ranges
    frame_ = packet.image.stamp;
  }
  return slipped;
}

}  // namespace planar_vslam
