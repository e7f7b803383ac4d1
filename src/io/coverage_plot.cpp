#include "planar_vslam/io/coverage_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "svg_panel.h"

namespace planar_vslam {
namespace {

constexpr double kWidth = 900.0, kHeight = 960.0;  // px
constexpr io::PixelBox kView{70.0, 80.0, 800.0, 800.0};
constexpr const char *kGood = "#1a9641", *kBad = "#f2b8ae";

std::string StarAt(const io::SvgPanel& panel, const MapCoverage::Place& place) {
  constexpr double kInner = 0.05, kOuter = 0.21;  // m
  std::string star;
  for (const bool good : {false, true}) {  // green above red
    for (int k = 0; k < MapCoverage::kHeadings; ++k) {
      if ((place.in_view[static_cast<std::size_t>(k)] >= MapCoverage::kEnough) != good) continue;
      const double angle = 2.0 * M_PI * k / MapCoverage::kHeadings;
      const Eigen::Vector2d along(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d from = place.p_map + kInner * along, to = place.p_map + kOuter * along;
      star += panel.Line({{from.x(), from.y()}, {to.x(), to.y()}}, good ? kGood : kBad, good ? 2.5 : 1.5);
    }
  }
  return star;
}

}  // namespace

Expected<bool> WriteCoveragePlot(const MapCoverage& coverage, const OccupancyGrid2d& grid,
                                 const std::filesystem::path& path) {
  const Eigen::Vector2d end = grid.origin + grid.resolution * Eigen::Vector2d(grid.width, grid.height);
  const io::SvgPanel panel(kView, grid.origin.x(), std::max(end.x(), grid.origin.x() + grid.resolution),
                           grid.origin.y(), std::max(end.y(), grid.origin.y() + grid.resolution), true);
  constexpr double kPercent = 100.0, kTitleY = 26.0, kLegendY = 52.0, kTitleSize = 16.0, kLegendSize = 13.0;
  std::string svg = io::SvgText(
      kView.left, kTitleY, fmt::format("{:.0f} % of places and headings can be localised", kPercent * coverage.Share()),
      "start", kTitleSize);
  svg += io::SvgText(kView.left, kLegendY,
                     fmt::format("green ray: at least {} landmarks in view that way", MapCoverage::kEnough), "start",
                     kLegendSize);
  svg += panel.Cells(grid, Rigid2()) + panel.Axes("x [m]", "y [m]");
  for (const MapCoverage::Place& place : coverage.places) svg += StarAt(panel, place);
  return io::WriteSvg(svg, kWidth, kHeight, path);
}

}  // namespace planar_vslam
