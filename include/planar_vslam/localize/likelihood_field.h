#pragma once
// What the laser sweeps of a map say of a place: the likelihood field of Thrun, Burgard and Fox (Probabilistic
// Robotics, 6.4), as odds. A cell holds
//   log( p(a beam ends here | the robot is where it is thought to be) / p(a beam ends here | it is anywhere else) ),
// high on a mapped surface, falling to a floor away from all of them: things move, so no single beam refutes a place.
// The floor is lower where the map saw free space than where it saw nothing. A sum over the points of a sweep is the
// log odds of a place against "anywhere else", as many times too large as points are correlated.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

// A laser sweep, and where it was taken.
struct PosedSweep {
  std::shared_ptr<const PlanarScan> scan;
  Rigid3 T_base_laser;
  Rigid2 T_map_base;
};

// Points that a sweep hit, in `T_frame_laser`'s frame, on its x-y plane; in the order of the beams.
std::vector<Eigen::Vector2d> PointsOf(const PlanarScan& scan, const Rigid3& T_frame_laser);
// One point a square of `size` m, the first that lies in it: surfaces count by their length, not by the beams they
// caught.
std::vector<Eigen::Vector2d> Thinned(const std::vector<Eigen::Vector2d>& points, double size);

class LikelihoodField {
 public:
  static constexpr double kCell = 0.05;  // m, as the grid's
  static constexpr int kLevels = 5;      // of maxima over squares of 1, 2, 4, 8 and 16 cells

  // Empty where no sweep hit anything.
  explicit LikelihoodField(const std::vector<PosedSweep>& sweeps);

  bool empty() const { return columns_ == 0; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  double free_area() const { return free_area_; }  // m^2 that the sweeps saw free

  Eigen::Vector2d CellsOf(const Eigen::Vector2d& p_map) const { return (p_map - origin_) / kCell; }
  Eigen::Vector2d PointOf(const Eigen::Vector2d& cells) const { return origin_ + kCell * cells; }
  // The odds at a point.
  double LogOdds(const Eigen::Vector2d& p_map) const;
  // The mean of the odds at points of the base's frame.
  double LogOdds(const std::vector<Eigen::Vector2d>& points, const Rigid2& T_map_base) const;

  // Whether a beam between these points would have gone through a mapped surface, well before its end.
  bool Crosses(const Eigen::Vector2d& laser_map, const Eigen::Vector2d& hit_map) const;

  // The highest quantum of the square of 2^level cells whose first one is this; ToLogOdds makes it odds.
  std::uint8_t Highest(int level, int column, int row) const {
    column += kMargin, row += kMargin;
    if (column < 0 || row < 0 || column >= width_ || row >= height_) return unknown_;
    return highest_[static_cast<std::size_t>(level)][Index(column, row)];
  }
  static double ToLogOdds(double quantum) { return kLeast + quantum * kQuantum; }
  // Whether the robot may stand in that square: near cells that were seen free.
  bool MayStand(int level, int column, int row) const;

  // log of the ratio at a surface, far from all in space seen free, and where nothing was seen.
  static const double kOnSurface, kInFree, kUnseen;

 private:
  static constexpr int kMargin = 16;  // cells around the map, so that a square that reaches into it is known
  static constexpr double kLeast = -2.0, kQuantum = 1.0 / 64.0;

  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column);
  }
  void Lay(const std::vector<std::vector<Eigen::Vector2d>>& hits);
  void Sweep(const PosedSweep& sweep, const std::vector<Eigen::Vector2d>& hits, std::vector<std::uint8_t>* seen) const;
  void Score(const std::vector<std::uint8_t>& seen);
  void Pool();

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0, width_ = 0, height_ = 0;  // without and with the margin
  double free_area_ = 0.0;
  std::uint8_t unknown_ = 0, surface_ = 0;
  std::array<std::vector<std::uint8_t>, kLevels> highest_;
  std::array<std::vector<std::uint8_t>, kLevels> standing_;
};

}  // namespace planar_vslam
