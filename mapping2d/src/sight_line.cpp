#include "planar_vslam/mapping2d/sight_line.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace planar_vslam {

int LinesThrough(const std::vector<SightLine>& lines, const Overhang& outline, double height, double inset,
                 double clearance) {
  Eigen::AlignedBox2d box;
  for (const auto& loop : outline.outlines) {
    for (const Eigen::Vector2d& corner : loop) box.extend(corner);
  }
  const std::array<Eigen::Vector2d, 4> around = {Eigen::Vector2d(inset, 0.0), Eigen::Vector2d(-inset, 0.0),
                                                 Eigen::Vector2d(0.0, inset), Eigen::Vector2d(0.0, -inset)};
  const auto passes = [&](const SightLine& line) {
    const double share = (height - line.from.z()) / (line.to.z() - line.from.z());
    if (!(share > 0.0 && share < 1.0) || std::abs(line.to.z() - height) < clearance) return false;
    const Eigen::Vector2d at = (line.from + share * (line.to - line.from)).head<2>();
    return box.contains(at) && std::all_of(around.begin(), around.end(), [&](const Eigen::Vector2d& offset) {
             return outline.Contains(at + offset);
           });
  };
  return static_cast<int>(std::count_if(lines.begin(), lines.end(), passes));
}

}  // namespace planar_vslam
