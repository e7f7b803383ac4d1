#pragma once
// The cells that the beams of a level scan saw through, in one dense window: scans are many, and their beams cross the
// same cells near the laser again and again.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sighting.h"

namespace planar_vslam {

class LevelFan {
 public:
  explicit LevelFan(double resolution) : voxels_per_meter_(1.0 / resolution) {}

  // Beams of up to `reach` m from `origin`, at its height. False where some might leave the lattice.
  bool Start(const Eigen::Vector3d& origin, double reach);
  // Cells from the origin up to, not including, the one that holds `to` were seen through. In whole numbers, so that
  // no cell waits for the one before.
  void AddFreeRay(const Eigen::Vector3d& to);
  void AddTo(Sighting* sighting) const;

 private:
  double voxels_per_meter_;
  Eigen::Vector2d start_ = Eigen::Vector2d::Zero();  // cells, from the window's corner
  VoxelIndex corner_;                                // of the window, at the corner of a block
  std::int32_t side_ = 0;                            // cells, whole blocks
  std::vector<std::uint8_t> marks_;                  // row-major, 0 or Sighting::kFree
};

}  // namespace planar_vslam
