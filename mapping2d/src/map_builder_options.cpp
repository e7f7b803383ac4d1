#include <cmath>

#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam {

std::vector<std::string> MapBuilderOptions::Problems() const {
  std::vector<std::string> problems;
  const auto require = [&](bool holds, const std::string& problem) {
    if (!holds) problems.push_back(problem);
  };
  const auto finite_above = [](double value, double bound) { return std::isfinite(value) && value > bound; };
  require(finite_above(resolution, 0.0), "resolution: expected metres above 0");
  require(visual.p_hit > 0.5 && visual.p_hit < 1.0, "visual.p_hit: expected a probability above 0.5");
  require(visual.p_miss > 0.0 && visual.p_miss < 0.5, "visual.p_miss: expected a probability below 0.5");
  require(laser.p_hit > 0.5 && laser.p_hit < 1.0, "laser.p_hit: expected a probability above 0.5");
  require(laser.p_miss > 0.0 && laser.p_miss < 0.5, "laser.p_miss: expected a probability below 0.5");
  require(occupied_threshold >= 0.5 && occupied_threshold < 1.0, "occupied_threshold: expected a probability from 0.5");
  require(free_threshold > 0.0 && free_threshold <= 0.5, "free_threshold: expected a probability up to 0.5");
  require(clamp_min > 0.0 && clamp_min < free_threshold, "clamp_min: expected a probability below free_threshold");
  require(clamp_max > occupied_threshold && clamp_max < 1.0,
          "clamp_max: expected a probability above occupied_threshold");
  require(finite_above(visual_range, 0.0), "visual_range: expected metres above 0");
  require(finite_above(visual_hit_sigma, 0.0), "visual_hit_sigma: expected metres above 0");
  require(finite_above(laser_range, 0.0), "laser_range: expected metres above 0");
  require(std::isfinite(floor_tolerance) && floor_tolerance >= 0.0, "floor_tolerance: expected metres, not negative");
  require(finite_above(band_max, band_min) && band_min >= 0.0, "band_min, band_max: expected 0 <= band_min < band_max");
  require(std::isfinite(footprint_radius) && footprint_radius >= 0.0,
          "footprint_radius: expected metres, not negative");
  require(tilt_sigma_deg >= 0.0 && tilt_sigma_deg < 45.0, "tilt_sigma_deg: expected degrees, from 0");
  for (const std::string& problem : overhang.Problems()) problems.push_back(problem);
  for (const std::string& problem : legged.Problems()) problems.push_back(problem);
  return problems;
}

}  // namespace planar_vslam
