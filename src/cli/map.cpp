#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "map_info.h"
#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/map_planes.h"
#include "planar_vslam/pipeline/navigation_map.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

// ---- map info

struct MapStatistics {
  std::uintmax_t bytes = 0;
  std::size_t observations = 0;
  double span = 0.0;                                     // s, from the first keyframe's stamp to the last
  double path = 0.0;                                     // along the keyframes; m in a metric map
  Eigen::AlignedBox3d keyframe_extent, landmark_extent;  // of base and landmark positions
  MapPlanes planes;
};

MapStatistics StatisticsOf(const Map& map, const fs::path& path) {
  MapStatistics statistics;
  std::error_code gone_meanwhile;
  statistics.bytes = fs::file_size(path, gone_meanwhile);
  const Keyframe* previous = nullptr;
  for (const auto& [id, keyframe] : map.keyframes) {
    statistics.keyframe_extent.extend(keyframe.T_map_base.translation);
    if (previous != nullptr) {
      statistics.path += (keyframe.T_map_base.translation - previous->T_map_base.translation).norm();
    }
    previous = &keyframe;
  }
  if (previous != nullptr) statistics.span = SecondsBetween(map.keyframes.begin()->second.stamp, previous->stamp);
  for (const auto& [id, landmark] : map.landmarks) {
    statistics.landmark_extent.extend(landmark.p_map);
    statistics.observations += landmark.observations.size();
  }
  statistics.planes = PlanesOf(map, PlaneOptions{});
  return statistics;
}

std::string JsonOf(const MapPlanes& planes) {
  std::string floor = "null";
  if (planes.floor.has_value()) {
    floor = fmt::format(R"({{"height": {}, "tilt_deg": {}, "points": {}, "rms": {}}})", planes.floor->height,
                        planes.floor->TiltDegrees(), planes.floor->points, planes.floor->rms);
  }
  std::vector<std::string> walls;
  for (const WallPlane& w : planes.walls) {
    walls.push_back(fmt::format(R"({{"from": [{}], "to": [{}], "bottom": {}, "top": {}, "points": {}, "rms": {}}})",
                                fmt::join(w.from, ", "), fmt::join(w.to, ", "), w.bottom, w.top, w.points, w.rms));
  }
  return fmt::format("\"floor\": {},\n \"walls\": [{}]", floor, fmt::join(walls, ",\n  "));
}

// One line a wall below the heading, indented.
std::string TextOf(const std::vector<WallPlane>& walls) {
  std::string text = fmt::format("walls            {}\n", walls.size());
  for (const WallPlane& w : walls) {
    text += fmt::format(
        "                 ({:.2f}, {:.2f}) to ({:.2f}, {:.2f}), z {:.2f} to {:.2f} m, {} points, {:.3f} m RMS\n",
        w.from.x(), w.from.y(), w.to.x(), w.to.y(), w.bottom, w.top, w.points, w.rms);
  }
  return text;
}

std::string JsonOf(const Eigen::AlignedBox3d& extent) {
  if (extent.isEmpty()) return "null";
  return fmt::format(R"({{"min": [{}], "max": [{}]}})", fmt::join(extent.min(), ", "), fmt::join(extent.max(), ", "));
}

std::string TextOf(const Eigen::AlignedBox3d& extent, const char* unit) {
  if (extent.isEmpty()) return "nothing";
  const Eigen::Vector3d &a = extent.min(), &b = extent.max();
  return fmt::format("x {:.2f} to {:.2f}, y {:.2f} to {:.2f}, z {:.2f} to {:.2f} {}", a.x(), b.x(), a.y(), b.y(), a.z(),
                     b.z(), unit);
}

