#include "planar_vslam/sim/simulation.h"

#include <fmt/format.h>

#include <algorithm>

namespace planar_vslam {

Expected<Simulation> Simulation::Create(const World& world, const SimulationOptions& options) {
  const std::vector<WorldProblem> problems = FindProblems(world);
  if (!problems.empty()) return Error{fmt::format("{}: {}: {}", world.source, problems[0].key, problems[0].message)};
  if (!(options.until > 0.0)) return Error{fmt::format("until: expected more than 0 s, got {}", options.until)};
  Expected<Drive> drive = PlanDrive(world);
  if (!drive) return drive.error();
  return Simulation(world, options, std::move(drive).value());
}

Simulation::Simulation(const World& world, const SimulationOptions& options, Drive drive)
    : motion_(std::move(drive), Floor(world), world.events.kidnaps),
      end_(std::min(options.until, motion_.duration())),
      rig_(world, options) {}

std::optional<SimulatedEvent> Simulation::Next() { return rig_.Next(motion_, end_); }

}  // namespace planar_vslam
