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
  std::vector<LandmarkId> gone;
  bool grew_at_its_end = true;  // as a map does: else this is another one
  map.landmarks.VisitChanges(known_, [&](LandmarkId id, const Landmark* before, const Landmark* now) {
    const auto at = std::lower_bound(landmarks_.begin(), landmarks_.end(), id);
    if (now == nullptr) {
      gone.push_back(id);
    } else if (before != nullptr) {
      Refresh(static_cast<std::size_t>(at - landmarks_.begin()), *now);
    } else if (at == landmarks_.end()) {
      Append(id, *now);
    } else {
      grew_at_its_end = false;
    }
  });
  if (grew_at_its_end) {
    Remove(gone);
  } else {
    *this = PlaceIndex(map, map.landmarks.Ids());
  }
  known_ = map.landmarks;
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

void PlaceIndex::Remove(const std::vector<LandmarkId>& gone) {
  if (gone.empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (std::binary_search(gone.begin(), gone.end(), landmarks_[i])) continue;
    if (kept != i) {
      landmarks_[kept] = landmarks_[i];
      descriptors_[kept] = descriptors_[i];
      std::swap(seen_by_[kept], seen_by_[i]);
    }
    ++kept;
  }
  landmarks_.resize(kept);
  descriptors_.resize(kept);
  seen_by_.resize(kept);
}

void PlaceIndex::Refresh(std::size_t i, const Landmark& landmark) {
  descriptors_[i] = landmark.descriptor;
  seen_by_[i].clear();
  for (const Observation& o : landmark.observations) seen_by_[i].push_back(o.keyframe);
}

}  // namespace planar_vslam
