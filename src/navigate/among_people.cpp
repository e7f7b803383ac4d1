#include "planar_vslam/navigate/among_people.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/navigate/turning.h"

namespace planar_vslam {
namespace {

constexpr double kSlowShare = 0.3;   // of the highest speed, beside obstacles
constexpr double kMuchBetter = 3.0;  // s that leaving the path must be worth

SpeedProblem ProblemOf(const Intention& intention, const NavigateOptions& options, const Costmap& costmap,
                       const IsWalked& is_walked, const PlaneVelocity& velocity) {
  SpeedProblem problem;
  problem.path = intention.path;
  for (const Eigen::Vector2d& p : intention.path) {
    const double near = costmap.Clearance(p) / options.slow_clearance;
    problem.limit.push_back(std::max(kSlowShare, std::min(1.0, near)) * options.max_speed);
    problem.walked.push_back(is_walked(p));
  }
  problem.speed = std::max(0.0, velocity.x);
  problem.delay = intention.turn == 0.0 ? 0.0 : TurnTime(options, std::abs(intention.turn));
  problem.beyond = intention.beyond;
  problem.hold = intention.hold;
  problem.gaps_out = intention.gaps_out;
  return problem;
}

}  // namespace

Adapted AdaptToPeople(const Intention& intention, const Foresight& foresight, const NavigateOptions& options,
                      const Costmap& costmap, const Surroundings& surroundings, const IsWalked& is_walked,
                      const Rigid2& T_map_base, const PlaneVelocity& velocity, double period) {
  if (foresight.empty()) return {PeopleAction::kNone, intention.velocity};
  const SpeedProblem problem = ProblemOf(intention, options, costmap, is_walked, velocity);
  const SpeedPlan plan = PlanSpeed(problem, foresight, options);
  if (plan.contact) {
    const WayOut way = FindWayOut(foresight, options, T_map_base, velocity, surroundings, is_walked);
    const double left = SpeedStep(options) * static_cast<double>(problem.path.size() - 1) + problem.beyond;
    const double cost = way.cost + options.foresight + left / options.max_speed;
    if (cost + kMuchBetter < plan.cost) {
      Adapted adapted{PeopleAction::kGiveWay, way.velocity};
      const double most = options.turn_acceleration * period;
      adapted.velocity.yaw = std::clamp(way.velocity.yaw, velocity.yaw - most, velocity.yaw + most);
      return adapted;
    }
  }
  const double wanted = intention.velocity.Speed();
  if (wanted <= plan.speed) return {PeopleAction::kNone, intention.velocity};
  const double share = plan.speed / wanted;
  const PlaneVelocity slower{share * intention.velocity.x, share * intention.velocity.y,
                             share * intention.velocity.yaw};
  return {plan.speed > 0.0 ? PeopleAction::kNone : PeopleAction::kWait, slower};
}

}  // namespace planar_vslam
