#include "planar_vslam/pipeline/laser_slip.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace planar_vslam {
namespace {

PreparedScan Prepared(const ScanPacket& sweep, const ScanMatchOptions& options) {
  return PrepareScan(sweep.scan, Embed3(sweep.T_frame_base) * sweep.T_base_laser, options);
}

// Of [x, y, angle] in the frame of the reference.
Eigen::Matrix3d CovarianceOf(const ScanMatch& match, const MotionFloor& floor) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = match.T_reference_current.R();
  PlanarMotion motion;
  motion.covariance = B * match.covariance * B.transpose();
  return CovarianceWithFloor(motion, floor);
}

}  // namespace

std::optional<ScanPacket> LaserSlip::Latest(const FramePacket& packet) const {
  constexpr double kOldest = 0.15;  // s before the image: the wheels lead from the sweep to it
  if (packet.scans.empty()) return std::nullopt;
  if (SecondsBetween(packet.scans.back().scan.stamp, packet.image.stamp) > kOldest) return std::nullopt;
  return packet.scans.back();
}

std::optional<PlanarMotion> LaserSlip::Check(const FramePacket& packet, const PlanarMotion& step, bool blind) {
  constexpr double kChiSquare = 16.3;
  if (!options_.enabled) return std::nullopt;
  std::optional<ScanPacket> now = Latest(packet);
  const std::optional<ScanPacket> before = std::exchange(last_, now);
  if (!blind || !before.has_value() || !now.has_value()) return std::nullopt;
  const std::optional<ScanMatch> match =
      MatchScans(Prepared(*before, options_), Prepared(*now, options_), step.T_i_j, options_);
  if (!match.has_value()) return std::nullopt;
  const Rigid2& T = match->T_reference_current;
  Eigen::Vector3d off;
  off << T.translation - step.T_i_j.translation, WrapAngle(T.angle - step.T_i_j.angle);
  const Eigen::Matrix3d of_match = CovarianceOf(*match, options_.floor);
  if (off.dot((step.covariance + of_match).llt().solve(off)) < kChiSquare) return std::nullopt;
  PlanarMotion slipped = step;
  slipped.covariance += off * off.transpose();
  const Eigen::Matrix3d gain = slipped.covariance * (slipped.covariance + of_match).inverse();
  const Eigen::Vector3d moved = gain * off;
  slipped.T_i_j.translation += moved.head<2>();
  slipped.T_i_j.angle = WrapAngle(slipped.T_i_j.angle + moved.z());
  const Eigen::Matrix3d left = (Eigen::Matrix3d::Identity() - gain) * slipped.covariance;
  slipped.covariance = 0.5 * (left + left.transpose());
  slipped.distance = std::max(slipped.distance, slipped.T_i_j.translation.norm());
  slipped.turn = std::max(slipped.turn, std::abs(slipped.T_i_j.angle));
  return slipped;
}

}  // namespace planar_vslam
