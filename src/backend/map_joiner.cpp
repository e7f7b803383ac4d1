#include "planar_vslam/backend/map_joiner.h"

#include <algorithm>
#include <map>
#include <utility>

#include "planar_vslam/map/map_union.h"

namespace planar_vslam {
namespace {

void Silent(const std::string& /*what*/, long /*done*/, long /*total*/) {}

}  // namespace

void MapJoiner::LookForNew(const Map& snapshot) {
  for (auto it = snapshot.keyframes.From(next_); it != snapshot.keyframes.end(); ++it) {
    if (std::optional<SharedPlace> place = seeker_.Find(it->first, it->second)) found_.push_back(std::move(*place));
    next_ = KeyframeId{it->first.value + 1};
  }
}

std::vector<SharedPlace> MapJoiner::PlacesOf(const Map& snapshot, const std::vector<Meeting>& meetings) const {
  std::map<KeyframeId, SharedPlace> places;
  for (const SharedPlace& found : found_) {
    const Keyframe* keyframe = snapshot.keyframes.Find(found.keyframe);
    if (keyframe == nullptr) continue;
    places[found.keyframe] = found;
    places[found.keyframe].T_other_base = keyframe->T_map_base;  // it has moved since
  }
  std::map<Timestamp, Rigid3> by_stamp;
  for (const Meeting& meeting : meetings) by_stamp[meeting.keyframe] = meeting.T_known_base;
  for (const auto& [id, keyframe] : snapshot.keyframes) {
    const auto meeting = by_stamp.find(keyframe.stamp);
    if (meeting == by_stamp.end() || places.count(id) > 0) continue;
    PlaceTest test = seeker_.TestAt(id, keyframe, meeting->second);
    if (test.place.has_value()) places[id] = std::move(*test.place);
  }
  std::vector<SharedPlace> ascending;
  for (auto& [id, place] : places) ascending.push_back(std::move(place));
  return ascending;
}

Expected<std::optional<MapJunction>> MapJoiner::Try(const Map& snapshot, const std::vector<Meeting>& meetings) {
  if (!snapshot.metric) return std::optional<MapJunction>();
  LookForNew(snapshot);
  const std::size_t known = found_.size() + meetings.size();
  constexpr std::size_t kShare = 10;  // a tenth more than at the last try, which looked at the whole map
  if (known < std::max<std::size_t>(AlignmentLimits::kFewest, tried_ + 1 + tried_ / kShare)) {
    return std::optional<MapJunction>();
  }
  tried_ = known;
  Expected<MapOverlap> overlap = OverlapOf(seeker_, snapshot, PlacesOf(snapshot, meetings), Silent);
  if (!overlap.ok()) return std::optional<MapJunction>();
  const Map united = UnionOf(*known_, snapshot);
  Expected<JoinedMap> joined = JoinAt(united, KeyframeId{known_->next_keyframe_id}, *overlap, context_, Silent);
  if (!joined.ok()) return joined.error();
  MapJunction junction;
  junction.correction = CorrectionBetween(united, joined->map, std::move(joined->structure));
  junction.map = std::make_shared<const Map>(std::move(joined->map));
  junction.alignment = std::move(overlap->alignment);
  junction.bundle = std::move(joined->bundle);
  return std::optional(std::move(junction));
}

}  // namespace planar_vslam
