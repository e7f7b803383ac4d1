#include "planar_vslam/pipeline/map_coverage.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/map/predicted_view.h"

namespace planar_vslam {
namespace {

constexpr std::int8_t kFree = 0, kOccupied = 100;

class CoverageMaker {
 public:
  CoverageMaker(const Map& map, const CameraModel& camera, const OccupancyGrid2d& grid)
      : map_(map), camera_(camera), grid_(grid) {}

  std::vector<MapCoverage::Place> Places() const {
    std::vector<MapCoverage::Place> places;
    const Eigen::Vector2d extent = grid_.resolution * Eigen::Vector2d(grid_.width, grid_.height);
    for (double y = 0.5 * MapCoverage::kStep; y < extent.y(); y += MapCoverage::kStep) {
      for (double x = 0.5 * MapCoverage::kStep; x < extent.x(); x += MapCoverage::kStep) {
        const Eigen::Vector2d p_map = grid_.origin + Eigen::Vector2d(x, y);
        if (CanStand(p_map)) places.push_back({p_map, InView(p_map)});
      }
    }
    return places;
  }

 private:
  std::int8_t CellAt(const Eigen::Vector2d& p_map) const {
    constexpr std::int8_t kUnknown = -1;
    const Eigen::Vector2d cell = (p_map - grid_.origin) / grid_.resolution;
    const int x = static_cast<int>(std::floor(cell.x())), y = static_cast<int>(std::floor(cell.y()));
    const bool inside = x >= 0 && y >= 0 && x < grid_.width && y < grid_.height;
    return inside ? grid_.At(x, y) : kUnknown;
  }

  bool CanStand(const Eigen::Vector2d& p_map) const {
    if (CellAt(p_map) != kFree) return false;
    for (double y = -MapCoverage::kMargin; y <= MapCoverage::kMargin; y += grid_.resolution) {
      for (double x = -MapCoverage::kMargin; x <= MapCoverage::kMargin; x += grid_.resolution) {
        if (CellAt(p_map + Eigen::Vector2d(x, y)) == kOccupied) return false;
      }
    }
    return true;
  }

  const Keyframe& NearestKeyframe(const Eigen::Vector2d& p_map) const {
    const auto distance = [&](const auto& entry) {
      return (entry.second.T_map_base.translation.template head<2>() - p_map).squaredNorm();
    };
    return std::min_element(map_.keyframes.begin(), map_.keyframes.end(),
                            [&](const auto& a, const auto& b) { return distance(a) < distance(b); })
        ->second;
  }

  std::array<int, MapCoverage::kHeadings> InView(const Eigen::Vector2d& p_map) const {
    const Keyframe& nearest = NearestKeyframe(p_map);
    std::array<int, MapCoverage::kHeadings> counts{};
    for (int k = 0; k < MapCoverage::kHeadings; ++k) {
      Rigid3 T_map_base = Embed3(Rigid2(p_map, 2.0 * M_PI * k / MapCoverage::kHeadings));
      T_map_base.translation.z() = nearest.T_map_base.translation.z();
      const Rigid3 T_map_camera = T_map_base * nearest.T_base_camera;
      PredictedView view;
      for (const auto& [id, landmark] : map_.landmarks) {
        if (PredictView(landmark, T_map_camera, camera_, map_.octave_scales, &view) &&
            IsClear(T_map_camera.translation, landmark)) {
          ++counts[static_cast<std::size_t>(k)];
        }
      }
    }
    return counts;
  }

  // Whether nothing stands between the camera and the landmark, as far as grid and map tell.
  bool IsClear(const Eigen::Vector3d& p_map_camera, const Landmark& landmark) const {
    constexpr double kBeside = 1.0;  // m
    for (const Observation& o : landmark.observations) {
      const Rigid3 T_map_camera = map_.keyframes.At(o.keyframe).T_map_camera();
      if ((T_map_camera.translation - p_map_camera).head<2>().norm() < kBeside) return true;
    }
    constexpr double kSurface = 0.3;  // m before it: what it stands on or lies against
    const Eigen::Vector2d from = p_map_camera.head<2>(), way = landmark.p_map.head<2>() - from;
    const double length = way.norm();
    for (double s = 0.0; s < length - kSurface; s += grid_.resolution) {
      if (CellAt(from + way * (s / length)) == kOccupied) return false;
    }
    return true;
  }

  const Map& map_;
  const CameraModel& camera_;
  const OccupancyGrid2d& grid_;
};

}  // namespace

int MapCoverage::Place::Good() const {
  return static_cast<int>(std::count_if(in_view.begin(), in_view.end(), [](int count) { return count >= kEnough; }));
}

double MapCoverage::Share() const {
  double good = 0.0;
  for (const Place& place : places) good += place.Good();
  return places.empty() ? 0.0 : good / (kHeadings * static_cast<double>(places.size()));
}

double MapCoverage::ShareOfPlaces(int headings) const {
  const auto good = std::count_if(places.begin(), places.end(), [&](const Place& p) { return p.Good() >= headings; });
  return places.empty() ? 0.0 : static_cast<double>(good) / static_cast<double>(places.size());
}

std::array<double, MapCoverage::kHeadings> MapCoverage::ByHeading() const {
  std::array<double, kHeadings> shares{};
  for (const Place& place : places) {
    for (std::size_t k = 0; k < shares.size(); ++k)
      shares[k] += place.in_view[k] >= kEnough ? 1.0 / static_cast<double>(places.size()) : 0.0;
  }
  return shares;
}

MapCoverage CoverageOf(const Map& map, const CameraModel& camera, const OccupancyGrid2d& grid) {
  MapCoverage coverage;
  if (!map.keyframes.empty()) coverage.places = CoverageMaker(map, camera, grid).Places();
  return coverage;
}

}  // namespace planar_vslam
