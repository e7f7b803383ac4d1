#include "planar_vslam/sim/obstacles.h"

#include <fmt/format.h>

#include <algorithm>

#include "planar_vslam/sim/scene.h"

namespace planar_vslam {
namespace {

constexpr double kPersonRadius = 0.25;  // m

}  // namespace

Obstacles::Obstacles(const World& world, double radius) : world_(world), radius_(radius), floor_(world) {
  for (Prism& solid : MakeSolids(world.objects)) {
    if (!solid.MeetsBand(kBodyLow, kBodyHigh)) continue;
    Circle circle{Eigen::Vector2d::Zero(), 0.0};
    for (const Eigen::Vector2d& corner : solid.footprint)
      circle.centre += corner / static_cast<double>(solid.footprint.size());
    for (const Eigen::Vector2d& corner : solid.footprint)
      circle.radius = std::max(circle.radius, (corner - circle.centre).norm());
    circles_.push_back(circle);
    solids_.push_back(std::move(solid));
  }
}

Eigen::Vector2d Obstacles::PlaceOf(std::size_t person, double time) const {
  const double own = people_times_.empty() ? time : people_times_.at(person);
  return WalkerAt(world_.people[person], own).T_world_walker.translation;
}

std::optional<std::string> Obstacles::Touched(const Rigid2& T_world_base, double time) const {
  const Eigen::Vector2d& at = T_world_base.translation;
  const Nearest nearest = FindNearest(at, time);
  if (nearest.clearance < 0.0) return NameOf(nearest, at, time);
  if (Falls(T_world_base)) return "the edge of a ramp";
  return std::nullopt;
}

double Obstacles::Clearance(const Eigen::Vector2d& at, double time) const { return FindNearest(at, time).clearance; }

bool Obstacles::Falls(const Rigid2& T_world_base) const {
  constexpr double kUpright = 0.97;  // cosine of 14 degrees
  return floor_.Stand(T_world_base).R()(2, 2) < kUpright;
}

Obstacles::Nearest Obstacles::FindNearest(const Eigen::Vector2d& at, double time) const {
  const Eigen::Vector2d room = world_.room.size.head<2>();
  Nearest nearest{std::min(at.minCoeff(), (room - at).minCoeff()) - radius_, kWall};
  constexpr double kRounding = 1e-9;  // m
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    const double least = (at - circles_[i].centre).norm() - circles_[i].radius - radius_;
    if (least > nearest.clearance + kRounding) continue;
    const double clearance = Distance(at, solids_[i].footprint) - radius_;
    if (clearance < nearest.clearance) nearest = {clearance, static_cast<int>(i)};
  }
  for (std::size_t person = 0; person < world_.people.size(); ++person) {
    const double clearance = (PlaceOf(person, time) - at).norm() - radius_ - kPersonRadius;
    if (clearance < nearest.clearance) nearest = {clearance, kPerson};
  }
  return nearest;
}

std::string Obstacles::NameOf(const Nearest& nearest, const Eigen::Vector2d& at, double time) const {
  if (nearest.solid == kWall) return "a wall";
  if (nearest.solid == kPerson) {
    std::size_t person = 0;
    for (std::size_t i = 1; i < world_.people.size(); ++i) {
      if ((PlaceOf(i, time) - at).norm() < (PlaceOf(person, time) - at).norm()) person = i;
    }
    return fmt::format("people[{}]", person);
  }
  const int object = solids_[static_cast<std::size_t>(nearest.solid)].object;
  return fmt::format("objects[{}], a {}", object, Name(world_.objects[static_cast<std::size_t>(object)].kind));
}

}  // namespace planar_vslam
