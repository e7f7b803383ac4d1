#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "commands.h"
#include "planar_vslam/io/bag_writer.h"
#include "planar_vslam/sim/dataset_writer.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/variants.h"
#include "planar_vslam/sim/world_files.h"
#include "session_options.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

struct SimulateArguments {
  std::string world;
  fs::path out, bag;
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

int Simulate(const SimulateArguments& arguments) {
  const Expected<World> world = OpenWorld({arguments.world, arguments.drive, arguments.variants, arguments.seed});
  if (!world) return Fail(kExitBadInput, world.error().message);
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
  CLI::App* command = app.add_subcommand(
      "simulate", "Render a robot's drive through a simulated world into a dataset folder or a rosbag");
  command->add_option("world", arguments->world, "World file (YAML), or the name of a shipped world, like sample_lab")
      ->required();
  CLI::Option_group* outputs = command->add_option_group("Outputs", "One of them, or both");
  outputs->add_option("--out", arguments->out, "Folder for the recording and the ground truth; its files are replaced");
  outputs->add_option("--bag", arguments->bag, "rosbag for the recording; the ground truth stays out of it");
  outputs->require_option(1, 2);
  command->add_option("--drive", arguments->drive, "mapping, or repeat: the world's second way")->capture_default_str();
  command
      ->add_option("--variant", arguments->variants,
                   "What is different from the file, any number of times:\n" + VariantHelp())
      ->allow_extra_args(false);
  command->add_option("--seed", arguments->seed, "Textures and noise; the same seed gives the same bytes")
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
