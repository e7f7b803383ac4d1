#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "planar_vslam/io/carmen_log.h"
#include "planar_vslam/mapping2d/map_builder.h"
#include "planar_vslam/mapping2d/wall_thickness.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

constexpr double kLaserHeight = 0.3;  // m; these logs do not say, and a single level laser does not care
constexpr int kScansInEpoch = 32;     // as many as the keyframes of one epoch hold, about

struct GridArguments {
  fs::path log, out, config;
};

MapBuilder Build(const std::vector<CarmenScan>& scans, const MapBuilderOptions& options) {
  MapBuilder builder(options);
  int number = 0;
  for (const CarmenScan& item : scans) {
    PosedScan scan{Embed3(item.T_map_laser), item.scan.angle_min, item.scan.angle_increment,
                   item.scan.range_min,      item.scan.range_max, &item.scan.ranges};
    scan.level_height = kLaserHeight;
    scan.epoch = number++ / kScansInEpoch;
    builder.InsertScan(scan);
    builder.MarkFootprint(item.T_map_laser.translation);
  }
  return builder;
}

int Grid(const GridArguments& arguments) {
  Expected<PipelineOptions> options{PipelineOptions{}};
  if (!arguments.config.empty()) options = LoadOptions(arguments.config);
  if (!options) return Fail(kExitBadInput, options.error().message);
  const std::vector<std::string> invalid = ProblemsOf(options->mapping2d, "mapping2d.");
  if (!invalid.empty()) return Fail(kExitBadInput, fmt::format("{}", fmt::join(invalid, "; ")));
  const Expected<std::vector<CarmenScan>> scans = ReadCarmenLog(arguments.log);
  if (!scans) return Fail(kExitBadInput, scans.error().message);
  std::error_code failed;
  fs::create_directories(arguments.out, failed);
  if (failed)
    return Fail(kExitBadInput, fmt::format("{}: cannot be created: {}", arguments.out.string(), failed.message()));
  const MapBuilder builder = Build(*scans, options->mapping2d);
  const OccupancyGrid2d grid = builder.Grid();
  if (const auto done = WriteMapServerFiles(grid, arguments.out / "map.yaml"); !done)
    return Fail(kExitFailure, done.error().message);
  if (const auto done = builder.WriteOctomap(arguments.out / "map.bt"); !done)
    return Fail(kExitFailure, done.error().message);
  std::fputs(fmt::format("scans           {}\n"
                         "grid            {} x {} cells of {:g} m, {} occupied, {} free\n"
                         "wall thickness  {:.1f} cells, median\n"
                         "memory          {:.1f} MiB of evidence\n",
                         scans->size(), grid.width, grid.height, grid.resolution,
                         std::count(grid.cells.begin(), grid.cells.end(), 100),
                         std::count(grid.cells.begin(), grid.cells.end(), 0), MedianWallThickness(grid),
                         static_cast<double>(builder.MemoryBytes()) / (1 << 20))
                 .c_str(),
             stdout);
  return kExitSuccess;
}

}  // namespace

void AddGrid(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<GridArguments>();
  CLI::App* command = app.add_subcommand("grid", "Occupancy grid and OctoMap from laser scans with poses");
  command->add_option("log", arguments->log, "CARMEN log with FLASER lines (.log or .log.gz)")->required();
  command->add_option("--out", arguments->out, "Folder for map.yaml, map.pgm and map.bt")->required();
  command->add_option("--config", arguments->config, "YAML configuration, of which mapping2d counts");
  command->callback([arguments, exit_code] { *exit_code = Grid(*arguments); });
}

}  // namespace planar_vslam