std::string ToJson(const SavedMap& saved, const MapStatistics& s) {
  return fmt::format(
      "{{\"bytes\": {}, \"metric\": {}, \"keyframes\": {}, \"landmarks\": {}, \"observations\": {},\n"
      " \"span_seconds\": {}, \"path_length\": {}, \"keyframe_extent\": {},\n \"landmark_extent\": {},\n"
      " \"camera\": {{\"width\": {}, \"height\": {}, \"fx\": {}, \"fy\": {}, \"cx\": {}, \"cy\": {}}},\n {}}}\n",
      s.bytes, saved.map.metric, saved.map.keyframes.size(), saved.map.landmarks.size(), s.observations, s.span, s.path,
      JsonOf(s.keyframe_extent), JsonOf(s.landmark_extent), saved.camera.width, saved.camera.height, saved.camera.fx,
      saved.camera.fy, saved.camera.cx, saved.camera.cy, JsonOf(s.planes));
}

std::string ToText(const SavedMap& saved, const MapStatistics& s) {
  const char* unit = saved.map.metric ? "m" : "(scale unknown)";
  const CameraModel& camera = saved.camera;
  return fmt::format(
      "metric           {}\n"
      "keyframes        {}, over {:.1f} s and {:.2f} {}\n"
      "landmarks        {}, observed {} times\n"
      "keyframe extent  {}\n"
      "landmark extent  {}\n"
      "camera           {} x {} px, fx {:.2f}, fy {:.2f}, cx {:.2f}, cy {:.2f}\n"
      "floor            {}\n"
      "{}"
      "file             {} bytes\n",
      saved.map.metric ? "yes" : "no", saved.map.keyframes.size(), s.span, s.path, unit, saved.map.landmarks.size(),
      s.observations, TextOf(s.keyframe_extent, unit), TextOf(s.landmark_extent, unit), camera.width, camera.height,
      camera.fx, camera.fy, camera.cx, camera.cy, FloorText(s.planes.floor), TextOf(s.planes.walls), s.bytes);
}

struct InfoArguments {
  fs::path file, coverage, config;
  std::vector<std::string> assignments;  // key=value, over the configuration
  bool json = false;
};

int Info(const InfoArguments& arguments) {
  const Expected<PipelineOptions> options = ReadOptions(arguments.config, arguments.assignments, "");
  if (!options) return Fail(kExitBadInput, options.error().message);
  if (!arguments.coverage.empty() && arguments.coverage.extension() != ".svg")
    return Fail(kExitBadInput, "--coverage " + arguments.coverage.string() + ": expected a name that ends in .svg");
  const Expected<SavedMap> saved = LoadMapFile(arguments.file);
  if (!saved) return Fail(kExitBadInput, saved.error().message);
  std::string text = arguments.json ? ToJson(*saved, StatisticsOf(saved->map, arguments.file))
                                    : ToText(*saved, StatisticsOf(saved->map, arguments.file));
  if (!arguments.coverage.empty()) {
    if (!saved->map.metric)
      return Fail(kExitFailure, arguments.file.string() + ": scale unknown, expected a metric map for --coverage");
    const Expected<MapCoverage> coverage = DrawCoverage(*saved, *options, arguments.coverage);
    if (!coverage) return Fail(kExitFailure, coverage.error().message);
    if (arguments.json) text.replace(text.rfind('}'), 1, ",\n \"coverage\": " + JsonOf(*coverage) + "}");
    if (!arguments.json) text += TextOf(*coverage);
  }
  std::fputs(text.c_str(), stdout);
  return kExitSuccess;
}

// ---- map check

int Check(const fs::path& path) {
  std::error_code unreadable;
  if (!fs::is_regular_file(path, unreadable)) {
    return Fail(kExitBadInput, path.string() + ": expected a file that exists");
  }
  const std::vector<std::string> problems = MapFileProblems(path);
  for (const std::string& problem : problems) fmt::print("{}\n", problem);
  if (!problems.empty()) {
    return Fail(kExitFailure,
                fmt::format("{}: expected a sound map, found problems: {}", path.string(), problems.size()));
  }
  fmt::print("{}: sound\n", path.string());
  if (const Expected<SavedMap> saved = LoadMapFile(path); saved.ok() && saved->map.metric) {
    fmt::print("floor: {}\n", FloorText(PlanesOf(saved->map, PlaneOptions{}).floor));
  }
  return kExitSuccess;
}

