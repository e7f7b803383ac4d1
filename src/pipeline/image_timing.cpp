#include "planar_vslam/pipeline/image_timing.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "planar_vslam/feature/rolling_shutter.h"
#include "planar_vslam/optimize/reprojection_factor.h"

namespace planar_vslam {
namespace {

Eigen::Vector3d UpInCamera(const Rigid3& T_base_camera) {
  return T_base_camera.rotation.inverse() * Eigen::Vector3d::UnitZ();
}

// Of one frame, what is left of [g_1 g_2] and e where the pose is eliminated.
struct Sums {
  Matrix6d JJ = Matrix6d::Zero();
  Eigen::Matrix<double, 6, 2> Jg = Eigen::Matrix<double, 6, 2>::Zero();
  Vector6d Je = Vector6d::Zero();
  Eigen::Matrix2d gg = Eigen::Matrix2d::Zero();
  Eigen::Vector2d ge = Eigen::Vector2d::Zero();

  void Add(const Eigen::Matrix<double, 2, 6>& J, const Eigen::Matrix2d& g, const Eigen::Vector2d& e, double weight) {
    JJ += weight * J.transpose() * J;
    Jg += weight * J.transpose() * g;
    Je += weight * J.transpose() * e;
    gg += weight * g.transpose() * g;
    ge += weight * g.transpose() * e;
  }
};

}  // namespace

std::optional<Eigen::Vector3d> VelocityAt(const FramePacket& packet) {
  constexpr double kSpan = 0.04;  // s, over several readings: one alone is noisy
  if (packet.odometry.size() < 2) return std::nullopt;
  const OdometryReading& last = packet.odometry.back();
  auto before = std::prev(packet.odometry.end());
  while (before != packet.odometry.begin() && SecondsBetween(before->stamp, last.stamp) < kSpan) --before;
  const double seconds = SecondsBetween(before->stamp, last.stamp);
  if (seconds <= 0.0) return std::nullopt;
  return Eigen::Vector3d(LogSe2(before->T_odom_base.Inverse() * last.T_odom_base) / seconds);
}

ImageMoment MomentOf(const FramePacket& packet) {
  return {VelocityAt(packet).value_or(Eigen::Vector3d::Zero()), packet.image_offset.value};
}

FrameFeaturesPtr ImageTiming::Straightened(FrameFeaturesPtr features, const FramePacket& packet) const {
  if (options_.readout == 0.0) return features;
  const std::optional<Eigen::Vector3d> velocity = VelocityAt(packet);
  if (!velocity.has_value()) return features;
  const Eigen::Vector3d turn = velocity->z() * UpInCamera(packet.T_base_camera);
  return std::make_shared<const FrameFeatures>(WithoutRolling(*features, camera_, turn, options_.readout));
}

void ImageTiming::Watch(const FramePacket& packet, const FrameFeatures& features, const TrackResult& track,
                        const Map& map) {
  constexpr double kStill = 1e-3;  // rad, of the camera on the base between two images
  constexpr int kFewest = 30;      // landmarks
  const Rigid3 mount = Embed3(packet.T_base_exposed.Inverse()) * packet.T_base_camera;
  const std::optional<Rigid3> T_base_camera = std::exchange(T_base_camera_, mount);
  const std::optional<Eigen::Vector3d> velocity = VelocityAt(packet);
  if (!velocity.has_value() || !T_base_camera.has_value()) return;
  if (LogSo3(T_base_camera->rotation.inverse() * mount.rotation).norm() > kStill) return;
  if (track.odometry_rejected) return;  // the wheels do not tell how it turns
  if (track.wants_keyframe) rates_.emplace(packet.image.stamp, velocity->z());
  if (rates_.empty()) return;
  Prune(map);
  const Eigen::Vector3d up = UpInCamera(packet.T_base_camera);
  const Rigid3 T_camera_map = (track.T_map_base * packet.T_base_camera).Inverse();
  Sums sums;
  int count = 0;
  for (std::size_t i = 0; i < track.matches.landmarks.size(); ++i) {
    const Landmark* landmark = map.landmarks.Find(track.matches.landmarks[i]);
    if (landmark == nullptr) continue;
    const std::optional<double> rate = RateOf(*landmark, map);
    const Eigen::Vector3d p = T_camera_map * landmark->p_map;
    if (!rate.has_value() || p.z() < kMinDepth) continue;
    ++count;
    const Keypoint& keypoint = features.keypoints[i];
    const Eigen::Matrix<double, 2, 3> J_point = ProjectionJacobian(camera_, p);
    Eigen::Matrix<double, 2, 6> J;
    J << J_point, -J_point * Skew(p);
    const double below = static_cast<double>(keypoint.raw_pixel.y()) / camera_.height - 0.5;
    const Eigen::Vector2d k = -below * J_point * up.cross(p);
    const double scale = map.octave_scales[static_cast<std::size_t>(keypoint.octave)];
    sums.Add(J, k * Eigen::RowVector2d(velocity->z() - *rate, 1.0),
             keypoint.pixel.cast<double>() - camera_.ProjectUndistorted(p), 1.0 / (scale * scale));
  }
  if (count < kFewest) return;
  const Eigen::LDLT<Matrix6d> pose(sums.JJ);
  Add(sums.gg - sums.Jg.transpose() * pose.solve(sums.Jg), sums.ge - sums.Jg.transpose() * pose.solve(sums.Je));
}

std::optional<double> ImageTiming::RateOf(const Landmark& landmark, const Map& map) const {
  double sum = 0.0;
  int count = 0;
  for (const Observation& o : landmark.observations) {
    const auto rate = rates_.find(map.keyframes.At(o.keyframe).stamp);
    if (rate == rates_.end()) continue;
    sum += rate->second;
    ++count;
  }
  return count > 0 ? std::optional<double>(sum / count) : std::nullopt;
}

void ImageTiming::Prune(const Map& map) {
  constexpr std::size_t kSpare = 100;
  if (rates_.size() < 2 * map.keyframes.size() + kSpare) return;
  std::map<Timestamp, double> kept;
  for (const auto& [id, keyframe] : map.keyframes) {
    const auto rate = rates_.find(keyframe.stamp);
    if (rate != rates_.end()) kept.insert(*rate);
  }
  rates_ = std::move(kept);
}

void ImageTiming::Add(const Eigen::Matrix2d& information, const Eigen::Vector2d& gradient) {
  constexpr int kFrames = 10;
  block_ += (Block() << gradient, information(0, 0), information(0, 1), information(1, 1)).finished();
  if (++frames_ < kFrames) return;
  sum_ += block_;
  squares_ += block_ * block_.transpose();
  block_.setZero();
  frames_ = 0;
}

std::optional<Deviation> ImageTiming::MissedReadout() const {
  constexpr double kFewest = 8.0;  // blocks in which the robot turned, weighed by how much
  const Eigen::Matrix2d information = (Eigen::Matrix2d() << sum_[2], sum_[3], sum_[3], sum_[4]).finished();
  if (sum_[2] * sum_[2] < kFewest * squares_(2, 2) || !(information.determinant() > 0.0)) return std::nullopt;
  const Eigen::Matrix2d covariance = information.inverse();
  const Eigen::Vector2d x = covariance * sum_.head<2>();
  // How a block moves r: covariance.row(0) (g - I x), linear in the block.
  const Eigen::Vector2d c = covariance.row(0);
  const Block influence = (Block() << c[0], c[1], -c[0] * x[0], -c[0] * x[1] - c[1] * x[0], -c[1] * x[1]).finished();
  return Deviation{x[0], std::sqrt(influence.dot(squares_ * influence))};
}

Eigen::Matrix3d ImageTiming::ClockCovariance(const FramePacket& packet) const {
  const std::optional<Eigen::Vector3d> velocity = VelocityAt(packet);
  if (!velocity.has_value()) return Eigen::Matrix3d::Zero();
  return packet.image_offset.sigma * packet.image_offset.sigma * *velocity * velocity->transpose();
}

}  // namespace planar_vslam
