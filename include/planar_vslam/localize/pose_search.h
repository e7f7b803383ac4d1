#pragma once
// Where a robot may stand whose laser saw these points: the places of highest odds in a likelihood field, found by
// branch and bound over x, y and heading (Olson, 2009, for the multi-resolution lookup; Hess et al., 2016, for the
// bound).
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "planar_vslam/localize/likelihood_field.h"

namespace planar_vslam {

struct PlaceOdds {
  Rigid2 T_map_base;
  double log_odds = 0.0;  // mean per point
};

// Part of the floor to search.
struct SearchArea {
  Rigid2 center;
  double radius = 0.0;  // m
  double angle = 0.0;   // rad, to either side
};

// Two poses are one place: nearer than the distance at which a robot in between could not be told from either.
constexpr double kSamePlaceDistance = 0.5;  // m
constexpr double kSamePlaceAngle = DegreesToRadians(10.0);
bool IsSamePlace(const Rigid2& a, const Rigid2& b);

// At most `limit` places, none the same as another, best first; those whose odds are less than the best ones' by more
// than `margin` are left out. `points` in the frame of the base. Nothing where there are no points.
std::vector<PlaceOdds> FindPlaces(const LikelihoodField& field, const std::vector<Eigen::Vector2d>& points,
                                  const std::optional<SearchArea>& area, std::size_t limit, double margin);

// The pose of the highest odds next to `guess`, to a centimetre and a third of a degree.
PlaceOdds Climb(const LikelihoodField& field, const std::vector<Eigen::Vector2d>& points, const Rigid2& guess);

}  // namespace planar_vslam
