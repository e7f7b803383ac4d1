#include <algorithm>

#include "planar_vslam/map/queries.h"
#include "stages.h"

namespace planar_vslam {
namespace {

constexpr double kNearbyAngle = DegreesToRadians(45.0);  // view directions that can share landmarks
constexpr std::size_t kNearbyLimit = 8;

}  // namespace

std::vector<KeyframeId> Neighbors(const Map& map, KeyframeId id, int covisible, int linked, int min_shared) {
  std::vector<KeyframeId> neighbors;
  for (const CovisibleKeyframe& c : CovisibleKeyframes(map, id, min_shared)) {
    if (static_cast<int>(neighbors.size()) >= covisible) break;
    neighbors.push_back(c.id);
  }
  KeyframeId current = id;
  for (int i = 0; i < linked; ++i) {
    const Keyframe* keyframe = map.keyframes.Find(current);
    if (keyframe == nullptr || !keyframe->odometry_link.has_value()) break;
    current = keyframe->odometry_link->from;
    if (map.keyframes.Contains(current) && std::find(neighbors.begin(), neighbors.end(), current) == neighbors.end()) {
      neighbors.push_back(current);
    }
  }
  return neighbors;
}

std::vector<KeyframeId> WithNearby(const Map& map, KeyframeId id, std::vector<KeyframeId> neighbors,
                                   const MapperOptions& options) {
  if (!map.metric) return neighbors;
  std::vector<KeyframeId> near = NearbyKeyframes(map, map.keyframes.At(id).T_map_camera(), options.nearby_distance,
                                                 kNearbyAngle, map.keyframes.size());
  const auto is_known = [&](KeyframeId other) {
    return other == id || std::find(neighbors.begin(), neighbors.end(), other) != neighbors.end();
  };
  near.erase(std::remove_if(near.begin(), near.end(), is_known), near.end());
  if (near.size() > kNearbyLimit) near.resize(kNearbyLimit);
  neighbors.insert(neighbors.end(), near.begin(), near.end());
  return neighbors;
}

BundleRequest LocalRequest(const Map& map, KeyframeId newest, const MapperOptions& options) {
  // A young map is the ruler of all that follows: while it fits into a window, none of it is fixed but its origin.
  if (map.keyframes.size() <= static_cast<std::size_t>(options.young_map)) return WholeMapRequest(map);
  // What a narrow window holds fixed at its border has drifted; a wide one now and then takes that drift out, and lets
  // an old place that is seen again pull at all that came since.
  const bool wide = newest.value % static_cast<std::uint32_t>(options.wide_every) == 0;
  BundleRequest request;
  request.free_keyframes = Neighbors(map, newest, wide ? options.wide_window : options.window, options.link_neighbors,
                                     wide ? 1 : options.min_shared);
  request.free_keyframes.push_back(newest);
  std::sort(request.free_keyframes.begin(), request.free_keyframes.end());
  const auto is_free = [&request](KeyframeId id) {
    return std::binary_search(request.free_keyframes.begin(), request.free_keyframes.end(), id);
  };

  request.landmarks = LandmarksOf(map, request.free_keyframes);

  // Border: those that see most of the landmarks, and the far ends of links into the window.
  std::vector<int> votes(map.next_keyframe_id, 0);
  std::vector<KeyframeId> border;
  const auto vote = [&](KeyframeId id, int count) {
    if (is_free(id)) return;
    if (votes[id.value] == 0) border.push_back(id);
    votes[id.value] += count;
  };
  for (const LandmarkId id : request.landmarks) {
    for (const Observation& o : map.landmarks.At(id).observations) vote(o.keyframe, 1);
  }
  constexpr int kLinkVote = 1 << 20;  // always among the border
  for (const KeyframeId id : request.free_keyframes) {
    const Keyframe& keyframe = map.keyframes.At(id);
    const auto vote_for_links = [&](const Keyframe& holder, const auto& vote_for) {
      if (holder.odometry_link.has_value()) vote_for(*holder.odometry_link);
      for (const MotionLink& link : holder.laser_links) vote_for(link);
    };
    vote_for_links(keyframe, [&](const MotionLink& link) { vote(link.from, kLinkVote); });
    for (const KeyframeId later : keyframe.linked_by) {
      vote_for_links(map.keyframes.At(later), [&](const MotionLink& link) {
        if (link.from == id) vote(later, kLinkVote);
      });
    }
  }
  std::sort(border.begin(), border.end());
  std::stable_sort(border.begin(), border.end(),
                   [&votes](KeyframeId a, KeyframeId b) { return votes[a.value] > votes[b.value]; });
  if (static_cast<int>(border.size()) > options.max_fixed) border.resize(static_cast<std::size_t>(options.max_fixed));
  std::sort(border.begin(), border.end());
  request.fixed_keyframes = border;

  // The first keyframe defines the map frame; without a border the oldest of the window holds the gauge.
  const KeyframeId first = map.keyframes.begin()->first;
  if (request.free_keyframes.front() == first || request.fixed_keyframes.empty()) {
    const KeyframeId held = request.free_keyframes.front();
    request.free_keyframes.erase(request.free_keyframes.begin());
    request.fixed_keyframes.insert(
        std::lower_bound(request.fixed_keyframes.begin(), request.fixed_keyframes.end(), held), held);
  }
  return request;
}

}  // namespace planar_vslam
