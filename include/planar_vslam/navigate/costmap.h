#pragma once
// Where the robot may drive: a map's obstacles and those the laser sees now, grown by the robot's body.
//
// A cell's clearance is the distance from its centre to the nearest obstacle's cell, less half a cell and less the
// body's radius. Unknown cells count as obstacles that the body's axis must keep `unknown_margin` away from. What the
// laser sees is marked; a beam that passes through clears. The map's own obstacles are never cleared.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/navigate/options.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

enum class CellKind { kFree, kOccupied, kUnknown, kOutside };
enum class Layers { kMapOnly, kMapAndLaser };

class Costmap {
 public:
  explicit Costmap(const NavigateOptions& options) : options_(options) {}

  // False, and nothing changes, for a grid that is empty, not of its own size, or has no finite positive resolution.
  // Marks stay where the layout does.
  bool SetMap(OccupancyGrid2d map);
  // Row-major cells of a part of the map. False, and nothing changes, where the part is not inside the map.
  bool UpdateMap(const GridRegion& region, const std::vector<std::int8_t>& cells);
  bool has_map() const { return !map_.cells.empty(); }
  const OccupancyGrid2d& map() const { return map_; }

  // Marks returns, clears along beams, and forgets marks older than their lifetime. `time` in s. `people` are beams
  // that end at somebody who walks, in order: nothing is marked there.
  void AddSweep(double time, const Rigid2& T_map_laser, const PlanarScan& scan,
                const std::vector<std::size_t>& people = {});
  void ClearMarks();
  std::size_t marks() const { return marks_.size(); }

  CellKind KindAt(const Eigen::Vector2d& p_map) const;
  // From the body with its axis there to the nearest obstacle, m, at most `reach`; negative inside. Minus infinity
  // outside the map.
  double Clearance(const Eigen::Vector2d& p_map, Layers layers = Layers::kMapAndLaser) const;
  double ClearanceOfCell(int cell, Layers layers) const;
  // From a place to the map's nearest obstacle, m, at most the inflation radius or so; minus infinity outside the map.
  double DistanceToMap(const Eigen::Vector2d& p_map) const;
  // 0 far from obstacles, 1 where the body would touch one; falls exponentially between.
  double CostOfCell(int cell, Layers layers) const;

  // -1 outside.
  int CellOf(const Eigen::Vector2d& p_map) const;
  Eigen::Vector2d CentreOf(int cell) const;

 private:
  struct Mark {
    int cell;
    double time;  // s
  };
  double Reach() const { return options_.inflation_radius + map_.resolution; }
  GridRegion Grown(const GridRegion& region, int cells) const;
  void InflateMap(const GridRegion& changed);
  void InflateMarks();
  // Lowers `distances` around a cell, as far as they are within a region, to the distance from its centre plus
  // `offset`.
  void Stamp(int cell, double offset, const GridRegion& within, std::vector<float>* distances,
             std::vector<int>* touched) const;
  bool IsEdge(int cell, bool unknown) const;
  bool IsExplained(int cell) const;
  void ClearBeam(const Eigen::Vector2d& from, const Eigen::Vector2d& to);

  NavigateOptions options_;
  OccupancyGrid2d map_;
  std::vector<float> map_distance_, laser_distance_;  // m, to obstacles; at most Reach()
  std::vector<int> touched_;                          // cells of laser_distance_ below Reach()
  std::vector<Mark> marks_;                           // by cell
  std::vector<double> marked_at_;                     // s, a cell; minus infinity: no mark
};

}  // namespace planar_vslam
