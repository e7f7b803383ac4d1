#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>

#include "commands.h"
#include "planar_vslam/map/map_file.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  std::vector<fs::path> inputs;
  fs::path out, config, odometry, map, save_map;
  std::string mode;
  std::vector<std::string> assignments;
  bool deterministic = false, quiet = false;
  double rate = 0.0, from = 0.0, until = 0.0;
  std::vector<double> start_at;  // T_map_base: x m, y m, yaw rad
};

// The configuration, and what a saved map asks of it.
Expected<PipelineOptions> ReadRunOptions(const RunArguments& arguments) {
  Expected<PipelineOptions> options = ReadOptions(arguments.config, arguments.assignments, arguments.mode);
  if (options.ok() && options->mode == RunMode::kLocalization && arguments.map.empty()) {
    return Error{"--mode localization: expected the map to localize in, --map FILE"};
  }
  return options;
}

void PrintSummary(const Estimator& estimator, const RunResult& result, const fs::path& out) {
  const EstimatorReport& report = estimator.report();
  const auto count = [&report](TrackingState s) { return report.frames.count(s) != 0 ? report.frames.at(s) : 0L; };
  const std::shared_ptr<const Map> map = estimator.map();
  fmt::print("{} images: {} tracked, {} on odometry, {} lost, {} before initialisation\n", result.frames.size(),
             count(TrackingState::kTracking) + count(TrackingState::kRelocalized), count(TrackingState::kOdometry),
             count(TrackingState::kLost), count(TrackingState::kInitializing));
  if (map == nullptr) {
    fmt::print("no map: still waiting for {}\n", result.frames.empty() ? "images" : result.frames.back().waiting_for);
  } else {
    fmt::print("{} keyframes, {} points, {}\n", map->keyframes.size(), map->landmarks.size(),
               map->metric ? "metric" : "scale unknown (no metric claim)");
  }
  if (report.scale.has_value()) {
    fmt::print("scale: {:.4f} by steps (paper), {:.4f} by centroids, {:.4f} applied\n", report.scale->by_steps,
               report.scale->by_centroids, report.scale->applied);
  }
  if (map != nullptr && map->metric && report.map_scale.fused.has_value()) {
    fmt::print("scale known to {:.2f} %\n", 100.0 * report.map_scale.fused->sigma);
  }
  if (report.joined.has_value()) {
    fmt::print("joined with the loaded map after {:.1f} s, in {} places\n",
               SecondsBetween(result.frames.front().stamp, report.joined->in_map), report.joined->places);
  } else if (report.own_map) {
    fmt::print("nothing of the loaded map was recognised: this is a map of its own\n");
  }
  for (const auto& [reason, number] : report.failed_adjustments) fmt::print("failed: {} x {}\n", number, reason);
  if (!result.final_adjustment.empty()) fmt::print("the map is as before its last {}\n", result.final_adjustment);
  for (const auto& [reason, number] : result.unused_input) fmt::print("unused: {} x {}\n", number, reason);
  if (!result.findings.empty()) fmt::print("what contradicts what, the most harmful first:\n");
  for (const std::string& finding : result.findings) fmt::print("  - {}\n", finding);
  fmt::print("{:.1f} s of recording in {:.1f} s; results in {}\n", result.recorded_seconds, result.wall_seconds,
             out.string());
}

// Asked before a long run rather than after it.
Expected<bool> PrepareSaving(const fs::path& path) {
  std::error_code unknown, failed;
  if (fs::is_directory(path, unknown)) return Error{path.string() + ": a folder, expected a file name for --save-map"};
  if (!path.has_parent_path()) return true;
  fs::create_directories(path.parent_path(), failed);
  if (failed && !fs::is_directory(path.parent_path(), unknown)) {
    return Error{fmt::format("{}: folder cannot be created: {}", path.string(), failed.message())};
  }
  return true;
}

Expected<bool> SaveFinalMap(const Estimator& estimator, const fs::path& path) {
  if (estimator.map() == nullptr) return Error{path.string() + ": not saved, expected a map but none was initialised"};
  return SaveMapFile(*estimator.map(), estimator.map_camera(), path);
}

// Without --map there is nothing to do.
Expected<bool> StartFromSavedMap(const fs::path& path, Estimator* estimator) {
  if (path.empty()) return true;
  const Expected<SavedMap> saved = LoadMapFile(path);
  if (!saved.ok()) return saved.error();
  const Expected<bool> loaded = estimator->LoadMap(*saved);
  if (!loaded.ok()) return Error{fmt::format("--map {}: {}", path.string(), loaded.error().message)};
  return true;
}

// Where the robot is said to be: within 0.5 m and 15 degrees, taken for two standard deviations. Height and tilt are
// the floor's.
Expected<bool> StartWhereGiven(const std::vector<double>& pose, Estimator* estimator) {
  constexpr double kSigma = 0.25;  // m
  constexpr double kSigmaYaw = DegreesToRadians(7.5);
  if (pose.empty()) return true;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << kSigma * kSigma, kSigma * kSigma, 0.0, 0.0, 0.0, kSigmaYaw * kSigmaYaw;
  const Expected<bool> started = estimator->StartAt(Embed3(Rigid2(pose[0], pose[1], pose[2])), covariance);
  if (!started.ok()) return Error{"--start-at: " + started.error().message};
  return true;
}

