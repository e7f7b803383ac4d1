#include "occupancy_layer.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

std::uint64_t Pack(const octomap::OcTreeKey& key) {
  return (std::uint64_t{key[0]} << 32U) | (std::uint64_t{key[1]} << 16U) | std::uint64_t{key[2]};
}

octomap::OcTreeKey Unpack(std::uint64_t packed) {
  return {static_cast<octomap::key_type>((packed >> 32U) & 0xFFFFU),
          static_cast<octomap::key_type>((packed >> 16U) & 0xFFFFU), static_cast<octomap::key_type>(packed & 0xFFFFU)};
}

octomap::point3d ToOctomap(const Eigen::Vector3d& p) {
  const Eigen::Vector3f f = p.cast<float>();
  return {f.x(), f.y(), f.z()};
}

}  // namespace

double LogOdds(double probability) { return std::log(probability / (1.0 - probability)); }

OccupancyLayer::OccupancyLayer(const SensorModel& model, double resolution, double clamp_min, double clamp_max)
    : tree_(resolution),
      free_log_odds_(static_cast<float>(LogOdds(model.p_miss))),
      hit_log_odds_(LogOdds(model.p_hit)) {
  tree_.setClampingThresMin(clamp_min);
  tree_.setClampingThresMax(clamp_max);
}

void OccupancyLayer::AddFreeRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const octomap::point3d start = ToOctomap(from), end = ToOctomap(to);
  octomap::OcTreeKey ignored;
  // Asked first, because computeRayKeys prints a warning for each such ray.
  if (!tree_.coordToKeyChecked(start, ignored) || !tree_.coordToKeyChecked(end, ignored)) return;
  tree_.computeRayKeys(start, end, ray_);
  for (const octomap::OcTreeKey& key : ray_) free_.push_back(Pack(key));
}

void OccupancyLayer::AddHit(const Eigen::Vector3d& point, double weight) {
  octomap::OcTreeKey key;
  if (!tree_.coordToKeyChecked(ToOctomap(point), key)) return;
  hits_.emplace_back(Pack(key), static_cast<float>(weight * hit_log_odds_));
}

void OccupancyLayer::Commit() {
  // Sorted, so that the tree is walked in order and the same evidence gives the same tree however it was collected.
  std::sort(free_.begin(), free_.end());
  free_.erase(std::unique(free_.begin(), free_.end()), free_.end());
  std::sort(hits_.begin(), hits_.end());
  auto hit = hits_.begin();
  for (const PackedKey voxel : free_) {
    while (hit != hits_.end() && hit->first < voxel) ++hit;
    if (hit != hits_.end() && hit->first == voxel) continue;
    tree_.updateNode(Unpack(voxel), free_log_odds_, /*lazy_eval=*/true);
  }
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    const bool heaviest = i + 1 == hits_.size() || hits_[i + 1].first != hits_[i].first;
    if (heaviest) tree_.updateNode(Unpack(hits_[i].first), hits_[i].second, /*lazy_eval=*/true);
  }
  free_.clear();
  hits_.clear();
}

}  // namespace planar_vslam
