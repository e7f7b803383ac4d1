#include "planar_vslam/sim/truth_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "planar_vslam/sim/solids.h"

namespace planar_vslam {
namespace {

constexpr int kWallCells = 2;  // thickness of the ring around the room

// Marks the cells of the polygon's bounding box that it overlaps.
void Fill(const std::vector<Eigen::Vector2d>& polygon, TruthGrid* grid) {
  Eigen::Vector2d low = polygon[0], high = polygon[0];
  for (const Eigen::Vector2d& p : polygon) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const auto cell = [grid](double offset, int count) {
    return std::clamp(static_cast<int>(std::floor(offset / grid->resolution)), 0, count - 1);
  };
  const Eigen::Vector2d first = low - grid->origin, last = high - grid->origin;
  for (int y = cell(first.y(), grid->height); y <= cell(last.y(), grid->height); ++y) {
    for (int x = cell(first.x(), grid->width); x <= cell(last.x(), grid->width); ++x) {
      const Eigen::Vector2d corner = grid->origin + grid->resolution * Eigen::Vector2d(x, y);
      if (OverlapsSquare(polygon, corner, grid->resolution))
        grid->occupied[static_cast<std::size_t>(y * grid->width + x)] = 1;
    }
  }
}

}  // namespace

TruthGrid MakeTruthGrid(const World& world, double low, double high) {
  TruthGrid grid;
  const double length = world.room.size.x(), depth = world.room.size.y();
  const auto cells = [&grid](double metres) {
    return static_cast<int>(std::ceil(metres / grid.resolution - 1e-9)) + 2 * kWallCells;
  };
  grid.width = cells(length);
  grid.height = cells(depth);
  grid.origin.setConstant(-kWallCells * grid.resolution);
  grid.occupied.assign(static_cast<std::size_t>(grid.width * grid.height), 0);
  const double thick = kWallCells * grid.resolution, east = length + 2 * thick, north = depth + 2 * thick;
  const auto rectangle = [](double x0, double y0, double x1, double y1) {
    return std::vector<Eigen::Vector2d>{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  };
  Fill(rectangle(-thick, -thick, east, 0), &grid);
  Fill(rectangle(-thick, depth, east, north), &grid);
  Fill(rectangle(-thick, -thick, 0, north), &grid);
  Fill(rectangle(length, -thick, east, north), &grid);
  for (const Prism& solid : MakeSolids(world.objects)) {
    if (solid.MeetsBand(low, high)) Fill(solid.footprint, &grid);
  }
  return grid;
}

Expected<bool> WriteTruthGrid(const TruthGrid& grid, const std::filesystem::path& yaml_path) {
  constexpr char kOccupied = 0, kFree = static_cast<char>(254);
  std::filesystem::path image_path = yaml_path;
  image_path.replace_extension(".pgm");
  std::ofstream image(image_path, std::ios::binary);
  image << fmt::format("P5\n{} {}\n255\n", grid.width, grid.height);
  for (int y = grid.height - 1; y >= 0; --y) {  // the picture's first row is the map's last
    for (int x = 0; x < grid.width; ++x) image.put(grid.Occupied(x, y) ? kOccupied : kFree);
  }
  std::ofstream yaml(yaml_path);
  yaml << fmt::format(
      "image: {}\nresolution: {}\norigin: [{}, {}, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
      image_path.filename().string(), grid.resolution, grid.origin.x(), grid.origin.y());
  for (auto* file : {&image, &yaml}) {
    file->close();
    if (!*file) return Error{yaml_path.string() + ": cannot be written together with its pgm"};
  }
  return true;
}

}  // namespace planar_vslam
