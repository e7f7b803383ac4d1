#pragma once
// The questions asked of a map.
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

// The valid ones of `ids`, in their order: of Keyframe::landmarks, those the keyframe sees.
std::vector<LandmarkId> ValidOnly(const std::vector<LandmarkId>& ids);

// Union of the landmarks seen by `keyframes`, ascending.
std::vector<LandmarkId> LandmarksOf(const Map& map, const std::vector<KeyframeId>& keyframes);

// How many of `ids` exist and are seen by so many keyframes.
int CountObserved(const Map& map, const std::vector<LandmarkId>& ids, std::size_t keyframes);

// Median depth of the existing ones of `ids` in the camera; 0 where there is none.
double MedianDepth(const Map& map, const std::vector<LandmarkId>& ids, const Rigid3& T_map_camera);

// The keyframes with votes, most first, ties by smaller id, at most `limit`. `votes` by keyframe id.
std::vector<KeyframeId> MostVoted(const std::vector<int>& votes, std::size_t limit);

// The keyframes that see the existing ones of `landmarks`, most of them first, ties by smaller id; at most `limit`.
std::vector<KeyframeId> VotedKeyframes(const Map& map, const std::vector<LandmarkId>& landmarks, std::size_t limit);

// Keyframes whose camera is within `distance` of `T_map_camera` and looks within `angle` of it, nearest first, ties by
// smaller id; at most `limit`.
std::vector<KeyframeId> NearbyKeyframes(const Map& map, const Rigid3& T_map_camera, double distance, double angle,
                                        std::size_t limit);

}  // namespace planar_vslam
