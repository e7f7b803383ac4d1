#include "planar_vslam/sim/random_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "building.h"
#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/random.h"
#include "planar_vslam/sim/world_text.h"
#include "robot_draw.h"

namespace planar_vslam {
namespace {

// Each part of a world has draws of its own, so that a change of one leaves the others as they are.
enum class Part : std::uint64_t {
  kBuilding,
  kFurniture,
  kSensors,
  kDrive,
  kSlips,
  kFloor,
  kClutter,
  kPeople,
  kDecoration
};

constexpr int kAttempts = 50;  // until a building has a way for its robot; nearly always the first

// m/s that a robot drives there among people.
double Fastest(WorldKind kind) {
  const bool wide = kind == WorldKind::kHall || kind == WorldKind::kCorridor || kind == WorldKind::kWarehouse;
  return wide ? 1.2 : 0.8;
}

std::optional<World> DrawOnce(std::uint64_t seed, WorldKind kind) {
  const auto draws = [seed](Part part) { return sim::Draws(MixSeed(seed, static_cast<std::uint64_t>(part))); };
  sim::Draws building_draws = draws(Part::kBuilding), furniture = draws(Part::kFurniture),
             sensors = draws(Part::kSensors), way = draws(Part::kDrive), slips = draws(Part::kSlips),
             floor = draws(Part::kFloor), clutter = draws(Part::kClutter), people = draws(Part::kPeople),
             decoration = draws(Part::kDecoration);
  sim::Building building = sim::DrawBuilding(kind, building_draws);
  World& world = building.world;
  sim::Furnish(&building, furniture);
  const sim::Budget budget = sim::DrawSensors(&world, sensors);
  const std::optional<Drive> drive = sim::DrawDrive(&world, Fastest(kind), budget, way);
  if (!drive.has_value()) return std::nullopt;
  sim::KeepBudget(&world, budget, drive->duration());
  sim::DrawSlips(&world, drive->duration(), slips);
  sim::AddSills(&building, floor);
  if (floor.Chance(0.2)) sim::AddRamp(&world, *drive, floor);
  sim::AddClutter(&building, *drive, clutter);
  sim::AddPeople(&building, *drive, people);
  sim::Decorate(&building, decoration);
  return world;
}

}  // namespace

const std::vector<std::string>& WorldKindNames() {
  static const std::vector<std::string> names = {"lab", "office", "hall", "corridor", "warehouse", "mixed"};
  return names;
}

Expected<WorldKind> ParseWorldKind(const std::string& name) {
  const std::vector<std::string>& names = WorldKindNames();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<WorldKind>(found - names.begin());
  return Error{fmt::format("kind '{}': expected one of {}", name, fmt::join(names, ", "))};
}

WorldKind KindOfSeed(std::uint64_t seed) { return static_cast<WorldKind>(seed % WorldKindNames().size()); }

Expected<World> DrawWorld(std::uint64_t seed, WorldKind kind) {
  const std::string& name = WorldKindNames()[static_cast<std::size_t>(kind)];
  const std::string source = fmt::format("random {} of seed {}", name, seed);
  std::string problem = "no way through the building was found";
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::uint64_t stream = 100 * static_cast<std::uint64_t>(kind) + static_cast<std::uint64_t>(attempt);
    const std::optional<World> drawn = DrawOnce(MixSeed(MixSeed(seed, RandomStream::kWorld), stream), kind);
    if (!drawn.has_value()) continue;
    // As it would be read from its own file, so that the file makes the same recording.
    Expected<World> world = ParseWorld(WriteWorld(*drawn), source);
    const Expected<Drive> drive = world ? PlanDrive(*world) : Expected<Drive>(world.error());
    if (drive) return world;
    problem = drive.error().message;
  }
  return Error{fmt::format("{}: expected a world with a drive; {}", source, problem)};
}

}  // namespace planar_vslam
