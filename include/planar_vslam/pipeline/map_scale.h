#pragma once
// How well a map's scale is known, and from what: wheel odometry over its keyframes, the laser's motion between them,
// and the camera's height over the floor that the landmarks show. Each is an opinion on the factor the map is still to
// be multiplied by, with a standard deviation that has the source's systematic error in it; they are independent and
// fused by their variances. On a map that bundle adjustment has already made metric the factor is near 1, and its
// standard deviation is that of the map's scale.
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/map_uncertainty.h"
#include "planar_vslam/planar/scale_estimate.h"

namespace planar_vslam {

struct ScaleOptions {
  int keyframes = 0;
  double max_sigma = 0.01;  // of log(scale)
  double min_distance = 1.0;
  double height_sigma = 0.005;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("keyframes", o.keyframes, unit::kNone, bound::ZeroOr(bound::AtLeast(3)),
      "the paper's N: taken at this many keyframes; 0: once it is known well enough");
    v("max_sigma", o.max_sigma, unit::kNone, bound::Positive(), "share, standard deviation that is well enough");
    v("min_distance", o.min_distance, unit::kMeters, bound::Positive(), "and the robot has driven this far");
    v("height_sigma", o.height_sigma, unit::kMeters, bound::Positive(), "of the camera's height over the floor");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

struct MapScale {
  std::optional<ScaleEstimate> track;  // wheels against the visual track
  std::optional<ScaleMeasurement> wheels, laser, floor;
  bool floor_in_parts = false;  // the floor was seen on every quarter of the way: floor.sigma has its unevenness in it
  std::optional<ScaleMeasurement> fused;  // nothing where no source says anything
  // Whether the sources agree: each within 3 sigma of the others' mean. If not: slip, a wrong floor, a wrong mount.
  bool consistent = true;
};

// The longest run of keyframes up to the newest that odometry links one after the other.
std::vector<LeverArmSample> LinkedTrack(const Map& map);

// `systematic`: the shares by which calibrated wheels and the laser read wrong throughout.
MapScale AssessScale(const Map& map, const ScaleOptions& options, const SystematicErrors& systematic);

// An unscaled map made metric by `scale`: keyframes and landmarks scaled, and the first base put on the floor at the
// map's origin.
Map ScaledToMetric(const Map& map, double scale);

// Decides when an unscaled map's scale is known: remembers how it changed over the last keyframes.
class ScaleGate {
 public:
  // Takes the next opinion; empty once the scale may be applied, else what is missing.
  std::string Missing(const MapScale& scale, const ScaleOptions& options);

 private:
  std::vector<double> recent_;  // log of the total factor, newest last
};

}  // namespace planar_vslam
