#pragma once
// 2D occupancy grid with the semantics of nav_msgs/OccupancyGrid, and its map_server files.
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam {

struct OccupancyGrid2d {
  int width = 0;                                     // cells along x
  int height = 0;                                    // cells along y
  double resolution = 0.05;                          // m per cell
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // of the corner of cell (0, 0), m
  std::vector<std::int8_t> cells;  // row-major, y up: index = y * width + x; -1 unknown, 0 free, 100 occupied

  std::int8_t At(int x, int y) const {
    return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

// Whether both have the same cells, whatever their values.
bool HaveSameLayout(const OccupancyGrid2d& a, const OccupancyGrid2d& b);

struct GridRegion {
  int x = 0, y = 0, width = 0, height = 0;  // cells
};
// The smallest rectangle that holds every cell whose value differs; nothing where none does. Needs the same layout.
std::optional<GridRegion> ChangedRegion(const OccupancyGrid2d& before, const OccupancyGrid2d& after);

// Writes `yaml_path` and a binary pgm beside it with the same stem (map_server trinary: 0 occupied, 254 free, 205
// unknown). An empty grid is written as one unknown cell, because readers refuse images without pixels.
Expected<bool> WriteMapServerFiles(const OccupancyGrid2d& grid, const std::filesystem::path& yaml_path);

// Reads a map_server yaml and its pgm (P2 or P5, 8 bit), trinary, `negate` honoured,
// origin yaw must be 0. Errors name the file and the field.
Expected<OccupancyGrid2d> ReadMapServerFiles(const std::filesystem::path& yaml_path);

}  // namespace planar_vslam
