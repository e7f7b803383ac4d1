#pragma once
// How often each cell of the map was hit by the laser lately. Who walks is seen where beams passed freely a moment ago;
// furniture, in the map or not, is not.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

class RecentSpace {
 public:
  // Forgets everything. A layout without cells is one where nothing was ever free.
  void Reset(const OccupancyGrid2d& layout);
  bool Fits(const OccupancyGrid2d& layout) const;

  // A sweep of the laser at `T_map_laser`; what is farther than `range` (m) is left alone.
  void Add(const Rigid2& T_map_laser, const PlanarScan& scan, double range);
  // Whether beams passed freely there, and in all cells around it, most of the last second or so.
  bool WasFree(const Eigen::Vector2d& p_map) const;

 private:
  int CellOf(const Eigen::Vector2d& p_map) const;

  int width_ = 0, height_ = 0;
  double resolution_ = 1.0;  // m
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  std::vector<float> occupied_;  // share of the last sweeps, a cell
  std::vector<int> sweep_;       // the last one that said something of a cell
  int sweeps_ = 0;
};

}  // namespace planar_vslam
