#include "planar_vslam/backend/loop_closing.h"

#include <algorithm>
#include <cmath>

#include "stages.h"

namespace planar_vslam {
namespace {

std::vector<LoopTie> LoopTies(const Loop& loop) {
  constexpr double kPosition = 0.01;  // m, how well a recognised view tells where it was taken
  constexpr double kAngle = DegreesToRadians(0.2);
  std::vector<LoopTie> ties;
  for (const LoopView& view : loop.views) {
    ties.push_back({loop.old, view.keyframe, view.T_map_base,
                    Eigen::Vector3d(kPosition, kPosition, kAngle).cwiseAbs2().asDiagonal()});
  }
  return ties;
}

// Steps of the wheels that turned out to be no motion of the robot.
MapEdit DropContradicted(const Map& map, const std::vector<MapTie>& ties) {
  constexpr double kDistance = 0.3;  // m
  constexpr double kAngle = DegreesToRadians(10.0);
  MapEdit edit;
  for (const MapTie& tie : ties) {
    if (!tie.doubtful) continue;
    const KeyframeId id = tie.to;
    const Keyframe& keyframe = map.keyframes.At(id);
    const Rigid2 T_from_map = ProjectToPlane(map.keyframes.At(keyframe.odometry_link->from).T_map_base).Inverse();
    const Eigen::Vector3d e =
        LogSe2(keyframe.odometry_link->motion.T_i_j.Inverse() * T_from_map * ProjectToPlane(keyframe.T_map_base));
    if (e.head<2>().norm() > kDistance || std::abs(e.z()) > kAngle) edit.emplace_back(EraseOdometryLink{id});
  }
  return edit;
}

}  // namespace

MapEdit MoveKeyframes(const Map& map, const std::vector<std::pair<KeyframeId, Rigid3>>& poses) {
  MapEdit edit;
  std::vector<Rigid3> T_new_old(map.next_keyframe_id);
  for (const auto& [id, T_map_base] : poses) {
    T_new_old[id.value] = T_map_base * map.keyframes.At(id).T_map_base.Inverse();
    edit.emplace_back(SetKeyframePose{id, T_map_base});
  }
  for (const auto& [id, landmark] : map.landmarks) {
    const KeyframeId anchor =
        map.keyframes.Contains(landmark.created_by) ? landmark.created_by : landmark.observations.front().keyframe;
    edit.emplace_back(SetLandmarkPosition{id, T_new_old[anchor.value] * landmark.p_map});
  }
  return edit;
}

MapEdit JoinLandmarks(const Map& map, KeyframeId id, const FrameMatches& matches) {
  MapEdit edit;
  const Keyframe& keyframe = map.keyframes.At(id);
  for (std::size_t i = 0; i < matches.landmarks.size(); ++i) {
    const LandmarkId old = matches.landmarks[i], present = keyframe.landmarks[i];
    if (!old.valid() || present == old) continue;
    if (present.valid()) {
      edit.emplace_back(MergeLandmarks{present, old});
    } else {
      edit.emplace_back(AddObservation{old, {id, static_cast<std::uint32_t>(i)}});
    }
  }
  return edit;
}

Expected<BentMap> CloseLoop(Map map, const Loop& loop, const std::vector<MapTie>& ties,
                            const PlanarPriorOptions& planar) {
  const auto poses = SolvePoseGraph(map, ties, LoopTies(loop), planar);
  if (!poses.ok()) return poses.error();
  const MapEdit moved = MoveKeyframes(map, *poses);
  BentMap bent{Apply(std::move(map), moved), {}};
  const auto take = [&bent](const MapEdit& edit) {
    bent.map = Apply(std::move(bent.map), edit);
    bent.structure.insert(bent.structure.end(), edit.begin(), edit.end());
  };
  take(DropContradicted(bent.map, ties));
  for (const LoopView& view : loop.views) take(JoinLandmarks(bent.map, view.keyframe, view.matches));
  return bent;
}

}  // namespace planar_vslam
