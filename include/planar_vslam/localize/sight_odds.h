#pragma once
// What an image says of a place: log odds that the robot is there, by what is found of the landmarks that should be in
// view. Both shares differ from place to place and from light to light, so both are integrated over (beta-binomial):
//   there      p(k of n) with a share of Beta(1, 6): another day's light leaves some 5 to 30 per cent to be found
//   elsewhere  p(k of n) with a share about what chance finds in this image, of this map: what is found when the
//              landmarks are looked for where they do not belong
#include "planar_vslam/localize/sight_match.h"

namespace planar_vslam {

// `by_chance`: of landmarks looked for where they do not belong.
double SightLogOdds(const Agreement& at_place, const Agreement& by_chance);

}  // namespace planar_vslam
