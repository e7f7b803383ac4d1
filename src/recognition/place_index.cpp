#include "planar_vslam/recognition/place_index.h"

#include <algorithm>
#include <utility>

#include "planar_vslam/feature/matching.h"
#include "planar_vslam/map/queries.h"
#include "planar_vslam/recognition/place_limits.h"

namespace planar_vslam {

PlaceIndex::PlaceIndex(const Map& map, const std::vector<LandmarkId>& among) {
  for (const LandmarkId id : among) Append(id, map.landmarks.At(id));
}

void PlaceIndex::Update(const Map& map) {
  auto landmark = map.landmarks.begin();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < landmarks_.size() && landmark != map.landmarks.end(); ++i) {
    if (landmark->first < landmarks_[i]) break;     // a map grows at its end: this is another one
    if (landmark->first > landmarks_[i]) continue;  // entry i is gone
    if (kept != i) {
      landmarks_[kept] = landmarks_[i];
      std::swap(seen_by_[kept], seen_by_[i]);
    }
    Refresh(kept++, landmark->second);
    ++landmark;
  }
  landmarks_.resize(kept);
  descriptors_.resize(kept);
  seen_by_.resize(kept);
  for (; landmark != map.landmarks.end(); ++landmark) Append(landmark->first, landmark->second);
}

std::vector<KeyframeId> PlaceIndex::Resembling(const FrameFeatures& features, std::size_t limit) const {
  if (landmarks_.empty()) return {};
  std::vector<int> votes;  // by keyframe id
  for (const NearestDescriptor& nearest : FindNearestDescriptors(features.descriptors, descriptors_)) {
    if (nearest.distance > PlaceLimits::kLikeDistance) continue;
    for (const KeyframeId id : seen_by_[static_cast<std::size_t>(nearest.index)]) {
      if (id.value >= votes.size()) votes.resize(id.value + 1, 0);
      ++votes[id.value];
    }
  }
  return MostVoted(votes, limit);
}

void PlaceIndex::Append(LandmarkId id, const Landmark& landmark) {
  landmarks_.push_back(id);
  descriptors_.emplace_back();
  seen_by_.emplace_back();
  Refresh(landmarks_.size() - 1, landmark);
}

void PlaceIndex::Refresh(std::size_t i, const Landmark& landmark) {
  descriptors_[i] = landmark.descriptor;
  seen_by_[i].clear();
  for (const Observation& o : landmark.observations) seen_by_[i].push_back(o.keyframe);
}

}  // namespace planar_vslam
