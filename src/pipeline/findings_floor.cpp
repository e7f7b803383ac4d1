#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "findings_parts.h"
#include "planar_vslam/geometry/median.h"

namespace planar_vslam {
namespace {

// Heights of the landmarks where the base itself has been: there is nothing but floor.
std::vector<double> HeightsOnTheWay(const Map& map) {
  constexpr double kBeside = 0.25, kHighest = 0.35;  // m, half a small base; what a height may be wrong by
  constexpr std::size_t kFewestObservations = 3;
  std::vector<Eigen::Vector2d> way;
  for (const auto& [id, keyframe] : map.keyframes) way.emplace_back(keyframe.T_map_base.translation.head<2>());
  std::vector<double> heights;
  for (const auto& [id, landmark] : map.landmarks) {
    if (landmark.observations.size() < kFewestObservations || std::abs(landmark.p_map.z()) > kHighest) continue;
    const Eigen::Vector2d place = landmark.p_map.head<2>();
    const bool on_way = std::any_of(way.begin(), way.end(), [&place](const Eigen::Vector2d& driven) {
      return (driven - place).squaredNorm() < kBeside * kBeside;
    });
    if (on_way) heights.push_back(landmark.p_map.z());
  }
  return heights;
}

// Where most of them agree on one.
std::optional<double> LevelOf(const std::vector<double>& heights) {
  constexpr std::size_t kFewest = 12;
  constexpr double kFlat = 0.02;  // m, half of all are at most so far from the middle
  if (heights.size() < kFewest) return std::nullopt;
  const double level = Median(heights);
  std::vector<double> off;
  for (const double height : heights) off.push_back(std::abs(height - level));
  return Median(off) < kFlat ? std::optional<double>(level) : std::nullopt;
}

}  // namespace

bool AddHeight(const FindingsInput& in, Found* found) {
  constexpr double kLeast = 0.03, kMostlyOnFloor = 0.2;  // m; share off it
  if (!in.has_base || in.map == nullptr || !in.map->metric || OffFloor(in.map) > kMostlyOnFloor) return false;
  const auto& mount = in.input.T_base_camera();
  const std::optional<double> level = LevelOf(HeightsOnTheWay(*in.map));
  if (!mount.has_value() || !level.has_value() || std::abs(*level) < kLeast) return false;
  const double height = mount->translation.z();
  found->push_back(
      {Harm::kBent, "mount",
       fmt::format("the floor that the images show is {:.0f} cm {} where the camera's height in tf puts it: the camera "
                   "is about {:.2f} m over the floor, not {:.2f}; correct its height in tf",
                   100.0 * std::abs(*level), *level > 0.0 ? "above" : "below", height - *level, height)});
  return true;
}

}  // namespace planar_vslam
