#include "planar_vslam/localize/landmark_table.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr std::size_t kObservations = 3;            // fewer tell of a point that is rarely detected, or placed badly
constexpr double kFound = 0.3;                      // of the images that should have shown it
constexpr double kTurned = DegreesToRadians(20.0);  // of two views of one point by a camera that does not roll

bool IsReliable(const Landmark& landmark) {
  return landmark.observations.size() >= kObservations && landmark.found >= kFound * landmark.predicted_visible;
}

// The orientation of the observation that the descriptor is of.
double OrientationOf(const Landmark& landmark, const Map& map) {
  for (const Observation& o : landmark.observations) {
    const FrameFeatures& features = *map.keyframes.At(o.keyframe).features;
    if (features.descriptors[o.keypoint] == landmark.descriptor)
      return static_cast<double>(features.keypoints[o.keypoint].angle);
  }
  return 0.0;
}

constexpr double kSector = 2.0 * M_PI / static_cast<double>(LandmarkTable::kSectors);

double MiddleOf(std::size_t sector) { return (static_cast<double>(sector) + 0.5) * kSector; }

std::uint32_t HeadingsOf(const Landmark& landmark, const Map& map) {
  constexpr double kReach = DegreesToRadians(60.0);
  std::uint32_t headings = 0;
  for (const Observation& o : landmark.observations) {
    const Eigen::Vector3d axis = map.keyframes.At(o.keyframe).T_map_camera().rotation * Eigen::Vector3d::UnitZ();
    const double heading = std::atan2(axis.y(), axis.x());
    for (std::size_t sector = 0; sector < LandmarkTable::kSectors; ++sector)
      if (std::abs(WrapAngle(heading - MiddleOf(sector))) <= kReach) headings |= 1U << sector;
  }
  return headings;
}

LandmarkGroup GroupOf(const std::vector<TableLandmark>& landmarks, std::size_t begin, std::size_t end) {
  LandmarkGroup group{begin, end};
  Eigen::Vector3d least = landmarks[begin].p_map, most = least;
  for (std::size_t i = begin; i < end; ++i) {
    least = least.cwiseMin(landmarks[i].p_map);
    most = most.cwiseMax(landmarks[i].p_map);
    group.max_distance = std::max(group.max_distance, landmarks[i].max_distance);
    group.headings |= landmarks[i].headings;
  }
  group.center = 0.5 * (least + most);
  group.radius = 0.5 * (most - least).norm();
  return group;
}

}  // namespace

std::size_t LandmarkTable::SectorOf(double angle) {
  const double turns = angle / (2.0 * M_PI);
  const auto sector = static_cast<std::size_t>((turns - std::floor(turns)) * static_cast<double>(kSectors));
  return std::min(sector, kSectors - 1);
}

LandmarkTable::LandmarkTable(const Map& map) : octave_scales_(map.octave_scales) {
  for (const auto& [id, landmark] : map.landmarks) {
    if (!IsReliable(landmark)) continue;
    const double angle = OrientationOf(landmark, map);
    const auto index = static_cast<int>(landmarks_.size());
    for (std::size_t sector = 0; sector < kSectors; ++sector) {
      if (std::abs(WrapAngle(angle - MiddleOf(sector))) <= kTurned + 0.5 * kSector)
        turned_like_[sector].push_back(index);
    }
    landmarks_.push_back({landmark.p_map, landmark.view_direction, landmark.min_distance, landmark.max_distance,
                          HeadingsOf(landmark, map)});
    descriptors_.push_back(landmark.descriptor);
  }
  constexpr std::size_t kGroup = 32;
  for (std::size_t begin = 0; begin < landmarks_.size(); begin += kGroup)
    groups_.push_back(GroupOf(landmarks_, begin, std::min(begin + kGroup, landmarks_.size())));
  for (const auto& [id, keyframe] : map.keyframes) driven_.emplace_back(keyframe.T_map_base.translation.head<2>());
}

const std::vector<int>& LandmarkTable::TurnedLike(float angle) const {
  return turned_like_[SectorOf(static_cast<double>(angle))];
}

}  // namespace planar_vslam
