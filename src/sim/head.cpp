#include "planar_vslam/sim/head.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kStep = 0.005;  // s between stored joint angles

}  // namespace

Eigen::Vector2d WantedPanTilt(const HeadSpec& spec, double time) {
  const std::vector<HeadPose>& poses = spec.motion;
  if (poses.empty()) return Eigen::Vector2d::Zero();
  const double t = spec.period > 0.0 ? std::fmod(time, spec.period) : time;
  const auto next = std::find_if(poses.begin(), poses.end(), [t](const HeadPose& pose) { return pose.time > t; });
  if (next == poses.begin()) return {poses.front().pan, poses.front().tilt};
  if (next == poses.end()) return {poses.back().pan, poses.back().tilt};
  const HeadPose& last = *(next - 1);
  const double s = (t - last.time) / (next->time - last.time);
  const double share = s * s * (3.0 - 2.0 * s);  // at rest on both ends
  return {last.pan + share * (next->pan - last.pan), last.tilt + share * (next->tilt - last.tilt)};
}

Head::Head(const HeadSpec& spec, const CameraSpec& camera) : spec_(spec), T_base_camera_(camera.T_base_camera()) {
  if (spec.motion.empty() || spec.backlash == 0.0) return;
  // Play: the joint stays where it is until a flank of the gear pushes it on.
  const double play = 0.5 * spec.backlash;
  const double duration = spec.period > 0.0 ? 2.0 * spec.period : spec.motion.back().time;
  Eigen::Vector2d angles = WantedPanTilt(spec, 0.0);
  for (int i = 0; i * kStep <= duration + kStep; ++i) {
    const Eigen::Vector2d wanted = WantedPanTilt(spec, i * kStep);
    angles =
        angles.cwiseMax(wanted - Eigen::Vector2d::Constant(play)).cwiseMin(wanted + Eigen::Vector2d::Constant(play));
    true_.push_back(angles);
  }
}

Rigid3 Head::ReportedCamera(double time) const { return CameraAt(WantedPanTilt(spec_, std::max(time, 0.0))); }

Rigid3 Head::TrueCamera(double time) const {
  if (true_.empty()) return ReportedCamera(time);
  // Play settles within the first period.
  const bool repeats = spec_.period > 0.0 && time > 2.0 * spec_.period;
  const double known = repeats ? spec_.period + std::fmod(time, spec_.period) : time;
  const double position = std::clamp(known / kStep, 0.0, static_cast<double>(true_.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(position), true_.size() - 1);
  const std::size_t next = std::min(i + 1, true_.size() - 1);
  return CameraAt(true_[i] + (position - static_cast<double>(i)) * (true_[next] - true_[i]));
}

Rigid3 Head::CameraAt(const Eigen::Vector2d& pan_tilt) const {
  if (pan_tilt.isZero(0.0)) return T_base_camera_;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(pan_tilt[0], Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(pan_tilt[1], Eigen::Vector3d::UnitY()));
  const Rigid3 T_base_neck(Eigen::Quaterniond::Identity(), spec_.neck);
  return T_base_neck * Rigid3(turn, Eigen::Vector3d::Zero()) * T_base_neck.Inverse() * T_base_camera_;
}

}  // namespace planar_vslam
