#pragma once
// Where on the floor images may have been taken, by votes (Hough): a keypoint that looks like a landmark of known
// height tells the distance to it, by its elevation from a camera of known height and tilt and by its size; with a
// heading of the robot that makes one place. Right matches of several images, joined by odometry, meet in one cell of
// (x, y, heading); wrong ones are strewn.
#include <vector>

#include "planar_vslam/localize/sight_match.h"

namespace planar_vslam {

struct LikelyMatch {
  int keypoint = -1, landmark = -1;
  int distance = 0;  // bits
};
// Keypoints and landmarks of the table that look alike; at most three of each one, the most alike. By keypoint.
std::vector<LikelyMatch> FindLikelyMatches(const LandmarkTable& table, const FrameFeatures& features);

// The places with the most votes, best first, none the same as another (pose_search.h). Only places within 1.5 m of
// where the map's robot has been are asked. `matches` of each view.
std::vector<Rigid2> VotedPlaces(const LandmarkTable& table, const std::vector<SightView>& views,
                                const std::vector<std::vector<LikelyMatch>>& matches, std::size_t limit);

}  // namespace planar_vslam
