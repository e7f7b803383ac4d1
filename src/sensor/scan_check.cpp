#include "planar_vslam/sensor/scan_check.h"

#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

constexpr double kFullTurn = 2.0 * M_PI;  // rad
constexpr double kSlack = 0.1;            // rad that a full turn may overlap itself
constexpr double kUnlimitedRange = 1e4;   // m, beyond any laser of a robot
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

}  // namespace

bool StatesRange(const PlanarScan& scan) { return scan.range_max > 0.0 && scan.range_max < kUnlimitedRange; }

Expected<PlanarScan> CheckedScan(PlanarScan scan) {
  if (scan.ranges.empty()) return Error{"scan without ranges"};
  if (!std::isfinite(scan.angle_min) || !std::isfinite(scan.angle_increment)) return Error{"scan angles not finite"};
  if (std::abs(scan.angle_min) > kFullTurn + kSlack) return Error{"scan angle_min beyond a turn, not in radians"};
  const double span = std::abs(scan.angle_increment) * static_cast<double>(scan.ranges.size() - 1);
  if (span > kFullTurn + kSlack) return Error{"scan angles over more than a turn, not in radians"};
  if (scan.angle_increment == 0.0 && scan.ranges.size() > 1) return Error{"scan angle_increment zero"};
  const bool stated = StatesRange(scan);
  if (!stated) scan.range_max = kUnlimitedRange;
  if (!(scan.range_min >= 0.0 && scan.range_min < scan.range_max)) scan.range_min = 0.0;
  for (float& range : scan.ranges) {
    const bool measured = range > 0.0F && (stated || std::isfinite(range));
    if (!measured) range = kNothing;
  }
  return scan;
}

}  // namespace planar_vslam
