#pragma once
// The stages of MapKeyframe, each a function of the map that returns the edit it asks for.
#include <optional>
#include <utility>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"

namespace planar_vslam {

// Keyframes `id` works with: covisible ones first, then those before it along its odometry links.
std::vector<KeyframeId> Neighbors(const Map& map, KeyframeId id, int covisible, int linked, int min_shared);

// `neighbors` and, in a metric map, the keyframes standing near `id` and looking the same way: old places seen again.
std::vector<KeyframeId> WithNearby(const Map& map, KeyframeId id, std::vector<KeyframeId> neighbors,
                                   const MapperOptions& options);

// The keyframe's own laser sweep, the first it holds, in its base. It has one.
PreparedScan OwnSweep(const Keyframe& keyframe, const ScanMatchOptions& options);
// The keyframes with a sweep nearest to a base, within so many metres, nearest first; at most `limit`.
std::vector<KeyframeId> NearestWithSweep(const Map& map, const Rigid3& T_map_base, double distance, std::size_t limit);
// Matches the newest keyframe's own laser sweep, the first it holds, against those of the keyframe before it and of the
// oldest one that stood nearby.
MapEdit LinkByLaser(const Map& map, KeyframeId newest, const ScanMatchOptions& options);
MapEdit CullRecentLandmarks(const Map& map, KeyframeId newest, const MapperOptions& options);
// New landmarks of the newest keyframe with each of `neighbors`, one after the other; a keypoint makes one at most.
MapEdit TriangulateWith(const Map& map, KeyframeId newest, const std::vector<KeyframeId>& neighbors,
                        const MapperContext& context);
// Projects `landmarks` into `target`: a free keypoint gains the observation, a taken one merges the two landmarks.
MapEdit FuseInto(const Map& map, const std::vector<LandmarkId>& landmarks, KeyframeId target,
                 const MapperContext& context);
// Both ways between the keyframe and those around it. Returns what it did to the map, in order.
MapEdit FuseWithNeighbors(Map* map, KeyframeId id, const MapperContext& context);
// Keyframes to new poses T_map_base, all of them, and landmarks with the keyframes they were made by.
MapEdit MoveKeyframes(const Map& map, const std::vector<std::pair<KeyframeId, Rigid3>>& poses);
// What a keyframe's keypoints were matched with is one landmark with what they showed before.
MapEdit JoinLandmarks(const Map& map, KeyframeId id, const FrameMatches& matches);
BundleRequest LocalRequest(const Map& map, KeyframeId newest, const MapperOptions& options);
MapEdit CullKeyframes(const Map& map, KeyframeId newest, const MapperOptions& options,
                      std::vector<CulledKeyframe>* culled);

}  // namespace planar_vslam