// ---- map export

struct ExportArguments {
  fs::path map, pcd, ply, tum, octomap, pgm, yaml, config;
  std::vector<std::string> assignments;               // key=value, over the configuration
  double voxel = 0.0, isolated = 0.0, normals = 0.0;  // m, filters of the cloud; 0: off

  bool wants_grid() const { return !pgm.empty() || !yaml.empty(); }
  fs::path YamlPath() const { return yaml.empty() ? fs::path(pgm).replace_extension(".yaml") : yaml; }
};

// What is wrong with the arguments; empty when nothing is.
std::string ProblemOf(const ExportArguments& a) {
  const bool nothing = a.pcd.empty() && a.ply.empty() && a.tum.empty() && a.octomap.empty() && !a.wants_grid();
  if (nothing) return "map export: expected at least one of --pcd, --ply, --tum, --octomap, --pgm, --yaml";
  const auto ends = [](const fs::path& path, const char* ending) { return path.empty() || path.extension() == ending; };
  if (!ends(a.octomap, ".bt") && !ends(a.octomap, ".ot")) {
    return "--octomap " + a.octomap.string() + ": expected a name that ends in .bt or .ot";
  }
  if (!ends(a.pgm, ".pgm")) return "--pgm " + a.pgm.string() + ": expected a name that ends in .pgm";
  if (!ends(a.yaml, ".yaml")) return "--yaml " + a.yaml.string() + ": expected a name that ends in .yaml";
  if (!a.pgm.empty() && a.YamlPath() != fs::path(a.pgm).replace_extension(".yaml")) {
    return "--yaml " + a.yaml.string() + ": expected the name of --pgm but for the ending, they are one map";
  }
  return "";
}

Expected<bool> WriteNavigationMaps(const SavedMap& saved, const ExportArguments& arguments,
                                   const PipelineOptions& options) {
  const MapBuilder builder =
      BuildNavigationMap(saved.map, saved.camera, options.mapping2d, LandmarkAcceptance::For(options.pixel_sigma));
  if (!arguments.octomap.empty()) {
    if (Expected<bool> done = builder.WriteOctomap(arguments.octomap); !done) return done;
  }
  return arguments.wants_grid() ? WriteMapServerFiles(builder.Grid(), arguments.YamlPath()) : Expected<bool>(true);
}

std::vector<CloudPoint> FilteredCloud(const Map& map, const ExportArguments& arguments) {
  std::vector<CloudPoint> cloud = LandmarkCloud(map);
  if (arguments.isolated > 0.0) {
    std::vector<Eigen::Vector3d> positions;
    for (const CloudPoint& point : cloud) positions.emplace_back(point.position.cast<double>());
    std::vector<CloudPoint> kept;
    for (const int i : RadiusInliers(positions, arguments.isolated, LandmarkAcceptance{}.min_neighbors)) {
      kept.push_back(cloud[static_cast<std::size_t>(i)]);
    }
    cloud = std::move(kept);
  }
  if (arguments.voxel > 0.0) cloud = VoxelFiltered(cloud, arguments.voxel);
  if (arguments.normals > 0.0) EstimateNormals(arguments.normals, &cloud);
  return cloud;
}

Expected<bool> WriteExports(const SavedMap& saved, const ExportArguments& arguments, const PipelineOptions& options) {
  const bool navigation = !arguments.octomap.empty() || arguments.wants_grid();
  if (navigation && !saved.map.metric) {
    return Error{arguments.map.string() + ": scale unknown, expected a metric map for --octomap, --pgm and --yaml"};
  }
  const std::vector<CloudPoint> cloud = FilteredCloud(saved.map, arguments);
  if (!arguments.pcd.empty()) {
    if (Expected<bool> done = WritePcd(cloud, arguments.pcd); !done) return done;
  }
  if (!arguments.ply.empty()) {
    if (Expected<bool> done = WritePly(cloud, arguments.ply); !done) return done;
  }
  if (!arguments.tum.empty()) {
    Trajectory keyframes;
    for (const auto& [id, keyframe] : saved.map.keyframes) keyframes.push_back({keyframe.stamp, keyframe.T_map_base});
    if (Expected<bool> done = WriteTrajectory(keyframes, arguments.tum); !done) return done;
  }
  return navigation ? WriteNavigationMaps(saved, arguments, options) : Expected<bool>(true);
}

