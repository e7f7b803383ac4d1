#include "planar_vslam/map/queries.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/median.h"

namespace planar_vslam {

std::vector<LandmarkId> ValidOnly(const std::vector<LandmarkId>& ids) {
  std::vector<LandmarkId> valid;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(valid), [](LandmarkId id) { return id.valid(); });
  return valid;
}

std::vector<LandmarkId> LandmarksOf(const Map& map, const std::vector<KeyframeId>& keyframes) {
  // A bit an id: cheaper than sorting, for many keyframes see the same.
  std::vector<std::uint64_t> seen(map.next_landmark_id / 64 + 1, 0);
  for (const KeyframeId keyframe : keyframes) {
    for (const LandmarkId id : map.keyframes.At(keyframe).landmarks) {
      if (id.valid()) seen[id.value / 64] |= std::uint64_t{1} << (id.value % 64);
    }
  }
  std::vector<LandmarkId> ids;
  for (std::size_t word = 0; word < seen.size(); ++word) {
    for (std::uint64_t bits = seen[word]; bits != 0; bits &= bits - 1) {
      ids.push_back(
          LandmarkId{static_cast<std::uint32_t>(64 * word) + static_cast<std::uint32_t>(__builtin_ctzll(bits))});
    }
  }
  return ids;
}

int CountWellObserved(const Map& map, const std::vector<LandmarkId>& ids) {
  constexpr std::size_t kWellObserved = 2;
  return static_cast<int>(std::count_if(ids.begin(), ids.end(), [&map](LandmarkId id) {
    const Landmark* landmark = id.valid() ? map.landmarks.Find(id) : nullptr;
    return landmark != nullptr && landmark->observations.size() >= kWellObserved;
  }));
}

double MedianDepth(const Map& map, const std::vector<LandmarkId>& ids, const Rigid3& T_map_camera) {
  const Rigid3 T_camera_map = T_map_camera.Inverse();
  std::vector<double> depths;
  for (const LandmarkId id : ids) {
    const Landmark* landmark = id.valid() ? map.landmarks.Find(id) : nullptr;
    if (landmark != nullptr) depths.push_back((T_camera_map * landmark->p_map).z());
  }
  return Median(std::move(depths));
}

std::vector<KeyframeId> MostVoted(const std::vector<int>& votes, std::size_t limit) {
  std::vector<KeyframeId> keyframes;
  for (std::uint32_t i = 0; i < votes.size(); ++i) {
    if (votes[i] > 0) keyframes.push_back(KeyframeId{i});
  }
  std::stable_sort(keyframes.begin(), keyframes.end(),
                   [&votes](KeyframeId a, KeyframeId b) { return votes[a.value] > votes[b.value]; });
  if (keyframes.size() > limit) keyframes.resize(limit);
  return keyframes;
}

std::vector<KeyframeId> VotedKeyframes(const Map& map, const std::vector<LandmarkId>& landmarks, std::size_t limit) {
  std::vector<int> votes(map.next_keyframe_id, 0);
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.landmarks.Find(id);
    if (landmark == nullptr) continue;
    for (const Observation& o : landmark->observations) ++votes[o.keyframe.value];
  }
  return MostVoted(votes, limit);
}

std::vector<KeyframeId> NearbyKeyframes(const Map& map, const Rigid3& T_map_camera, double distance, double angle,
                                        std::size_t limit) {
  std::vector<std::pair<double, KeyframeId>> near;
  const Eigen::Vector3d axis = T_map_camera.rotation * Eigen::Vector3d::UnitZ();
  for (const KeyframeId id : map.cameras.Around(T_map_camera.translation, distance)) {
    const Rigid3 T = map.keyframes.At(id).T_map_camera();
    const double d = (T.translation - T_map_camera.translation).norm();
    if (d <= distance && axis.dot(T.rotation * Eigen::Vector3d::UnitZ()) >= std::cos(angle)) near.emplace_back(d, id);
  }
  std::sort(near.begin(), near.end());
  if (near.size() > limit) near.resize(limit);
  std::vector<KeyframeId> ids;
  ids.reserve(near.size());
  for (const auto& [d, id] : near) ids.push_back(id);
  return ids;
}

}  // namespace planar_vslam
