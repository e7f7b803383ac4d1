#include "posts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr std::int8_t kOccupied = 100;
constexpr int kBucket = 10;  // cells, the side of a bucket

std::size_t Index(const OccupancyGrid2d& grid, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x);
}

}  // namespace

// The occupied cells that hang together with (x, y), marked as visited; none where it is visited or not occupied.
std::vector<Eigen::Vector2i> Posts::TakeBlob(int x, int y, std::vector<char>* visited) const {
  std::vector<Eigen::Vector2i> blob;
  const auto visit = [&](int u, int v) {
    if (!IsInside(grid_, u, v) || grid_.At(u, v) != kOccupied || (*visited)[Index(grid_, u, v)] != 0) return;
    (*visited)[Index(grid_, u, v)] = 1;
    blob.emplace_back(u, v);
  };
  visit(x, y);
  for (std::size_t next = 0; next < blob.size(); ++next) {
    const Eigen::Vector2i cell = blob[next];
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) visit(cell.x() + dx, cell.y() + dy);
    }
  }
  return blob;
}

Posts::Posts(const OccupancyGrid2d& grid, double max_extent) : grid_(grid), is_post_(grid.cells.size(), 0) {
  const int max_cells = static_cast<int>(std::lround(max_extent / grid.resolution));
  std::vector<char> visited(grid.cells.size(), 0);
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const std::vector<Eigen::Vector2i> blob = TakeBlob(x, y, &visited);
      if (blob.empty()) continue;
      Eigen::AlignedBox<int, 2> box;
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      for (const Eigen::Vector2i& cell : blob) {
        box.extend(cell);
        sum += CenterOf(grid, cell.x(), cell.y());
      }
      if (box.sizes().maxCoeff() + 1 > max_cells) continue;
      for (const Eigen::Vector2i& cell : blob) is_post_[Index(grid, cell.x(), cell.y())] = 1;
      centers_.emplace_back(sum / static_cast<double>(blob.size()));
    }
  }
  bucket_columns_ = grid.width / kBucket + 1;
  bucket_rows_ = grid.height / kBucket + 1;
  buckets_.resize(static_cast<std::size_t>(bucket_columns_) * static_cast<std::size_t>(bucket_rows_));
  for (std::size_t i = 0; i < centers_.size(); ++i) {
    const Eigen::Vector2i bucket = BucketOf(centers_[i]);
    buckets_[static_cast<std::size_t>(bucket.y() * bucket_columns_ + bucket.x())].push_back(static_cast<int>(i));
  }
}

// The nearest one, for places beyond the grid.
Eigen::Vector2i Posts::BucketOf(const Eigen::Vector2d& p) const {
  const Eigen::Array2d at = ((p - grid_.origin) / (kBucket * grid_.resolution)).array().floor();
  return at.max(0.0).min(Eigen::Array2d(bucket_columns_ - 1, bucket_rows_ - 1)).cast<int>();
}

std::vector<int> Posts::Within(const Eigen::Vector2d& p, double radius) const {
  std::vector<int> within;
  const Eigen::Vector2i low = BucketOf(p.array() - radius), high = BucketOf(p.array() + radius);
  for (int y = low.y(); y <= high.y(); ++y) {
    for (int x = low.x(); x <= high.x(); ++x) {
      for (const int i : buckets_[static_cast<std::size_t>(y * bucket_columns_ + x)]) {
        if ((centers_[static_cast<std::size_t>(i)] - p).norm() <= radius) within.push_back(i);
      }
    }
  }
  std::sort(within.begin(), within.end());
  return within;
}

bool Posts::IsBig(int x, int y) const {
  return IsInside(grid_, x, y) && grid_.At(x, y) == kOccupied && is_post_[Index(grid_, x, y)] == 0;
}

std::optional<Eigen::Vector2d> Posts::BigThingBehind(const Eigen::Vector2d& start, const Eigen::Vector2d& direction,
                                                     double reach) const {
  const double step = 0.5 * grid_.resolution;
  for (int i = 0; i * step <= reach; ++i) {
    const Eigen::Vector2d at = start + i * step * direction;
    const Eigen::Vector2i cell = CellAt(grid_, at);
    if (!IsInside(grid_, cell.x(), cell.y())) return std::nullopt;
    if (IsBig(cell.x(), cell.y())) return at;
  }
  return std::nullopt;
}

}  // namespace planar_vslam
