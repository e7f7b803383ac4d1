#include "planar_vslam/mapping2d/grid_score.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

constexpr int kWrongOccupiedDistance = 3;  // cells, from the definition of wrong_occupied
constexpr std::int8_t kFree = 0;
constexpr std::int8_t kOccupied = 100;
constexpr std::int8_t kUnknown = -1;

bool Inside(const OccupancyGrid2d& grid, int x, int y) { return x >= 0 && y >= 0 && x < grid.width && y < grid.height; }

std::size_t Index(const OccupancyGrid2d& grid, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x);
}

Eigen::Vector2i CellAt(const OccupancyGrid2d& grid, const Eigen::Vector2d& p) {
  return ((p - grid.origin) / grid.resolution).array().floor().cast<int>();
}

// The estimate in the truth's cells: each takes the value under its centre.
OccupancyGrid2d Resample(const OccupancyGrid2d& estimate, const OccupancyGrid2d& truth,
                         const Rigid2& T_truth_estimate) {
  OccupancyGrid2d result = truth;
  const Rigid2 T_estimate_truth = T_truth_estimate.Inverse();
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      const Eigen::Vector2d centre = truth.origin + truth.resolution * Eigen::Vector2d(x + 0.5, y + 0.5);
      const Eigen::Vector2i cell = CellAt(estimate, T_estimate_truth * centre);
      result.cells[Index(result, x, y)] =
          Inside(estimate, cell.x(), cell.y()) ? estimate.At(cell.x(), cell.y()) : kUnknown;
    }
  }
  return result;
}

// Whether a cell of `value` lies within `distance` cells (Chebyshev).
bool HasWithin(const OccupancyGrid2d& grid, int x, int y, int distance, std::int8_t value) {
  for (int v = y - distance; v <= y + distance; ++v) {
    for (int u = x - distance; u <= x + distance; ++u) {
      if (Inside(grid, u, v) && grid.At(u, v) == value) return true;
    }
  }
  return false;
}

bool IsSurface(const OccupancyGrid2d& truth, int x, int y) {
  const auto is_free = [&](int u, int v) { return Inside(truth, u, v) && truth.At(u, v) == kFree; };
  return truth.At(x, y) == kOccupied &&
         (is_free(x - 1, y) || is_free(x + 1, y) || is_free(x, y - 1) || is_free(x, y + 1));
}

// 1 for each free cell of the truth that the path reaches through free cells; all free cells without a path.
std::vector<char> ReachableFree(const OccupancyGrid2d& truth, const std::vector<Eigen::Vector2d>& path) {
  std::vector<char> reached(truth.cells.size(), 0);
  if (path.empty()) {
    for (std::size_t i = 0; i < truth.cells.size(); ++i) reached[i] = truth.cells[i] == kFree ? 1 : 0;
    return reached;
  }
  std::vector<Eigen::Vector2i> open;
  const auto visit = [&](int x, int y) {
    if (!Inside(truth, x, y) || truth.At(x, y) != kFree || reached[Index(truth, x, y)] != 0) return;
    reached[Index(truth, x, y)] = 1;
    open.emplace_back(x, y);
  };
  for (const Eigen::Vector2d& p : path) {
    const Eigen::Vector2i cell = CellAt(truth, p);
    visit(cell.x(), cell.y());
  }
  while (!open.empty()) {
    const Eigen::Vector2i cell = open.back();
    open.pop_back();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) visit(cell.x() + dx, cell.y() + dy);
    }
  }
  return reached;
}

// Marks the occupied cells that straight lines from the path meet within `range` m.
OccupancyGrid2d Seen(const OccupancyGrid2d& truth, const std::vector<Eigen::Vector2d>& path, double range) {
  constexpr double kStride = 0.25;                           // m along the path: what is seen from one place but not...
  const double reach = std::ceil(range / truth.resolution);  // ...from the next is a sliver. Cells.
  const int lines = static_cast<int>(4.0 * M_PI * reach);    // half a cell apart at their ends
  OccupancyGrid2d seen = truth;
  std::fill(seen.cells.begin(), seen.cells.end(), kUnknown);
  Eigen::Vector2d last = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  for (const Eigen::Vector2d& from : path) {
    if ((from - last).norm() < kStride) continue;
    last = from;
    for (int line = 0; line < lines; ++line) {
      const double angle = 2.0 * M_PI * line / lines;
      const Eigen::Vector2d step = 0.5 * truth.resolution * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      for (int i = 0; i <= static_cast<int>(2.0 * reach); ++i) {
        const Eigen::Vector2i cell = CellAt(truth, from + i * step);
        if (!Inside(truth, cell.x(), cell.y())) break;
        if (truth.At(cell.x(), cell.y()) != kOccupied) continue;
        seen.cells[Index(seen, cell.x(), cell.y())] = kOccupied;
        break;
      }
    }
  }
  return seen;
}

double Share(long part, long whole) { return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0; }

}  // namespace

GridScore ScoreGrid(const OccupancyGrid2d& estimate, const OccupancyGrid2d& truth, const Rigid2& T_truth_estimate,
                    const std::vector<Eigen::Vector2d>& path, const GridScoreOptions& options) {
  PV_CHECK(options.tolerance_cells >= 0, "tolerance_cells=" << options.tolerance_cells);
  PV_CHECK(options.sight_range > 0.0, "sight_range=" << options.sight_range);
  const int r = options.tolerance_cells;
  const OccupancyGrid2d ours = Resample(estimate, truth, T_truth_estimate);
  const std::vector<char> reachable = ReachableFree(truth, path);
  const OccupancyGrid2d seen = path.empty() ? truth : Seen(truth, path, options.sight_range);

  GridScore score;
  long common = 0, either = 0, precise = 0, recalled = 0, in_sight = 0, wrong_free = 0, wrong_occupied = 0, known = 0;
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      const std::int8_t our = ours.At(x, y), true_cell = truth.At(x, y);
      common += our == kOccupied && true_cell == kOccupied ? 1 : 0;
      either += our == kOccupied || true_cell == kOccupied ? 1 : 0;
      if (our == kOccupied) {
        ++score.our_occupied;
        precise += HasWithin(truth, x, y, r, kOccupied) ? 1 : 0;
        wrong_occupied += HasWithin(truth, x, y, kWrongOccupiedDistance, kOccupied) ? 0 : 1;
      } else if (our == kFree) {
        ++score.our_free;
        wrong_free += true_cell == kOccupied && !HasWithin(truth, x, y, r, kFree) ? 1 : 0;
      }
      if (IsSurface(truth, x, y)) {
        ++score.truth_surface;
        recalled += HasWithin(ours, x, y, r, kOccupied) ? 1 : 0;
        in_sight += HasWithin(seen, x, y, r, kOccupied) ? 1 : 0;
      }
      if (reachable[Index(truth, x, y)] != 0) {
        ++score.truth_reachable_free;
        known += our != kUnknown ? 1 : 0;
      }
    }
  }
  score.iou = Share(common, either);
  score.precision = Share(precise, score.our_occupied);
  score.recall = Share(recalled, score.truth_surface);
  score.in_sight = Share(in_sight, score.truth_surface);
  score.wrong_free = Share(wrong_free, score.our_free);
  score.wrong_occupied = Share(wrong_occupied, score.our_occupied);
  score.known = Share(known, score.truth_reachable_free);
  return score;
}

}  // namespace planar_vslam
