#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "live_recording.h"
#include "planar_vslam/io/doctor.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

struct DoctorArguments {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path config, odometry;
  std::vector<std::string> assignments;
  double trial = 90.0, seconds = 15.0;
  bool live = false, json = false, quiet = false;
};

int Examine(const DoctorArguments& arguments, const PipelineOptions& options) {
  const auto open = [&] { return OpenRecording(arguments.inputs, ToRecordingOptions(options, arguments.odometry)); };
  DoctorSettings settings;
  settings.trial = arguments.trial;
  if (!arguments.quiet && !arguments.json) settings.progress = ProgressBar();
  const Expected<std::vector<Checked>> checked = Examine(open, options, settings);
  if (!checked.ok()) return Fail(kExitBadInput, checked.error().message);
  Verdict worst = Verdict::kOk;
  for (const Checked& item : *checked) {
    worst = std::max(worst, item.verdict);
    if (!arguments.json) fmt::print("{:<7} {:<10} {}\n", ToString(item.verdict), item.what, item.text);
  }
  if (arguments.json) fmt::print("{}", ToJson(*checked));
  return static_cast<int>(worst);
}

int Doctor(DoctorArguments arguments) {
  const Expected<PipelineOptions> options = ReadOptions(arguments.config, arguments.assignments, "");
  if (!options.ok()) return Fail(kExitBadInput, options.error().message);
  if (!arguments.live) return Examine(arguments, *options);
  if (!arguments.quiet) {
    fmt::print(stderr, "listening for {} s: drive meanwhile, with turns both ways\n", arguments.seconds);
  }
  const Expected<std::optional<LiveRecording>> recording = LiveRecording::Listen(arguments.seconds);
  if (!recording.ok()) return Fail(kExitBadInput, recording.error().message);
  if (!recording->has_value()) return kExitBadInput;
  arguments.inputs = {(*recording)->bag()};
  return Examine(arguments, *options);
}

}  // namespace

void AddDoctor(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<DoctorArguments>();
  CLI::App* command = app.add_subcommand(
      "doctor", "What is in a recording and what is wrong with it, before mapping: exit 0 ok, 1 look, 2 broken");
  CLI::Option* input = command->add_option("input", arguments->inputs,
                                           "bag (rosbag v2, .mcap, .db3, or the folder that ROS 2 records into), or "
                                           "several of one drive; or a dataset folder");
  CLI::Option* live =
      command->add_flag("--live", arguments->live, "The topics of the running ROS system instead")->excludes(input);
  command->add_option("--seconds", arguments->seconds, "With --live: how long to listen")
      ->needs(live)
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--config", arguments->config, "YAML configuration");
  command->add_option("--set", arguments->assignments, "Override one configuration value: key=value")
      ->allow_extra_args(false);
  command->add_option("--odometry", arguments->odometry, "Dataset folders: another odometry file");
  command->add_option("--trial", arguments->trial, "Seconds from the first image on that are mapped to see what fits")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->add_flag("--quiet", arguments->quiet, "No progress bar");
  command->callback([arguments, exit_code] {
    if (!arguments->live && arguments->inputs.empty()) throw CLI::RequiredError("input or --live");
    *exit_code = Doctor(*arguments);
  });
}

}  // namespace planar_vslam
