#pragma once
// Maps as rviz markers.
#include <visualization_msgs/MarkerArray.h>

#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam::ros_face {

// A cube list for each size, as many as there are levels between the smallest and the largest, so that a level that has
// become empty is cleared; coloured by height.
visualization_msgs::MarkerArray ToOctomapMarkers(const std_msgs::Header& header, double resolution,
                                                 const std::vector<OccupiedCube>& cubes);

using KeyframePair = std::pair<KeyframeId, KeyframeId>;

// Keyframes as points; lines for motion links of the wheels and of the laser, and for `loops`. A loop whose keyframe
// has been culled is left out.
visualization_msgs::MarkerArray ToGraphMarkers(const std_msgs::Header& header, const Map& map,
                                               const std::vector<KeyframePair>& loops);

}  // namespace planar_vslam::ros_face
