#include "planar_vslam/map/queries.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/median.h"

namespace planar_vslam {
namespace {

// Through one bit an id between the smallest and the largest: there are many times more ids than different ones.
std::vector<LandmarkId> SortedUnique(const std::vector<LandmarkId>& ids) {
  if (ids.empty()) return {};
  const auto [least, most] = std::minmax_element(ids.begin(), ids.end());
  constexpr std::uint32_t kBits = 64;
  const std::uint32_t first = least->value;
  std::vector<std::uint64_t> words((most->value - first) / kBits + 1, 0);
  for (const LandmarkId id : ids) words[(id.value - first) / kBits] |= std::uint64_t{1} << ((id.value - first) % kBits);
  std::vector<LandmarkId> sorted;
  for (std::size_t w = 0; w < words.size(); ++w) {
    for (std::uint64_t word = words[w]; word != 0; word &= word - 1) {
      const auto bit = static_cast<std::uint32_t>(__builtin_ctzll(word));
      sorted.push_back(LandmarkId{first + static_cast<std::uint32_t>(w) * kBits + bit});
    }
  }
  return sorted;
}

}  // namespace

std::vector<LandmarkId> ValidOnly(const std::vector<LandmarkId>& ids) {
  std::vector<LandmarkId> valid;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(valid), [](LandmarkId id) { return id.valid(); });
  return valid;
}

std::vector<LandmarkId> LandmarksOf(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::size_t most = 0;
  for (const KeyframeId keyframe : keyframes) most += map.keyframes.At(keyframe).landmarks.size();
  std::vector<LandmarkId> ids(most);
  std::size_t count = 0;
  for (const KeyframeId keyframe : keyframes) {
    for (const LandmarkId id : map.keyframes.At(keyframe).landmarks) {  // without a branch that nothing predicts
      ids[count] = id;
      count += id.valid() ? 1 : 0;
    }
  }
  ids.resize(count);
  return SortedUnique(ids);
}

int CountObserved(const Map& map, const std::vector<LandmarkId>& ids, std::size_t keyframes) {
  return static_cast<int>(std::count_if(ids.begin(), ids.end(), [&map, keyframes](LandmarkId id) {
    const Landmark* landmark = id.valid() ? map.landmarks.Find(id) : nullptr;
    return landmark != nullptr && landmark->observations.size() >= keyframes;
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

namespace {

// Those within `distance`, with their distances, nearest first.
std::vector<std::pair<double, KeyframeId>> Within(const Map& map, const Rigid3& T_map_camera, double distance,
                                                  double angle) {
  std::vector<std::pair<double, KeyframeId>> near;
  const Eigen::Vector3d axis = T_map_camera.rotation * Eigen::Vector3d::UnitZ();
  for (const KeyframeId id : map.cameras.Around(T_map_camera.translation, distance)) {
    const Rigid3 T = map.keyframes.At(id).T_map_camera();
    const double d = (T.translation - T_map_camera.translation).norm();
    if (d <= distance && axis.dot(T.rotation * Eigen::Vector3d::UnitZ()) >= std::cos(angle)) near.emplace_back(d, id);
  }
  std::sort(near.begin(), near.end());
  return near;
}

}  // namespace

std::vector<KeyframeId> NearbyKeyframes(const Map& map, const Rigid3& T_map_camera, double distance, double angle,
                                        std::size_t limit) {
  // Where many stand close by there is no need to look further.
  double reach = limit < map.keyframes.size() ? distance / 8.0 : distance;
  std::vector<std::pair<double, KeyframeId>> near = Within(map, T_map_camera, reach, angle);
  while (reach < distance && near.size() < limit) {
    reach = std::min(2.0 * reach, distance);
    near = Within(map, T_map_camera, reach, angle);
  }
  if (near.size() > limit) near.resize(limit);
  std::vector<KeyframeId> ids;
  ids.reserve(near.size());
  for (const auto& [d, id] : near) ids.push_back(id);
  return ids;
}

}  // namespace planar_vslam
