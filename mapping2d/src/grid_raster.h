#pragma once
// Verdicts on cells, brought together into a grid.
#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/mapping2d/overhang.h"
#include "voxels.h"

namespace planar_vslam {

enum class Verdict : std::int8_t { kUnknown = -1, kFree = 0, kOccupied = 100 };  // as in OccupancyGrid2d::cells

// Cells of the lattice whose cell (kLatticeReach, kLatticeReach) has its lower corner at the origin of `map`, in tiles
// of the size of a block.
class GridRaster {
 public:
  // Of several verdicts on one cell occupied wins over free, and free over unknown.
  void Add(int x, int y, Verdict verdict);
  // The last word on a cell.
  void Set(int x, int y, Verdict verdict);
  // Bounds are those of the known cells.
  OccupancyGrid2d ToGrid(double resolution) const;

 private:
  using Tile = std::array<std::int8_t, kBlockCells>;
  std::int8_t& At(int x, int y);

  std::map<std::pair<int, int>, Tile> tiles_;
  std::pair<int, int> last_{-1, -1};
  Tile* last_tile_ = nullptr;  // that of last_; a map's values stay where they are
};

// The cells (of GridRaster's lattice) whose centre lies within `radius` m of `center`.
std::vector<Eigen::Vector2i> DiscCells(const Eigen::Vector2d& center, double radius, double resolution);

// The cells whose centre lies below the overhang, within the lattice.
std::vector<Eigen::Vector2i> CellsOf(const Overhang& overhang, double resolution);

}  // namespace planar_vslam
