#include "planar_vslam/sim/live_simulation.h"

#include <fmt/format.h>

#include <cmath>

namespace planar_vslam {
namespace {

// Why the robot cannot be put where it shall start.
std::optional<Error> FindStartProblem(const World& world, const Rigid2& start) {
  const std::optional<std::string> touched = Obstacles(world, world.drive.robot_radius).Touched(start, 0.0);
  if (!touched.has_value()) return std::nullopt;
  return Error{fmt::format("{}: start: the robot of radius {} m touches {} at [{:.2f}, {:.2f}]; expected free floor",
                           world.source, world.drive.robot_radius, *touched, start.translation.x(),
                           start.translation.y())};
}

}  // namespace

Expected<LiveSimulation> LiveSimulation::Create(const World& world, const LiveOptions& options) {
  const std::vector<WorldProblem> problems = FindProblems(world);
  if (!problems.empty()) return Error{fmt::format("{}: {}: {}", world.source, problems[0].key, problems[0].message)};
  if (!options.follow_drive) {
    if (!world.events.kidnaps.empty())
      return Error{fmt::format("{}: events.kidnaps: expected none without a drive to follow", world.source)};
    if (auto problem = FindStartProblem(world, options.start.value_or(world.drive.start))) return *std::move(problem);
    return LiveSimulation(world, options, nullptr);
  }
  if (options.start.has_value()) return Error{"start: expected none beside a drive to follow, which has its own"};
  Expected<Drive> drive = PlanDrive(world);
  if (!drive) return drive.error();
  return LiveSimulation(world, options,
                        std::make_unique<PlannedMotion>(std::move(*drive), Floor(world), world.events.kidnaps));
}

LiveSimulation::LiveSimulation(const World& world, const LiveOptions& options, std::unique_ptr<PlannedMotion> planned)
    : rig_(world, options),
      obstacles_(world, world.drive.robot_radius),
      driven_(Floor(world), options.start.value_or(world.drive.start)),
      planned_(std::move(planned)) {
  base_.T_world_base = options.start.value_or(world.drive.start);
  if (options.people_wait) people_.emplace(world.people, world.drive.robot_radius);
}

void LiveSimulation::Command(const VelocityCommand& command) {
  command_ = command.IsFinite() ? command : VelocityCommand();
  commanded_at_ = now();
}

void LiveSimulation::Step() {
  ++steps_;
  StepPeople();
  if (planned_ != nullptr && now() < planned_->duration() + DrivenMotion::kMemory) return;
  if (planned_ != nullptr) EndDrive();
  const World& world = rig_.world();
  const bool silent = now() - commanded_at_ > world.limits.command_timeout;
  base_ = StepBase(world.limits, world.drive.base, obstacles_, base_, silent ? VelocityCommand() : command_, now(),
                   Drive::kStep);
  driven_.Append(base_.T_world_base);
  if (people_.has_value()) driven_.AppendPeople(people_->times());
}

// While a drive is followed, which was planned clear of them, they do as always.
void LiveSimulation::StepPeople() {
  if (!people_.has_value()) return;
  constexpr double kFar = 1e6;  // m
  people_->Step(planned_ == nullptr ? base_.T_world_base.translation : Eigen::Vector2d::Constant(kFar), Drive::kStep);
  obstacles_.SetPeopleTimes(people_->times());
}

void LiveSimulation::EndDrive() {
  base_.T_world_base = planned_->PlaceAt(now(), now());
  driven_ = DrivenMotion(Floor(rig_.world()), base_.T_world_base, steps_ - 1);
  planned_.reset();
  command_ = {};
  drive_is_over_ = true;
}

std::optional<Error> LiveSimulation::Carry(const Rigid2& T_world_base) {
  if (planned_ != nullptr) return Error{"the robot follows its drive; expected one that obeys commands"};
  if (!T_world_base.translation.allFinite() || !std::isfinite(T_world_base.angle))
    return Error{"expected a finite pose"};
  if (const std::optional<std::string> touched = obstacles_.Touched(T_world_base, now()))
    return Error{fmt::format("the robot would touch {} at [{:.2f}, {:.2f}]; expected free floor", *touched,
                             T_world_base.translation.x(), T_world_base.translation.y())};
  base_.T_world_base = T_world_base;
  base_.velocity.setZero();
  base_.touching = false;
  driven_.Carry(T_world_base);
  return std::nullopt;
}

std::optional<SimulatedEvent> LiveSimulation::Next() {
  const double due = now() - rig_.lead();
  if (due < 0.0) return std::nullopt;
  if (planned_ != nullptr) return rig_.Next(*planned_, due);
  return rig_.Next(driven_, due);
}

double LiveSimulation::now() const { return Drive::kStep * static_cast<double>(steps_); }

BaseState LiveSimulation::base() const {
  BaseState state = base_;
  if (planned_ != nullptr) state.T_world_base = ProjectToPlane(T_world_base());
  return state;
}

Rigid3 LiveSimulation::T_world_base() const { return planned_ != nullptr ? planned_->At(now()) : driven_.At(now()); }

}  // namespace planar_vslam
