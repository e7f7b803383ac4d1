#pragma once
// Small things that stand alone in a slice of the world: legs of furniture, for one.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam {

inline bool IsInside(const OccupancyGrid2d& grid, int x, int y) {
  return x >= 0 && y >= 0 && x < grid.width && y < grid.height;
}
inline Eigen::Vector2d CenterOf(const OccupancyGrid2d& grid, int x, int y) {
  return grid.origin + grid.resolution * Eigen::Vector2d(x + 0.5, y + 0.5);
}
inline Eigen::Vector2i CellAt(const OccupancyGrid2d& grid, const Eigen::Vector2d& p) {
  return ((p - grid.origin) / grid.resolution).array().floor().cast<int>();
}

class Posts {
 public:
  // Occupied cells that hang together (8 neighbours) within a square of `max_extent` m.
  Posts(const OccupancyGrid2d& grid, double max_extent);

  const std::vector<Eigen::Vector2d>& centers() const { return centers_; }  // m, from the lowest row up
  // Numbers of the centers within `radius` m of `p`, ascending.
  std::vector<int> Within(const Eigen::Vector2d& p, double radius) const;
  // Whether the cell is occupied by something bigger than a post, as a wall.
  bool IsBig(int x, int y) const;
  // Where the straight way from `start` along the unit vector `direction` meets something big, within `reach` m.
  std::optional<Eigen::Vector2d> BigThingBehind(const Eigen::Vector2d& start, const Eigen::Vector2d& direction,
                                                double reach) const;

 private:
  std::vector<Eigen::Vector2i> TakeBlob(int x, int y, std::vector<char>* visited) const;

  Eigen::Vector2i BucketOf(const Eigen::Vector2d& p) const;

  const OccupancyGrid2d& grid_;
  std::vector<Eigen::Vector2d> centers_;
  std::vector<char> is_post_;              // of each cell
  std::vector<std::vector<int>> buckets_;  // centers by place, row-major
  int bucket_columns_ = 0, bucket_rows_ = 0;
};

}  // namespace planar_vslam
