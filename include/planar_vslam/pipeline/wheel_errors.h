#pragma once
// What the wheels read wrong throughout, learned while a map grows. A tyre that is worn or a base that is a bit wider
// than it says multiplies every length and every turn; as a random error such a share is far smaller than it is as a
// sum over a hundred keyframes.
//
// Of each odometry link i -> j, with the twist (w, a) of its planar motion:
//   turn    a_map - a = t a + noise,   a_map from the poses of i and j, which images and laser hold;
//   length  l - w = s w + noise,       l by the laser between the same keyframes. Without one the map's lengths are the
//           wheels' own, and only the camera's height over an even floor says how long they are.
// Both are weighted means of shares, with what was known before as a prior N(0, sigma^2) on the logarithm of the whole
// factor; links further off than 3 sigma (slips) take no part.
#include <optional>

#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"
#include "planar_vslam/optimize/map_uncertainty.h"
#include "planar_vslam/planar/scale_estimate.h"

namespace planar_vslam {

struct WheelErrors {
  double log_length = 0.0, log_turn = 0.0;  // of the factors that readings have to be multiplied by
  double length_sigma = 0.0, turn_sigma = 0.0;
};

// What is known before any link: nothing to correct, by as much as `systematic` doubts it.
WheelErrors UnknownWheelErrors(const SystematicErrors& systematic);

// The errors as the map shows them, in whole: its links from `first` on have been multiplied by `applied` already.
// `prior`: what was known before those links. `floor`: the map's scale by the floor, for a map without laser links.
WheelErrors LearnWheelErrors(const Map& map, KeyframeId first, const WheelErrors& prior, const WheelErrors& applied,
                             const std::optional<ScaleMeasurement>& floor, const MeasurementModel& model);

// Whether `now` differs from `applied` by enough to be worth correcting anything.
bool IsNews(const WheelErrors& now, const WheelErrors& applied);

}  // namespace planar_vslam
