#pragma once
// The keyframes of a metric map on the floor, pulled together by loops: each tie of the map (map_ties.h) holds the
// relative pose its two keyframes have now, by its covariance, each loop a relative pose measured otherwise. Minimised
// over x, y and heading of all keyframes but the first, as steps on the floor (pose_manifold.h,
// relative_pose_factor.h):
//   sum |Log(T_i_j^-1 T_map_i^-1 T_map_j)|^2_Sigma
// As all ties are at rest before, a loop's correction spreads as the ties are loose. Height and tilt stay.
//
// Where a keyframe has left the floor (floor_monitor.h; not with planar.mode off), height and tilt are unknowns as
// well: a map of a ramp whose foot the camera did not see has a wrong tilt from there on, and a loop shows it. All six
// dof then, with the planar prior (planar_prior.h) on every keyframe and
//   a tie by landmarks    as sure of height and tilt as of position and heading,
//   by wheels or laser    of neither by more than a slope may change them: what bends gives way there.
#include <utility>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/map_ties.h"
#include "planar_vslam/planar/planar_prior.h"

namespace planar_vslam {

struct LoopTie {
  KeyframeId from, to;         // `from` is the older one
  Rigid3 T_map_to;             // where `to` stands if `from` stands where it does
  Eigen::Matrix3d covariance;  // of the right tangent [x, y, angle] at `to`; height is as sure as x, tilt as the angle
  TieSource source = TieSource::kLandmarks;
};

// The keyframes' new poses T_map_base, in the order of the map. Keyframes after the last doubtful tie before a loop's
// end start as the loop would have them: they were moved there as one piece. Error: what Ceres says where it finds no
// solution.
Expected<std::vector<std::pair<KeyframeId, Rigid3>>> SolvePoseGraph(const Map& map, const std::vector<MapTie>& ties,
                                                                    const std::vector<LoopTie>& loops,
                                                                    const PlanarPriorOptions& planar);

}  // namespace planar_vslam