int Export(const ExportArguments& arguments) {
  const std::string problem = ProblemOf(arguments);
  if (!problem.empty()) return Fail(kExitBadInput, problem);
  const Expected<PipelineOptions> options = ReadOptions(arguments.config, arguments.assignments, "");
  if (!options) return Fail(kExitBadInput, options.error().message);
  const Expected<SavedMap> saved = LoadMapFile(arguments.map);
  if (!saved) return Fail(kExitBadInput, saved.error().message);
  const Expected<bool> written = WriteExports(*saved, arguments, *options);
  return written ? kExitSuccess : Fail(kExitFailure, written.error().message);
}

// ---- arguments

void AddInfo(CLI::App& map, int* exit_code) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = map.add_subcommand("info", "What is in a saved map, and from where it can be localised in");
  command->add_option("file", arguments->file, "Saved map (.pvm)")->required();
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->add_option("--coverage", arguments->coverage,
                      "Also from which places and headings enough landmarks are in view, and a picture of that (.svg)");
  command->add_option("--config", arguments->config,
                      "YAML configuration, whose mapping2d makes the grid of --coverage");
  command->add_option("--set", arguments->assignments, "Override one configuration value: key=value")
      ->allow_extra_args(false);
  command->callback([arguments, exit_code] { *exit_code = Info(*arguments); });
}

void AddCheck(CLI::App& map, int* exit_code) {
  auto file = std::make_shared<fs::path>();
  CLI::App* command = map.add_subcommand("check", "Whether a saved map is whole and sound; lists every problem");
  command->add_option("file", *file, "Saved map (.pvm)")->required();
  command->callback([file, exit_code] { *exit_code = Check(*file); });
}

void AddExport(CLI::App& map, int* exit_code) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = map.add_subcommand("export",
                                         "Write a saved map in other programs' formats. OctoMap and grid come from its "
                                         "landmarks and laser sweeps, and need "
                                         "a metric map");
  command->add_option("file", arguments->map, "Saved map (.pvm)")->required();
  command->add_option("--pcd", arguments->pcd, "Landmarks with normals, PCD");
  command->add_option("--ply", arguments->ply, "Landmarks with normals, PLY");
  command
      ->add_option("--drop-isolated", arguments->isolated,
                   "Of the cloud, leave out landmarks with fewer than four others within this many metres")
      ->check(CLI::PositiveNumber);
  command->add_option("--voxel", arguments->voxel, "Of the cloud, one point a cube of this many metres")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--normals", arguments->normals,
                   "Normals from the points within this many metres instead of the direction to the cameras")
      ->check(CLI::PositiveNumber);
  command->add_option("--tum", arguments->tum, "Keyframe poses, TUM trajectory");
  command->add_option("--octomap", arguments->octomap, "OctoMap: binary .bt, or .ot with probabilities");
  command->add_option("--pgm", arguments->pgm, "Occupancy grid for map_server and its .yaml beside it");
  command->add_option("--yaml", arguments->yaml, "The same, by the name of the .yaml");
  command->add_option("--config", arguments->config, "YAML configuration, of which mapping2d counts");
  command->add_option("--set", arguments->assignments, "Override one configuration value: key=value");
  command->callback([arguments, exit_code] { *exit_code = Export(*arguments); });
}

}  // namespace

void AddMap(CLI::App& app, int* exit_code) {
  CLI::App* map = app.add_subcommand("map", "Look into, check, export and merge saved maps");
  map->require_subcommand(1);
  AddInfo(*map, exit_code);
  AddCheck(*map, exit_code);
  AddExport(*map, exit_code);
  AddMapMerge(*map, exit_code);
}

}  // namespace planar_vslam
