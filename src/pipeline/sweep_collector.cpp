#include "planar_vslam/pipeline/sweep_collector.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace planar_vslam {

bool SweepCollector::IsNew(const Rigid2& T_odom_base) {
  constexpr double kDistance = 0.05;  // m, one cell of the usual grid
  constexpr double kAngle = DegreesToRadians(3.0);
  constexpr int kStanding = 10;  // sweeps kept where the robot stands: enough to clear what walked by
  if (last_kept_.has_value()) {
    const Rigid2 moved = last_kept_->Inverse() * T_odom_base;
    if (moved.translation.norm() < kDistance && std::abs(moved.angle) < kAngle) return ++kept_here_ < kStanding;
  }
  last_kept_ = T_odom_base;
  kept_here_ = 0;
  return true;
}

void SweepCollector::Add(const FramePacket& packet, std::size_t frame) {
  if (!packet.T_odom_base.has_value()) return;
  for (const ScanPacket& scan : packet.scans) {
    const Rigid2 T_odom_base = *packet.T_odom_base * scan.T_frame_base;
    if (!IsNew(T_odom_base)) continue;
    waiting_.push_back(
        {std::make_shared<const PlanarScan>(scan.scan), scan.T_base_laser, scan.T_frame_base, T_odom_base, frame});
  }
}

std::optional<LaserSweep> SweepCollector::TakeLatest(const Rigid2& T_odom_base, Timestamp stamp) {
  constexpr double kRecent = 0.3;  // s; odometry errs by millimetres over it
  if (waiting_.empty() || SecondsBetween(waiting_.back().scan->stamp, stamp) > kRecent) return std::nullopt;
  Waiting latest = std::move(waiting_.back());
  waiting_.pop_back();
  return LaserSweep{std::move(latest.scan), latest.T_base_laser, T_odom_base.Inverse() * latest.T_odom_base};
}

void SweepCollector::DropOnOdometry(const TrajectoryRecorder& trajectory) {
  const auto is_refuted = [&trajectory](const Waiting& sweep) {
    return trajectory.Remembers(sweep.frame) && trajectory.IsOnOdometry(sweep.frame);
  };
  waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), is_refuted), waiting_.end());
}

std::vector<AddSweeps> SweepCollector::Take(const Map& map, const TrajectoryRecorder& trajectory, bool all) {
  if (!map.metric) return {};
  std::map<KeyframeId, std::vector<LaserSweep>> by_keyframe;
  std::vector<Waiting> waiting_on;
  for (Waiting& sweep : waiting_) {
    const std::optional<std::pair<KeyframeId, Rigid3>> anchor = trajectory.Anchor(map, sweep.frame);
    if (!anchor.has_value()) continue;  // waited so long that its frame is forgotten
    if (!all && trajectory.IsOnOdometry(sweep.frame)) {
      waiting_on.push_back(std::move(sweep));
      continue;
    }
    const auto& [keyframe, T_keyframe_frame] = *anchor;
    // Between poses in the plane: the sway of either body is not the laser's.
    const Rigid3& T_map_keyframe = map.keyframes.At(keyframe).T_map_base;
    const Rigid2 T_map_base = ProjectToPlane(T_map_keyframe * T_keyframe_frame) * sweep.T_frame_base;
    by_keyframe[keyframe].push_back(
        {std::move(sweep.scan), sweep.T_base_laser, ProjectToPlane(T_map_keyframe).Inverse() * T_map_base});
  }
  waiting_ = std::move(waiting_on);
  std::vector<AddSweeps> edits;
  for (auto& [keyframe, sweeps] : by_keyframe) edits.push_back({keyframe, std::move(sweeps)});
  return edits;
}

}  // namespace planar_vslam
