#pragma once
// What the wheels read wrong throughout and how noisy they are, learned while a map grows. A tyre that is worn or a
// base that is a bit wider than it says multiplies every length and every turn; as a random error such a share is far
// smaller than it is as a sum over a hundred keyframes.
//
// Of each odometry link i -> j, with the twist (w, a) of its planar motion:
//   turn    a_map - a = t a_map + noise,   a_map from the poses of i and j, which images and laser hold;
//   length  l - w = s b + noise,           l by the laser between the same keyframes. Without one the map's lengths are
//           the wheels' own, and only the camera's height over an even floor says how long they are.
// The way b that a share is taken of is the best estimate of both, b = w + C_w (C_w + C_l)^-1 (l - w), whose error has
// nothing to do with l - w. The wheels' own error in both factors of a product has no mean of zero: over short ways it
// makes all wheels read long. Both shares are weighted means, with what was known before as a prior N(0, sigma^2) on
// the logarithm of the whole factor; links further off than 3 sigma (slips) take no part.
//
// Noise: the factor f >= 1 of the wheels' standard deviations for which half of the links are as near as half should
// be,
//   median of d^T (f^2 C_w + C_rest)^-1 d = median of chi-square,
// d = what is left of l - w (without a laser: of the map's way, C_rest its landmarks' word) or a_map - a. Never below
// 1: a map that follows its wheels seems to agree with them however good they are.
#include <optional>

#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"
#include "planar_vslam/optimize/map_uncertainty.h"
#include "planar_vslam/planar/scale_estimate.h"

namespace planar_vslam {

struct WheelErrors {
  double log_length = 0.0, log_turn = 0.0;  // of the factors that readings have to be multiplied by
  double length_sigma = 0.0, turn_sigma = 0.0;
  WheelNoise noise = {};
};

// What is known before any link: nothing to correct, by as much as `systematic` doubts it.
WheelErrors UnknownWheelErrors(const SystematicErrors& systematic);

// The errors as the map shows them, in whole: its links from `first` on have been corrected by `applied` already.
// `prior`: what was known before those links. `floor`: the map's scale by the floor, for a map without laser links.
WheelErrors LearnWheelErrors(const Map& map, KeyframeId first, const WheelErrors& prior, const WheelErrors& applied,
                             const std::optional<ScaleMeasurement>& floor, const MeasurementModel& model);

// Whether `now` differs from `applied` by enough to be worth correcting anything.
bool IsNews(const WheelErrors& now, const WheelErrors& applied);

}  // namespace planar_vslam
