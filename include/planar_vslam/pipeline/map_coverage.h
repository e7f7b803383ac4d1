#pragma once
// From which places and headings a saved map can be localised in by sight: on a lattice of the grid's free cells, for
// each of eight headings, how many landmarks should be in view. A landmark is where it is in the image, at a distance
// and an angle from which it was seen before (predicted_view.h), and nothing that the grid holds stands before it,
// unless a camera that saw it was beside the place.
#include <array>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

struct MapCoverage {
  static constexpr int kHeadings = 8;     // heading k is k * 45 degrees, counterclockwise from x
  static constexpr double kStep = 0.5;    // m between places
  static constexpr double kMargin = 0.2;  // m from the next obstacle: nearer no robot stands
  // Landmarks in view that are enough: of these a view of another day shows 30 per cent, and so the 12 that fix a pose
  // (place_limits.h).
  static constexpr int kEnough = 40;

  struct Place {
    Eigen::Vector2d p_map = Eigen::Vector2d::Zero();
    std::array<int, kHeadings> in_view{};  // landmarks

    int Good() const;  // headings with enough
  };
  std::vector<Place> places;

  double Share() const;                             // of all places and headings
  double ShareOfPlaces(int headings) const;         // where at least so many headings have enough
  std::array<double, kHeadings> ByHeading() const;  // share of the places
};

// `map` metric, `grid` made of it. The camera stands on the base as on that of the nearest keyframe.
MapCoverage CoverageOf(const Map& map, const CameraModel& camera, const OccupancyGrid2d& grid);

}  // namespace planar_vslam
