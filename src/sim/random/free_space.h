#pragma once
// Where a robot can go: how far each place is from what it would touch, and the ways between places.
#include <Eigen/Geometry>
#include <vector>

#include "planar_vslam/sim/world.h"

namespace planar_vslam::sim {

class FreeSpace {
 public:
  static constexpr double kCell = 0.15;   // m
  static constexpr double kReach = 1.25;  // m, clearances beyond count as this

  explicit FreeSpace(const World& world);

  // From the point to the nearest wall or solid at the height of the body, at the centre of its cell; 0 outside.
  // Metres.
  double Clearance(const Eigen::Vector2d& at) const;
  // The least of it along a straight line.
  double Clearance(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;

  int cells() const { return columns_ * rows_; }
  int CellAt(const Eigen::Vector2d& at) const;  // -1 outside
  Eigen::Vector2d CentreOf(int cell) const;
  double ClearanceOf(int cell) const { return clearance_[static_cast<std::size_t>(cell)]; }

  // The largest connected set of cells with that clearance.
  std::vector<int> LargestComponent(double clearance) const;

  // The ways from one cell to all others, short ones through wide places.
  struct Ways {
    std::vector<int> before;     // cell before each on the way; -1 at the start and where there is no way
    std::vector<double> length;  // m; infinite where there is no way
  };
  Ways WaysFrom(int start, double clearance) const;

 private:
  // Cell beside another; -1 outside. `side` counts the eight of them.
  int Neighbour(int cell, int side) const;

  int columns_, rows_;
  std::vector<double> clearance_;  // m
};

}  // namespace planar_vslam::sim
