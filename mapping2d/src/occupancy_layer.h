#pragma once
// The voxels one kind of sensor has seen, as clamped log-odds (the update rule of OctoMap: Hornung et al. 2013, Eq. 4).
// Evidence is collected for one observation (a scan, a keyframe), then committed: each voxel changes once, and occupied
// wins over free. Rays cross most voxels many times, so they live in a table; an octree is made of them for export.
#include <octomap/octomap.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "planar_vslam/mapping2d/map_builder.h"
#include "voxel_table.h"

namespace planar_vslam {

// log(p / (1 - p))
double LogOdds(double probability);

VoxelKey Pack(const octomap::OcTreeKey& key);
octomap::OcTreeKey Unpack(VoxelKey key);

class OccupancyLayer {
 public:
  OccupancyLayer(const SensorModel& model, double resolution, double clamp_min, double clamp_max);

  // Voxels from `from` up to, not including, the one that holds `to` were seen through. A ray that leaves the lattice
  // (32768 voxels each way from the origin) is ignored.
  void AddFreeRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  // The voxel of `point` was hit, with `weight` in [0, 1] of the sensor model's evidence; of several hits on a voxel
  // the heaviest counts.
  void AddHit(const Eigen::Vector3d& point, double weight);
  void Commit();

  const VoxelTable& table() const { return table_; }

 private:
  Voxel& Touch(const octomap::OcTreeKey& key);

  octomap::OcTree lattice_;  // stays empty: casts rays and makes keys
  octomap::KeyRay ray_;
  float free_log_odds_, hit_log_odds_, min_log_odds_, max_log_odds_;
  VoxelTable table_;
  std::uint32_t observation_ = 1;
  std::vector<std::uint32_t> touched_;  // indices of the voxels of the observation in progress, each once
};

}  // namespace planar_vslam
