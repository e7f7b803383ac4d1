#pragma once
// The voxels one kind of sensor has seen, as clamped log-odds in an OctoMap tree. Evidence is collected for one
// observation (a scan, a keyframe), then committed: each voxel changes once, and occupied wins over free.
#include <octomap/octomap.h>

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam {

// log(p / (1 - p))
double LogOdds(double probability);

class OccupancyLayer {
 public:
  OccupancyLayer(const SensorModel& model, double resolution, double clamp_min, double clamp_max);

  // Voxels from `from` up to, not including, the one that holds `to` were seen through. A ray that leaves the tree's
  // range (32768 voxels each way from the origin) is ignored.
  void AddFreeRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  // The voxel of `point` was hit, with `weight` in [0, 1] of the sensor model's evidence; of several hits on a voxel
  // the heaviest counts.
  void AddHit(const Eigen::Vector3d& point, double weight);
  void Commit();

  const octomap::OcTree& tree() const { return tree_; }

 private:
  using PackedKey = std::uint64_t;

  octomap::OcTree tree_;
  float free_log_odds_;
  double hit_log_odds_;
  octomap::KeyRay ray_;
  std::vector<PackedKey> free_;
  std::vector<std::pair<PackedKey, float>> hits_;  // voxel, log-odds
};

}  // namespace planar_vslam
