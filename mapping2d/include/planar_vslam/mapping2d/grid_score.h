#pragma once
// How well a grid agrees with a true one.
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam {

// Shares in [0, 1]; 0 where there is nothing to divide by.
struct GridScore {
  double iou = 0.0;             // occupied cells, exact
  double precision = 0.0;       // our occupied cells with a truly occupied cell within r
  double recall = 0.0;          // true surface cells (occupied, 4-next to free) with one of ours within r
  double in_sight = 0.0;        // the recall of what the path had in sight: a perfect range sensor's
  double wrong_free = 0.0;      // our free cells truly occupied with no truly free cell within r / our free cells
  double wrong_occupied = 0.0;  // our occupied cells with no truly occupied cell within 3 cells / our occupied cells
  double known = 0.0;           // truth's free cells reachable from the path that we call free or occupied
  long our_occupied = 0, our_free = 0, truth_surface = 0, truth_reachable_free = 0;
};

struct GridScoreOptions {
  int tolerance_cells = 1;   // r, Chebyshev distance in cells of the truth
  double sight_range = 8.0;  // m, how far the path sees, all round: the navigation map's use of a laser
};

// `estimate` is brought to the truth's cells through T_truth_estimate (each truth cell takes the estimate's cell under
// its centre). `path` holds positions in the truth frame from which free space must be reachable (8-connected through
// true free cells) and surfaces be seen; when empty all count.
GridScore ScoreGrid(const OccupancyGrid2d& estimate, const OccupancyGrid2d& truth, const Rigid2& T_truth_estimate,
                    const std::vector<Eigen::Vector2d>& path, const GridScoreOptions& options);

}  // namespace planar_vslam
