#include "planar_vslam/planar/floor_points.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/median.h"

namespace planar_vslam {
namespace {

constexpr double kSearch = 0.06;     // m, how far from z = 0 the map may have put the floor
constexpr double kStep = 0.005;      // m, between the levels tried
constexpr double kThickness = 0.02;  // m, either side of a level: flatness and noise of well-seen points
constexpr double kTolerance = 0.03;  // m, either side of the floor: what belongs to it
constexpr double kPlace = 0.25;      // m, side of a place
constexpr std::size_t kMinPlaces = 20;
constexpr double kContrast = 1.5;  // times the places at the levels around, for a floor and not clutter

std::size_t PlacesAt(const std::vector<Eigen::Vector3d>& points, double level) {
  std::vector<std::pair<long, long>> places;
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(p.z() - level) <= kThickness) {
      places.emplace_back(std::lround(p.x() / kPlace), std::lround(p.y() / kPlace));
    }
  }
  std::sort(places.begin(), places.end());
  return static_cast<std::size_t>(std::unique(places.begin(), places.end()) - places.begin());
}

// The level that the points at it have in the middle: finer than the levels tried.
double MedianLevel(const std::vector<Eigen::Vector3d>& points, double level) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> heights;
    for (const Eigen::Vector3d& p : points) {
      if (std::abs(p.z() - level) <= kThickness) heights.push_back(p.z());
    }
    level = Median(std::move(heights));
  }
  return level;
}

}  // namespace

FloorPoints FindFloorPoints(const std::vector<Eigen::Vector3d>& points) {
  FloorPoints floor;
  std::size_t best = 0;
  for (int k = 0; k <= static_cast<int>(std::lround(kSearch / kStep)); ++k) {
    for (const double level : {k * kStep, -k * kStep}) {  // from the middle outwards: of equals, the nearest wins
      const std::size_t places = PlacesAt(points, level);
      if (places <= best) continue;
      best = places;
      floor.level = level;
    }
  }
  constexpr double kBeside = 2.5 * kThickness;
  const double around =
      0.5 * static_cast<double>(PlacesAt(points, floor.level - kBeside) + PlacesAt(points, floor.level + kBeside));
  if (best < kMinPlaces || static_cast<double>(best) < kContrast * around) return {};
  floor.level = MedianLevel(points, floor.level);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::abs(points[i].z() - floor.level) <= kTolerance) floor.indices.push_back(i);
  }
  return floor;
}

bool FloorPointFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  residuals[0] = parameters[0][2] / sigma_;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    jacobians[0][0] = jacobians[0][1] = 0.0;
    jacobians[0][2] = 1.0 / sigma_;
  }
  return true;
}

}  // namespace planar_vslam