int Run(const RunArguments& arguments) {
  Expected<PipelineOptions> options = ReadRunOptions(arguments);
  if (!options.ok()) return Fail(kExitBadInput, options.error().message);
  Expected<std::unique_ptr<Recording>> recording =
      OpenRecording(arguments.inputs, ToRecordingOptions(*options, arguments.odometry));
  if (!recording.ok()) return Fail(kExitBadInput, recording.error().message);
  if (!arguments.save_map.empty()) {
    const Expected<bool> prepared = PrepareSaving(arguments.save_map);
    if (!prepared.ok()) return Fail(kExitBadInput, prepared.error().message);
  }
  std::error_code failed;
  fs::create_directories(arguments.out, failed);
  if (failed)
    return Fail(kExitBadInput,
                fmt::format("--out {}: cannot be created: {}", arguments.out.string(), failed.message()));
  const RecordingInfo& info = (*recording)->info();
  const bool use_odometry = info.has_odometry && options->odometry != OdometryUse::kOff;
  if (options->initializer.mode == InitializationMode::kOdometry && !use_odometry && arguments.map.empty()) {
    std::fprintf(stderr, "planar_vslam: no odometry in %s: initialising visually, scale stays unknown\n",
                 arguments.inputs.front().c_str());
  }
  RunSettings settings;
  if (arguments.rate > 0.0) settings.rate = arguments.rate;
  if (arguments.from > 0.0) settings.from = arguments.from;
  if (arguments.until > 0.0) settings.until = arguments.until;
  if (!arguments.quiet) settings.progress = ProgressBar();
  const Schedule schedule = arguments.rate > 0.0 && !arguments.deterministic ? Schedule::kThreaded : Schedule::kInline;
  Estimator estimator({*options, info.camera, info.has_base_transform, use_odometry, schedule});
  Expected<bool> started = StartFromSavedMap(arguments.map, &estimator);
  if (started.ok()) started = StartWhereGiven(arguments.start_at, &estimator);
  if (!started.ok()) return Fail(kExitBadInput, started.error().message);
  const Expected<RunResult> result = RunSession(**recording, estimator, settings);
  if (!result.ok()) return Fail(kExitBadInput, result.error().message);
  const Expected<bool> written = WriteRunOutputs(arguments.out, estimator, *result, arguments.deterministic);
  if (!written.ok()) return Fail(kExitFailure, written.error().message);
  if (!arguments.quiet) PrintSummary(estimator, *result, arguments.out);
  if (!arguments.save_map.empty()) {
    const Expected<bool> saved = SaveFinalMap(estimator, arguments.save_map);
    if (!saved.ok()) return Fail(kExitFailure, saved.error().message);
  }
  return kExitSuccess;
}

}  // namespace

void AddRun(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* command = app.add_subcommand("run", "Process a bag or a dataset folder into trajectory, map and costmap");
  command
      ->add_option("input", arguments->inputs,
                   "bag (rosbag v2, .mcap, .db3), or several of one drive; or a folder of ROS 2's recorder, or in the "
                   "shared, TUM-RGBD or KITTI layout")
      ->required();
  command->add_option("--out", arguments->out, "Folder for the results")->required();
  command->add_option("--mode", arguments->mode, "mapping, or localization in the map of --map, which stays as it is");
  command->add_option("--map", arguments->map, "Start from this saved map (.pvm)");
  command->add_option("--save-map", arguments->save_map, "Save the map here too, beside DIR/map.pvm");
  command
      ->add_option("--start-at", arguments->start_at,
                   "x,y,yaw (m, rad) of the robot in the map of --map, good to 0.5 m and 15 degrees")
      ->delimiter(',')
      ->expected(3);
  command->add_option("--config", arguments->config, "YAML configuration");
  command->add_option("--set", arguments->assignments, "Override one configuration value: key=value")
      ->allow_extra_args(false);
  command->add_option("--odometry", arguments->odometry, "Dataset folders: another odometry file");
  command
      ->add_option("--rate", arguments->rate,
                   "Play at this many times real time, dropping frames as a live robot would")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--from", arguments->from,
                   "Begin this many seconds after the first image; the wheels count from there")
      ->check(CLI::PositiveNumber);
  command->add_option("--until", arguments->until, "Stop this many seconds after the first image")
      ->check(CLI::PositiveNumber);
  command->add_flag("--deterministic", arguments->deterministic,
                    "Single-threaded schedule; outputs identical to the byte from run to run");
  command->add_flag("--quiet", arguments->quiet, "No progress bar, no summary");
  command->callback([arguments, exit_code] { *exit_code = Run(*arguments); });
}

}  // namespace planar_vslam
