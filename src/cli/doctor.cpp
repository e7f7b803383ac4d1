#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "planar_vslam/io/doctor.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

struct DoctorArguments {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path config, odometry;
  std::vector<std::string> assignments;
  double trial = 90.0;
  bool json = false, quiet = false;
};

int Doctor(const DoctorArguments& arguments) {
  const Expected<PipelineOptions> options = ReadOptions(arguments.config, arguments.assignments, "");
  if (!options.ok()) return Fail(kExitBadInput, options.error().message);
  const auto open = [&arguments, &options] {
    return OpenRecording(arguments.inputs, ToRecordingOptions(*options, arguments.odometry));
  };
  DoctorSettings settings;
  settings.trial = arguments.trial;
  if (!arguments.quiet && !arguments.json) settings.progress = ProgressBar();
  const Expected<std::vector<Checked>> checked = Examine(open, *options, settings);
  if (!checked.ok()) return Fail(kExitBadInput, checked.error().message);
  Verdict worst = Verdict::kOk;
  for (const Checked& item : *checked) {
    worst = std::max(worst, item.verdict);
    if (!arguments.json) fmt::print("{:<7} {:<10} {}\n", ToString(item.verdict), item.what, item.text);
  }
  if (arguments.json) fmt::print("{}", ToJson(*checked));
  return static_cast<int>(worst);
}

}  // namespace

void AddDoctor(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<DoctorArguments>();
  CLI::App* command = app.add_subcommand(
      "doctor", "What is in a recording and what is wrong with it, before mapping: exit 0 ok, 1 look, 2 broken");
  command
      ->add_option("input", arguments->inputs,
                   "bag (rosbag v2, .mcap, .db3), or several of one drive; or a dataset folder")
      ->required();
  command->add_option("--config", arguments->config, "YAML configuration");
  command->add_option("--set", arguments->assignments, "Override one configuration value: key=value")
      ->allow_extra_args(false);
  command->add_option("--odometry", arguments->odometry, "Dataset folders: another odometry file");
  command->add_option("--trial", arguments->trial, "Seconds from the first image on that are mapped to see what fits")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->add_flag("--quiet", arguments->quiet, "No progress bar");
  command->callback([arguments, exit_code] { *exit_code = Doctor(*arguments); });
}

}  // namespace planar_vslam
