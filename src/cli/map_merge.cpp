#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.h"
#include "planar_vslam/backend/merge_maps.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/mapper_context.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

struct MergeArguments {
  fs::path first, second, out, config;
  std::vector<std::string> assignments;  // key=value, over the configuration
  bool quiet = false;
};

// Why one map cannot take part; nothing where it can.
std::optional<std::string> ProblemOf(const SavedMap& saved, const PipelineOptions& options) {
  if (saved.map.keyframes.empty()) return "expected a map with keyframes";
  if (!saved.map.metric) return "scale unknown, expected a metric map";
  if (saved.map.landmarks.empty()) return "expected landmarks, by whose descriptors places are recognised";
  if (saved.map.octave_scales != options.orb.ScaleFactors())
    return "made with other orb.scale_factor or orb.level_count; expected those of the configuration";
  return std::nullopt;
}

// The map, or why it cannot take part.
Expected<SavedMap> Load(const fs::path& path, const PipelineOptions& options) {
  Expected<SavedMap> saved = LoadMapFile(path);
  if (!saved.ok()) return saved;
  const std::optional<std::string> problem = ProblemOf(*saved, options);
  if (problem.has_value()) return Error{path.string() + ": " + *problem};
  return saved;
}

// A progress bar for each thing that is done.
MergeProgress ShowProgress() {
  struct Shown {
    std::string what;
    ProgressBar bar{""};
  };
  return [shown = std::make_shared<Shown>()](const std::string& what, long done, long total) {
    if (what != shown->what) *shown = {what, ProgressBar(what)};
    shown->bar(done, total);
  };
}

void Print(const MergedMap& merged, const MergeArguments& arguments) {
  const Rigid2 T = ProjectToPlane(merged.overlap.alignment.T_known_other);
  const Eigen::Matrix3d& covariance = merged.overlap.alignment.covariance;
  fmt::print(
      "places           {} keyframes recognised that agree, {} of them apart\n"
      "transform        x {:.3f} m, y {:.3f} m, z {:.3f} m, yaw {:.2f} deg (of {} in {})\n"
      "sigma            x {:.3f} m, y {:.3f} m, yaw {:.2f} deg\n"
      "links            {} landmarks seen in both, {} by laser\n"
      "merged           {} keyframes, {} landmarks; {}\n",
      merged.overlap.places.size(), merged.overlap.alignment.apart, T.translation.x(), T.translation.y(),
      merged.overlap.alignment.T_known_other.translation.z(), RadiansToDegrees(T.angle), arguments.second.string(),
      arguments.first.string(), std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)),
      RadiansToDegrees(std::sqrt(covariance(2, 2))), merged.landmarks_shared, merged.laser_links,
      merged.map.keyframes.size(), merged.map.landmarks.size(), arguments.out.string());
}

int Merge(const MergeArguments& arguments) {
  const Expected<PipelineOptions> options = ReadOptions(arguments.config, arguments.assignments, "");
  if (!options) return Fail(kExitBadInput, options.error().message);
  Expected<SavedMap> first = Load(arguments.first, *options);
  if (!first) return Fail(kExitBadInput, first.error().message);
  const Expected<SavedMap> second = Load(arguments.second, *options);
  if (!second) return Fail(kExitBadInput, second.error().message);
  if (!IsSameCamera(first->camera, second->camera)) {
    return Fail(kExitBadInput, fmt::format("{}: made with another camera than {}; expected maps of one camera",
                                           arguments.second.string(), arguments.first.string()));
  }
  const MapperContext context = MapperContextOf(*options, MeasurementModelOf(*options, first->camera, true));
  const auto known = std::make_shared<const Map>(std::move(first->map));
  const MergeProgress progress = arguments.quiet ? [](const std::string&, long, long) {} : ShowProgress();
  const Expected<MergedMap> merged = MergeMaps(known, second->map, context, progress);
  if (!merged) {
    return Fail(kExitFailure, fmt::format("{} and {} are not merged: {}", arguments.first.string(),
                                          arguments.second.string(), merged.error().message));
  }
  const Expected<bool> saved = SaveMapFile(merged->map, first->camera, arguments.out);
  if (!saved) return Fail(kExitFailure, saved.error().message);
  Print(*merged, arguments);
  return kExitSuccess;
}

}  // namespace

void AddMapMerge(CLI::App& map, int* exit_code) {
  auto arguments = std::make_shared<MergeArguments>();
  CLI::App* command = map.add_subcommand(
      "merge",
      "Two saved maps of one building as one, in the frame of the first. Refuses maps that do not agree in "
      "several places on how they lie");
  command->add_option("first", arguments->first, "Saved map (.pvm), whose frame stays")->required();
  command->add_option("second", arguments->second, "Saved map (.pvm) that overlaps it")->required();
  command->add_option("-o,--out", arguments->out, "The merged map (.pvm)")->required();
  command->add_option("--config", arguments->config, "YAML configuration of the maps");
  command->add_option("--set", arguments->assignments, "Override one configuration value: key=value")
      ->allow_extra_args(false);
  command->add_flag("--quiet", arguments->quiet, "No progress bars");
  command->callback([arguments, exit_code] { *exit_code = Merge(*arguments); });
}

}  // namespace planar_vslam
