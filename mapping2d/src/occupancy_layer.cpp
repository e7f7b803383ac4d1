#include "occupancy_layer.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr float kNotHit = -1.0F;  // hits are evidence from 0 up

octomap::point3d ToOctomap(const Eigen::Vector3d& p) {
  const Eigen::Vector3f f = p.cast<float>();
  return {f.x(), f.y(), f.z()};
}

float FloatLogOdds(double probability) { return static_cast<float>(LogOdds(probability)); }

}  // namespace

double LogOdds(double probability) { return std::log(probability / (1.0 - probability)); }

VoxelKey Pack(const octomap::OcTreeKey& key) {
  return (VoxelKey{key[0]} << 32U) | (VoxelKey{key[1]} << 16U) | VoxelKey{key[2]};
}

octomap::OcTreeKey Unpack(VoxelKey key) {
  return {static_cast<octomap::key_type>((key >> 32U) & 0xFFFFU),
          static_cast<octomap::key_type>((key >> 16U) & 0xFFFFU), static_cast<octomap::key_type>(key & 0xFFFFU)};
}

OccupancyLayer::OccupancyLayer(const SensorModel& model, double resolution, double clamp_min, double clamp_max)
    : lattice_(resolution),
      free_log_odds_(FloatLogOdds(model.p_miss)),
      hit_log_odds_(FloatLogOdds(model.p_hit)),
      min_log_odds_(FloatLogOdds(clamp_min)),
      max_log_odds_(FloatLogOdds(clamp_max)) {}

Voxel& OccupancyLayer::Touch(const octomap::OcTreeKey& key) {
  const std::uint32_t index = table_.FindOrInsert(Pack(key));
  Voxel& voxel = table_[index];
  if (voxel.observation != observation_) {
    voxel.observation = observation_;
    voxel.hit = kNotHit;
    touched_.push_back(index);
  }
  return voxel;
}

void OccupancyLayer::AddFreeRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const octomap::point3d start = ToOctomap(from), end = ToOctomap(to);
  octomap::OcTreeKey ignored;
  // Asked first, because computeRayKeys prints a warning for each such ray.
  if (!lattice_.coordToKeyChecked(start, ignored) || !lattice_.coordToKeyChecked(end, ignored)) return;
  lattice_.computeRayKeys(start, end, ray_);
  for (const octomap::OcTreeKey& key : ray_) Touch(key);
}

void OccupancyLayer::AddHit(const Eigen::Vector3d& point, double weight) {
  octomap::OcTreeKey key;
  if (!lattice_.coordToKeyChecked(ToOctomap(point), key)) return;
  Voxel& voxel = Touch(key);
  voxel.hit = std::max(voxel.hit, static_cast<float>(weight) * hit_log_odds_);
}

void OccupancyLayer::Commit() {
  for (const std::uint32_t index : touched_) {
    Voxel& voxel = table_[index];
    const float evidence = voxel.hit == kNotHit ? free_log_odds_ : voxel.hit;
    voxel.log_odds = std::clamp(voxel.log_odds + evidence, min_log_odds_, max_log_odds_);
  }
  touched_.clear();
  ++observation_;
}

}  // namespace planar_vslam
