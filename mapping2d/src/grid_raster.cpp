#include "grid_raster.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {

std::int8_t& GridRaster::At(int x, int y) {
  const std::pair<int, int> tile(x >> kBlockBits, y >> kBlockBits);
  if (last_tile_ == nullptr || tile != last_) {
    const auto [entry, is_new] = tiles_.try_emplace(tile);
    if (is_new) entry->second.fill(static_cast<std::int8_t>(Verdict::kUnknown));
    last_ = tile;
    last_tile_ = &entry->second;
  }
  return (*last_tile_)[static_cast<std::size_t>(CellOf({x, y, 0}))];
}

void GridRaster::Add(int x, int y, Verdict verdict) {
  std::int8_t& cell = At(x, y);
  cell = std::max(cell, static_cast<std::int8_t>(verdict));
}

void GridRaster::Set(int x, int y, Verdict verdict) { At(x, y) = static_cast<std::int8_t>(verdict); }

OccupancyGrid2d GridRaster::ToGrid(double resolution) const {
  OccupancyGrid2d grid;
  grid.resolution = resolution;
  Eigen::Array2i low = Eigen::Array2i::Constant(std::numeric_limits<int>::max());
  Eigen::Array2i high = Eigen::Array2i::Constant(std::numeric_limits<int>::min());
  const auto visit_known = [this](const auto& visit) {
    for (const auto& [tile, cells] : tiles_) {
      for (int i = 0; i < kBlockCells; ++i) {
        const std::int8_t value = cells[static_cast<std::size_t>(i)];
        const Eigen::Array2i at(tile.first * kBlockSide + i % kBlockSide, tile.second * kBlockSide + i / kBlockSide);
        if (value != static_cast<std::int8_t>(Verdict::kUnknown)) visit(at, value);
      }
    }
  };
  visit_known([&](const Eigen::Array2i& at, std::int8_t) {
    low = low.min(at);
    high = high.max(at);
  });
  if ((high < low).any()) return grid;
  grid.width = high.x() - low.x() + 1;
  grid.height = high.y() - low.y() + 1;
  grid.origin = resolution * (low - kLatticeReach).cast<double>().matrix();
  grid.cells.assign(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height), -1);
  visit_known([&](const Eigen::Array2i& at, std::int8_t value) {
    const auto row = static_cast<std::size_t>(at.y() - low.y()), column = static_cast<std::size_t>(at.x() - low.x());
    grid.cells[row * static_cast<std::size_t>(grid.width) + column] = value;
  });
  return grid;
}

std::vector<Eigen::Vector2i> DiscCells(const Eigen::Vector2d& center, double radius, double resolution) {
  std::vector<Eigen::Vector2i> cells;
  const Eigen::Vector2d p = (center / resolution).array() + kLatticeReach;
  const double reach = radius / resolution;  // cells
  const Eigen::Vector2i low = (p.array() - reach).floor().cast<int>(), high = (p.array() + reach).ceil().cast<int>();
  for (int y = low.y(); y <= high.y(); ++y) {
    for (int x = low.x(); x <= high.x(); ++x) {
      if ((Eigen::Vector2d(x + 0.5, y + 0.5) - p).norm() <= reach) cells.emplace_back(x, y);
    }
  }
  return cells;
}

std::vector<Eigen::Vector2i> CellsOf(const Overhang& overhang, double resolution) {
  std::vector<Eigen::Vector2i> cells;
  Eigen::AlignedBox2d box;
  for (const auto& loop : overhang.outlines) {
    for (const Eigen::Vector2d& corner : loop) box.extend(corner);
  }
  if (box.isEmpty()) return cells;
  const Eigen::Array2d low = (box.min() / resolution).array().floor(), high = (box.max() / resolution).array().ceil();
  if ((low < -kLatticeReach).any() || (high >= kLatticeReach).any()) return cells;
  for (int y = static_cast<int>(low.y()); y <= static_cast<int>(high.y()); ++y) {
    for (int x = static_cast<int>(low.x()); x <= static_cast<int>(high.x()); ++x) {
      const Eigen::Vector2d center = resolution * Eigen::Vector2d(x + 0.5, y + 0.5);
      if (overhang.Contains(center)) cells.emplace_back(x + kLatticeReach, y + kLatticeReach);
    }
  }
  return cells;
}

}  // namespace planar_vslam
