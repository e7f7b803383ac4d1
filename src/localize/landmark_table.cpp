#include "planar_vslam/localize/landmark_table.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/feature/hamming.h"

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

// Whether its images differ little from the one that its descriptor is of.
bool IsSteady(const Landmark& landmark, const Map& map) {
  constexpr double kBits = 30.0;  // half of what two landmarks differ by that are not alike
  double sum = 0.0;
  for (const Observation& o : landmark.observations)
    sum += HammingDistance(landmark.descriptor, map.keyframes.At(o.keyframe).features->descriptors[o.keypoint]);
  return sum <= kBits * static_cast<double>(landmark.observations.size() - 1);
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
  std::vector<std::size_t> sectors;
  for (const auto& [id, landmark] : map.landmarks) {
    if (!IsReliable(landmark)) continue;
    const double angle = OrientationOf(landmark, map);
    const auto index = static_cast<int>(landmarks_.size());
    for (std::size_t sector = 0; sector < kSectors; ++sector) {
      if (std::abs(WrapAngle(angle - MiddleOf(sector))) <= kTurned + 0.5 * kSector)
        turned_like_[sector].push_back(index);
    }
    landmarks_.push_back({landmark.p_map, landmark.view_direction, landmark.min_distance, landmark.max_distance,
                          HeadingsOf(landmark, map), IsSteady(landmark, map)});
    sectors.push_back(SectorOf(angle));
    descriptors_.push_back(landmark.descriptor);
  }
  FindUnique(sectors);
  constexpr std::size_t kGroup = 32;
  for (std::size_t begin = 0; begin < landmarks_.size(); begin += kGroup)
    groups_.push_back(GroupOf(landmarks_, begin, std::min(begin + kGroup, landmarks_.size())));
  for (const auto& [id, keyframe] : map.keyframes) driven_.emplace_back(keyframe.T_map_base.translation.head<2>());
}

void LandmarkTable::FindUnique(const std::vector<std::size_t>& sectors) {
  constexpr int kAlike = 60;          // bits: two views of equal things, in other light, differ by as much
  constexpr double kElsewhere = 1.5;  // m: parts of one thing may look alike
  std::vector<int> distances;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const std::vector<int>& others = turned_like_[sectors[i]];
    HammingDistances(descriptors_[i], descriptors_, others, &distances);
    for (std::size_t k = 0; k < others.size() && landmarks_[i].unique; ++k) {
      const TableLandmark& other = landmarks_[static_cast<std::size_t>(others[k])];
      landmarks_[i].unique =
          distances[k] >= kAlike || (other.p_map - landmarks_[i].p_map).squaredNorm() <= kElsewhere * kElsewhere;
    }
  }
}

const std::vector<int>& LandmarkTable::TurnedLike(float angle) const {
  return turned_like_[SectorOf(static_cast<double>(angle))];
}

}  // namespace planar_vslam
