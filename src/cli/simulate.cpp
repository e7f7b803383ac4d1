#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "commands.h"
#include "planar_vslam/io/bag_writer.h"
#include "planar_vslam/sim/dataset_writer.h"
#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/random_world.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/variants.h"
#include "planar_vslam/sim/world_files.h"
#include "planar_vslam/sim/world_text.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

struct SimulateArguments {
  std::string world, kind;
  fs::path out, bag, world_yaml;
  std::string check;  // seeds, FIRST-LAST
  std::string drive = "mapping";
  std::vector<std::string> variants;
  std::uint64_t seed = 1;
  double until = std::numeric_limits<double>::infinity();
  bool sensors_only = false, quiet = false;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
};

BagRobot RobotOf(const World& world) {
  return {world.camera.model, world.camera.T_base_camera(), !world.head.motion.empty(), world.laser.T_base_laser()};
}

// From second 0 to the end.
long ImageCount(const Simulation& simulation) {
  constexpr double kRounding = 1e-6;  // images
  return static_cast<long>(std::floor(simulation.end_time() * simulation.world().camera.rate + kRounding)) + 1;
}

// Runs the simulation into the folder, the bag, or both.
int Record(Simulation& simulation, const SimulateArguments& arguments) {
  std::optional<BagWriter> bag;
  if (!arguments.bag.empty()) {
    Expected<BagWriter> created = BagWriter::Create(arguments.bag, RobotOf(simulation.world()));
    if (!created) return Fail(kExitFailure, created.error().message);
    bag = std::move(*created);
  }
  DatasetCounts counts, shown;
  ProgressBar progress;
  const long images = ImageCount(simulation);
  const auto observe = [&](const SimulatedEvent& event) {
    shown.Add(event);
    if (!arguments.quiet && std::holds_alternative<CameraFrame>(event.measurement)) progress(shown.images, images);
    if (!bag.has_value()) return;
    std::visit([&bag](const auto& measurement) { bag->Write(measurement); }, event.measurement);
  };
  if (!arguments.out.empty()) {
    const Expected<DatasetCounts> written = WriteDataset(simulation, arguments.out, observe);
    if (!written) return Fail(kExitFailure, written.error().message);
    counts = *written;
  } else {
    while (const std::optional<SimulatedEvent> event = simulation.Next()) {
      observe(*event);
      counts.Add(*event);
    }
  }
  if (bag.has_value()) {
    const Expected<bool> closed = bag->Close();
    if (!closed) return Fail(kExitFailure, closed.error().message);
  }
  const std::string rendered = simulation.renders() ? fmt::format("{} images", counts.images) : "no images";
  fmt::print("{}: {:.1f} s, {}, {} odometry readings, {} scans\n",
             (arguments.out.empty() ? arguments.bag : arguments.out).string(), simulation.end_time(), rendered,
             counts.odometry_readings, counts.scans);
  return kExitSuccess;
}

// "FIRST-LAST".
Expected<std::pair<std::uint64_t, std::uint64_t>> ParseSeeds(const std::string& text) {
  std::uint64_t first = 0, last = 0;
  const char* const end = text.data() + text.size();
  const auto [dash, bad_first] = std::from_chars(text.data(), end, first);
  if (bad_first == std::errc() && dash != end && *dash == '-') {
    const auto [rest, bad_last] = std::from_chars(dash + 1, end, last);
    if (bad_last == std::errc() && rest == end && first <= last) return std::pair(first, last);
  }
  return Error{fmt::format("--check '{}': expected seeds, FIRST-LAST", text)};
}

// Whether every seed makes a world whose drive is free; nothing is rendered.
int CheckSeeds(const SimulateArguments& arguments) {
  const auto seeds = ParseSeeds(arguments.check);
  if (!seeds) return Fail(kExitBadInput, seeds.error().message);
  ProgressBar progress;
  const long count = static_cast<long>(seeds->second - seeds->first) + 1;
  long failed = 0;
  for (long i = 0; i < count; ++i) {
    const std::uint64_t seed = seeds->first + static_cast<std::uint64_t>(i);
    const Expected<World> world =
        OpenWorld({arguments.world, arguments.drive, arguments.variants, seed, arguments.kind});
    const Expected<Drive> drive = world ? PlanDrive(*world) : world.error();
    if (!drive) ++failed, Fail(kExitFailure, drive.error().message);
    if (!arguments.quiet) progress(i + 1, count);
  }
  fmt::print("{} worlds, {} without a free drive\n", count, failed);
  return failed == 0 ? kExitSuccess : kExitFailure;
}

int Simulate(const SimulateArguments& arguments) {
  if (!arguments.check.empty()) return CheckSeeds(arguments);
  const Expected<World> world =
      OpenWorld({arguments.world, arguments.drive, arguments.variants, arguments.seed, arguments.kind});
  if (!world) return Fail(kExitBadInput, world.error().message);
  if (!arguments.world_yaml.empty()) {
    std::ofstream file(arguments.world_yaml);
    file << WriteWorld(*world);
    file.close();
    if (!file) return Fail(kExitFailure, arguments.world_yaml.string() + ": cannot be written");
  }
  if (arguments.out.empty() && arguments.bag.empty()) return kExitSuccess;
  SimulationOptions options;
  options.seed = arguments.seed;
  options.until = arguments.until;
  options.threads = arguments.threads;
  options.render = !arguments.sensors_only;
  Expected<Simulation> simulation = Simulation::Create(*world, options);
  if (!simulation) return Fail(kExitBadInput, simulation.error().message);
  return Record(*simulation, arguments);
}

}  // namespace

void AddSimulate(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command =
      app.add_subcommand("simulate", "Render a robot's drive through a simulated world into a dataset folder or a bag");
  command
      ->add_option("world", arguments->world,
                   "World file (YAML), the name of a shipped world, like sample_lab, or random: one drawn by the seed")
      ->required();
  command->add_option("--kind", arguments->kind,
                      fmt::format("Of a random world: {}; without: the seed's own", fmt::join(WorldKindNames(), ", ")));
  CLI::Option_group* outputs = command->add_option_group("Outputs", "At least one of them");
  outputs->add_option("--out", arguments->out, "Folder for the recording and the ground truth; its files are replaced");
  outputs->add_option(
      "--bag", arguments->bag,
      "Bag for the recording: .mcap or .db3 as ROS 2's, else a rosbag (v2); the ground truth stays out of it");
  outputs->add_option("--world-yaml", arguments->world_yaml, "World file of what is simulated, variants included");
  outputs->add_option("--check", arguments->check,
                      "Seeds FIRST-LAST: instead, whether each makes a world with a free drive; renders nothing");
  outputs->require_option(1, 4);
  command
      ->add_option("--drive", arguments->drive,
                   "mapping; repeat: the world's second way; or reverse: its way from the end")
      ->capture_default_str();
  command
      ->add_option("--variant", arguments->variants,
                   "What is different from the file, any number of times:\n" + VariantHelp())
      ->allow_extra_args(false);
  command
      ->add_option("--seed", arguments->seed, "Random worlds, textures and noise; the same seed gives the same bytes")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--sensors-only", arguments->sensors_only,
                    "No images: odometry, scans and truth of another seed, to go with images rendered before");
  command->add_option("--until", arguments->until, "Stop after this many seconds")->check(CLI::PositiveNumber);
  command->add_option("--threads", arguments->threads, "That render; the bytes do not depend on it")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  command->add_flag("--quiet", arguments->quiet, "No progress bar");
  command->callback([arguments, exit_code] { *exit_code = Simulate(*arguments); });
}

}  // namespace planar_vslam
