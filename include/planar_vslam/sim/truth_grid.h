#pragma once
// Ground-truth occupancy straight from the world's geometry, and its map_server files.
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

struct TruthGrid {
  int width = 0, height = 0;                         // cells along x and y
  double resolution = 0.05;                          // m per cell
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // of the corner of cell (0, 0), world, m
  std::vector<std::uint8_t> occupied;                // 1 where any solid overlaps the cell; index y * width + x

  bool Occupied(int x, int y) const { return occupied[static_cast<std::size_t>(y * width + x)] != 0; }
};

// Solids and walls with anything between the two heights. The walls are a ring of cells around the room.
TruthGrid MakeTruthGrid(const World& world, double low, double high);

// Writes `yaml_path` and a binary pgm beside it.
Expected<bool> WriteTruthGrid(const TruthGrid& grid, const std::filesystem::path& yaml_path);

}  // namespace planar_vslam
