#include "planar_vslam/navigate/recent_space.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

// Of a sweep among the last ones: at 10 Hz they are those of the last second. A foot rests for less.
constexpr float kWeight = 0.1F;
constexpr float kUnknown = 0.8F;  // five beams have to pass before a cell counts as free
constexpr float kMostlyFree = 0.5F;

std::size_t Index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void RecentSpace::Reset(const OccupancyGrid2d& layout) {
  width_ = layout.width;
  height_ = layout.height;
  resolution_ = layout.resolution;
  origin_ = layout.origin;
  occupied_.assign(layout.cells.size(), kUnknown);
  sweep_.assign(layout.cells.size(), -1);
  sweeps_ = 0;
}

bool RecentSpace::Fits(const OccupancyGrid2d& layout) const {
  return width_ == layout.width && height_ == layout.height && resolution_ == layout.resolution &&
         origin_ == layout.origin;
}

int RecentSpace::CellOf(const Eigen::Vector2d& p_map) const {
  const Eigen::Vector2d at = (p_map - origin_) / resolution_;
  if (!(at.x() >= 0.0 && at.y() >= 0.0 && at.x() < width_ && at.y() < height_)) return -1;
  return static_cast<int>(at.y()) * width_ + static_cast<int>(at.x());
}

bool RecentSpace::WasFree(const Eigen::Vector2d& p_map) const {
  const int cell = CellOf(p_map);
  if (cell < 0) return false;
  const int x = cell % width_, y = cell / width_;
  bool seen = false;  // far from the laser, beams leave cells between them that none has said anything of
  for (int v = std::max(0, y - 1); v <= std::min(height_ - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(width_ - 1, x + 1); ++u) {
      if (sweep_[Index(v * width_ + u)] < 0) continue;
      if (occupied_[Index(v * width_ + u)] >= kMostlyFree) return false;
      seen = true;
    }
  }
  return seen;
}

void RecentSpace::Add(const Rigid2& T_map_laser, const PlanarScan& scan, double range) {
  ++sweeps_;
  // Returns first: a cell that one beam hits and another one passes is not free.
  for (const bool returns : {true, false}) {
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      const double measured = static_cast<double>(scan.ranges[i]);
      if (std::isnan(measured) || measured < scan.range_min) continue;
      const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
      const Eigen::Vector2d direction = T_map_laser.R() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const auto note = [&](double distance, float value) {
        const int cell = CellOf(T_map_laser.translation + distance * direction);
        if (cell < 0 || sweep_[Index(cell)] == sweeps_) return;
        sweep_[Index(cell)] = sweeps_;
        occupied_[Index(cell)] += kWeight * (value - occupied_[Index(cell)]);
      };
      const bool hit = measured < scan.range_max && measured <= range;
      if (returns && hit) note(measured, 1.0F);
      if (returns) continue;
      const double free = std::min(measured, range) - (hit ? resolution_ : 0.0);
      for (double s = 0.0; s < free; s += resolution_) note(s, 0.0F);
    }
  }
}

}  // namespace planar_vslam
