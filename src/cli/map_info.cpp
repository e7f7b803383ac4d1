#include "map_info.h"

#include <fmt/format.h>

#include "planar_vslam/io/coverage_plot.h"
#include "planar_vslam/pipeline/navigation_map.h"

namespace planar_vslam {

Expected<MapCoverage> DrawCoverage(const SavedMap& saved, const PipelineOptions& options,
                                   const std::filesystem::path& picture) {
  const OccupancyGrid2d grid =
      BuildNavigationMap(saved.map, saved.camera, options.mapping2d, LandmarkAcceptance::For(options.pixel_sigma))
          .Grid();
  MapCoverage coverage = CoverageOf(saved.map, saved.camera, grid);
  const Expected<bool> written = WriteCoveragePlot(coverage, grid, picture);
  if (!written) return written.error();
  return coverage;
}

std::string TextOf(const MapCoverage& coverage) {
  constexpr double kPercent = 100.0;
  std::string text = fmt::format(
      "coverage         {:.1f} % of {} places x {} headings have {} landmarks in view\n"
      "                 {:.1f} % of the places in some heading, {:.1f} % in every one\n"
      "                ",
      kPercent * coverage.Share(), coverage.places.size(), MapCoverage::kHeadings, MapCoverage::kEnough,
      kPercent * coverage.ShareOfPlaces(1), kPercent * coverage.ShareOfPlaces(MapCoverage::kHeadings));
  const auto shares = coverage.ByHeading();
  for (std::size_t k = 0; k < shares.size(); ++k)
    text += fmt::format(" {} deg {:.0f} %{}", 45 * k, kPercent * shares[k], k + 1 < shares.size() ? "," : "\n");
  return text;
}

std::string JsonOf(const MapCoverage& coverage) {
  return fmt::format(
      R"({{"places": {}, "share": {}, "places_some_heading": {}, "places_every_heading": {}, "by_heading": [{}]}})",
      coverage.places.size(), coverage.Share(), coverage.ShareOfPlaces(1),
      coverage.ShareOfPlaces(MapCoverage::kHeadings), fmt::join(coverage.ByHeading(), ", "));
}

}  // namespace planar_vslam
