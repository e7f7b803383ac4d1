#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>

#include "commands.h"
#include "planar_vslam/optimize/calibration.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

struct CalibrateArguments {
  std::vector<fs::path> inputs;
  fs::path out, config, odometry;
  std::vector<std::string> assignments;
  int passes = 4;
  double until = 0.0;
  bool quiet = false;
};

// What calibrates finds the clocks' offset itself, from all turns at once.
PipelineOptions Unlearned(PipelineOptions options) {
  options.image_timing.learn_clock = false;
  return options;
}

// One run over the recording with the present corrections, then the adjustment that frees them.
Expected<CalibrationResult> CalibrateOnce(const CalibrateArguments& arguments, const PipelineOptions& options) {
  Expected<std::unique_ptr<Recording>> recording =
      OpenRecording(arguments.inputs, ToRecordingOptions(options, arguments.odometry));
  if (!recording.ok()) return recording.error();
  const RecordingInfo& info = (*recording)->info();
  if (!info.has_odometry || !info.has_base_transform) {
    return Error{arguments.inputs.front().string() +
                 ": expected odometry and the camera's place on the base to calibrate"};
  }
  std::vector<OdometryReading> readings;
  RunSettings settings;
  if (arguments.until > 0.0) settings.until = arguments.until;
  if (!arguments.quiet) settings.progress = ProgressBar();
  OdometryContinuity continuity;
  settings.on_odometry = [&readings, &continuity](const OdometryReading& as_recorded) {
    const std::optional<OdometryReading> reading = continuity.Push(as_recorded);
    if (reading.has_value() && (readings.empty() || readings.back().stamp < reading->stamp))
      readings.push_back(*reading);
  };
  Estimator estimator({Unlearned(options), info.camera, info.has_base_transform});
  const Expected<RunResult> result = RunSession(**recording, estimator, settings);
  if (!result.ok()) return result.error();
  if (estimator.map() == nullptr)
    return Error{arguments.inputs.front().string() + ": no map came about to calibrate from"};
  CalibrationOptions calibration;
  calibration.camera_sway_sigma = options.mount.angle;
  return CalibrateMap(*estimator.map(), readings, options.calibration, estimator.model(), calibration);
}

// The largest change of an observed value, in its own posterior sigmas.
double Change(const CalibrationResult& now, const CalibrationResult& before) {
  double largest = 0.0;
  for (std::size_t k = 0; k < kCalibratedValues; ++k) {
    if (!now.values[k].observed) continue;
    largest = std::max(largest, std::abs(now.values[k].value - before.values[k].value) / now.values[k].sigma);
  }
  return largest;
}

bool IsAngle(const CalibratedValue& value) { return value.unit == "rad"; }

void PrintValues(const CalibrationResult& result) {
  for (const CalibratedValue& v : result.values) {
    const double unit = IsAngle(v) ? DegreesToRadians(1.0) : 1.0;
    fmt::print("{:<20} {:>9.4f} +- {:.4f} {:<4}{}\n", v.name, v.value / unit, v.sigma / unit,
               IsAngle(v) ? "deg" : v.unit, v.observed ? "" : "  not seen in this drive: left as it was");
  }
}

// The observed values under `calibration:`, as `run --config` reads them.
std::string ToYaml(const CalibrationResult& result) {
  std::string text = "calibration:\n";
  for (const CalibratedValue& v : result.values) {
    if (!v.observed) continue;
    const double unit = IsAngle(v) ? DegreesToRadians(1.0) : 1.0;
    text +=
        fmt::format("  {}: {:.6f}  # +- {:.6f}\n", v.name + (IsAngle(v) ? "_deg" : ""), v.value / unit, v.sigma / unit);
  }
  return text == "calibration:\n" ? "calibration: {}\n" : text;
}

int Calibrate(const CalibrateArguments& arguments) {
  Expected<PipelineOptions> options = ReadOptions(arguments.config, arguments.assignments, "");
  if (!options.ok()) return Fail(kExitBadInput, options.error().message);
  std::optional<CalibrationResult> last;
  constexpr double kSettled = 0.5;  // sigmas
  for (int pass = 1; pass <= arguments.passes; ++pass) {
    Expected<CalibrationResult> result = CalibrateOnce(arguments, *options);
    if (!result.ok()) return Fail(pass == 1 ? kExitBadInput : kExitFailure, result.error().message);
    const double change = last.has_value() ? Change(*result, *last) : 0.0;
    options->calibration = result->correction;
    const bool settled = last.has_value() && change < kSettled;
    last = std::move(result).value();
    if (!arguments.quiet) {
      fmt::print("pass {}\n", pass);
      PrintValues(*last);
    }
    if (settled) break;
  }
  std::ofstream file(arguments.out);
  file << ToYaml(*last);
  file.close();
  if (!file) return Fail(kExitFailure, arguments.out.string() + ": cannot be written");
  return kExitSuccess;
}

}  // namespace

void AddCalibrate(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<CalibrateArguments>();
  CLI::App* command = app.add_subcommand(
      "calibrate", "Find odometry's scale, the camera's mount and the clocks' offset from a recorded drive");
  command
      ->add_option(
          "input", arguments->inputs,
          "bag (rosbag v2, .mcap, .db3, or the folder that ROS 2 records into), or several of one drive; or a dataset "
          "folder. A drive with turns both ways")
      ->required();
  command->add_option("--out", arguments->out, "YAML file that `run --config` reads")->required();
  command->add_option("--config", arguments->config, "YAML configuration to start from");
  command->add_option("--set", arguments->assignments, "Override one configuration value: key=value")
      ->allow_extra_args(false);
  command->add_option("--odometry", arguments->odometry, "Dataset folders: another odometry file");
  command->add_option("--passes", arguments->passes, "Runs over the recording, at most")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--until", arguments->until, "Use only this many seconds from the first image")
      ->check(CLI::PositiveNumber);
  command->add_flag("--quiet", arguments->quiet, "No progress bar, no table");
  command->callback([arguments, exit_code] { *exit_code = Calibrate(*arguments); });
}

}  // namespace planar_vslam
