#include "planar_vslam/navigate/visit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "planar_vslam/navigate/turning.h"

namespace planar_vslam {
namespace {

// Chosen by looking at seeds 1, 3 and 4 of mechatronics_lab.
constexpr double kTick = 0.125;                   // s between two places that are compared
constexpr double kObeys = 0.2;                    // s, from a command until the base moves
constexpr double kLongest = 15.0;                 // s that a way in may take
constexpr double kDirection = M_PI / 12.0;        // rad between two directions that are tried
constexpr int kDirections = 24;                   // of them
constexpr double kLongStay = 8.0;                 // s at a goal: it may as well stay there
constexpr double kLengthStep = 0.05;              // m
constexpr double kFarthest = 1.5;                 // m that it goes in or out
constexpr double kClear = 0.05;                   // m from body to obstacles
constexpr double kBackShare = 0.6;                // of the highest speed, back out; in it goes as fast as ahead,
                                                  // since it saw what is there when it turned to wait
constexpr double kCloseEnough = 0.03;             // m
constexpr double kAstray = 0.35;                  // rad off the way in: it turns at the place already
constexpr double kSlowest = 0.04;                 // m/s
constexpr double kBrakesLate = 0.15;              // s
constexpr double kSteers = 1.5, kSteersAt = 0.3;  // 1/s, rad/s
constexpr double kWideEnough = 0.25;              // m: a wider gap is no better

struct Way {
  std::vector<Eigen::Vector2d> places;  // map, m, one each kTick
  double seconds() const { return kTick * static_cast<double>(places.size()); }
};

double GapAlong(const Way& way, const Foresight& foresight, const NavigateOptions& options, double start,
                double enough) {
  double gap = kWideEnough;
  for (std::size_t i = 0; i < way.places.size() && gap > enough; ++i)
    gap = std::min(gap, GapAt(foresight, options, way.places[i], start + kTick * static_cast<double>(i)));
  return gap;
}

// Whoever is foreseen stays away from there.
bool IsBesideAll(const Foresight& foresight, const NavigateOptions& options, const Eigen::Vector2d& p_map) {
  const double reach = options.robot_radius + options.person_radius + options.person_margin;
  for (const auto& way : foresight.people) {
    for (const Eigen::Vector2d& at : way) {
      if ((at - p_map).squaredNorm() < reach * reach) return false;
    }
  }
  return true;
}

// Along a unit direction to the first place where nobody walks; none: an obstacle or a long way is before it.
std::optional<double> LengthOut(const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
                                const Foresight& foresight, const NavigateOptions& options, const Costmap& costmap) {
  for (double length = 0.0; length <= kFarthest; length += kLengthStep) {
    const Eigen::Vector2d p = from + length * direction;
    if (costmap.Clearance(p) < kClear) return std::nullopt;
    if (length > 0.1 && IsBesideAll(foresight, options, p)) return length;
  }
  return std::nullopt;
}

Way WayIn(const Visit& visit, const NavigateOptions& options, Rigid2 T_map_base, PlaneVelocity velocity) {
  Way way;
  const int late = static_cast<int>(std::ceil(kObeys / kTick));
  for (int i = 0; i < late; ++i) way.places.push_back(T_map_base.translation);
  for (bool there = false; !there && way.seconds() < kLongest;) {
    const VisitStep step = StepVisit(visit, options, T_map_base, velocity, kTick);
    velocity = step.velocity;
    there = step.there;
    T_map_base = T_map_base * ExpSe2(kTick * Eigen::Vector3d(velocity.x, velocity.y, velocity.yaw));
    way.places.push_back(T_map_base.translation);
  }
  const int stay = static_cast<int>(std::ceil(Visit::kStay / kTick));
  way.places.insert(way.places.end(), static_cast<std::size_t>(stay), T_map_base.translation);
  return way;
}

// Straight, after a turn in place.
Way WayOutOf(const Rigid2& T_map_base, double turn, double direction, double length, const NavigateOptions& options) {
  Way way;
  const double starts = turn == 0.0 ? 0.0 : TurnTime(options, std::abs(turn));
  const double angle = T_map_base.angle + turn;
  const Eigen::Vector2d along = direction * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  const double top = (direction < 0.0 ? kBackShare : 1.0) * options.max_speed, ramp = top / options.acceleration;
  for (double time = 0.0, driven = 0.0; driven < length; time += kTick) {
    const double moving = std::max(0.0, time - starts);
    driven = moving < ramp ? 0.5 * options.acceleration * moving * moving : top * (moving - 0.5 * ramp);
    way.places.emplace_back(T_map_base.translation + std::min(driven, length) * along);
  }
  return way;
}

std::vector<Way> WaysOut(const Rigid2& T_map_base, const Foresight& foresight, const NavigateOptions& options,
                         const Costmap& costmap) {
  std::vector<Way> ways;
  for (int i = -kDirections / 4; i <= kDirections / 4; ++i) {
    for (const double direction : {1.0, -1.0}) {
      const double angle = T_map_base.angle + i * kDirection;
      const Eigen::Vector2d along = direction * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const std::optional<double> length = LengthOut(T_map_base.translation, along, foresight, options, costmap);
      if (length.has_value()) ways.push_back(WayOutOf(T_map_base, i * kDirection, direction, *length, options));
    }
  }
  return ways;
}

double WidestOut(const std::vector<Way>& ways, const Foresight& foresight, const NavigateOptions& options,
                 double start) {
  double widest = -std::numeric_limits<double>::infinity();
  for (const Way& way : ways) widest = std::max(widest, GapAlong(way, foresight, options, start, widest));
  return widest;
}

// All visits to one place.
class Finder {
 public:
  Finder(const Rigid2& T_map_there, const Foresight& foresight, const NavigateOptions& options, const Costmap& costmap,
         const Rigid2& T_map_base)
      : T_map_there_(T_map_there),
        foresight_(foresight),
        options_(options),
        costmap_(costmap),
        T_map_base_(T_map_base),
        ways_out_(WaysOut(T_map_there, foresight, options, costmap)) {
    for (int k = 0; k < foresight.count(); ++k)
      widest_out_.push_back(WidestOut(ways_out_, foresight, options, k * Foresight::kPeriod));
  }

  // Replaces `best` and its `worth` by a visit that is better.
  void Find(double least, std::optional<Visit>* best, double* worth) const {
    for (int i = 0; i < kDirections; ++i) {
      for (const bool back : {false, true}) {
        const double angle = T_map_there_.angle + i * kDirection;
        const Eigen::Vector2d from = (back ? 1.0 : -1.0) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
        const auto length = LengthOut(T_map_there_.translation, from, foresight_, options_, costmap_);
        if (!length.has_value()) continue;
        const Eigen::Vector2d wait = T_map_there_.translation + *length * from;
        const Visit visit{Rigid2(wait, angle), T_map_there_, back};
        const double gap = WidestOf(visit, std::max(least, *worth));
        // A place that is far away, where the robot has to go first, is worth a wider gap only.
        // So is one in whose back people walk: it sees less of them.
        const double worth_of_it = gap - kFarAway * (wait - T_map_base_.translation).norm() - (back ? kBackwards : 0.0);
        if (gap < least || worth_of_it <= *worth) continue;
        *worth = worth_of_it;
        *best = visit;
      }
    }
  }

 private:
  static constexpr double kFarAway = 0.01, kBackwards = 0.05;

  double WidestOf(const Visit& visit, double enough) const {
    const Way in = WayIn(visit, options_, visit.T_map_wait, {});
    const auto takes = static_cast<std::size_t>(std::ceil(in.seconds() / Foresight::kPeriod));
    double widest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k + takes < widest_out_.size(); ++k) {
      const double out = widest_out_[k + takes], most = std::max(widest, enough);
      if (out <= most) continue;
      widest = std::max(
          widest, std::min(out, GapAlong(in, foresight_, options_, static_cast<double>(k) * Foresight::kPeriod, most)));
    }
    return widest;
  }

  const Rigid2& T_map_there_;
  const Foresight& foresight_;
  const NavigateOptions& options_;
  const Costmap& costmap_;
  const Rigid2& T_map_base_;
  std::vector<Way> ways_out_;
  std::vector<double> widest_out_;  // m, of leaving k periods from now
};

}  // namespace

VisitStep StepVisit(const Visit& visit, const NavigateOptions& options, const Rigid2& T_map_base,
                    const PlaneVelocity& velocity, double period) {
  const double entry = visit.T_map_wait.angle, sign = visit.back ? -1.0 : 1.0;
  const Eigen::Vector2d along = sign * Eigen::Vector2d(std::cos(entry), std::sin(entry));
  const Eigen::Vector2d off = visit.T_map_there.translation - T_map_base.translation;
  const double left = along.dot(off);
  VisitStep step;
  if (left > kCloseEnough && std::abs(WrapAngle(T_map_base.angle - entry)) < kAstray) {
    const double late = options.acceleration * kBrakesLate;
    const double braking = std::sqrt(late * late + 2.0 * options.acceleration * left) - late;
    const double speed =
        std::min({options.max_speed, std::max(kSlowest, braking), sign * velocity.x + options.acceleration * period});
    const Eigen::Vector2d there = sign * (T_map_base.Inverse() * visit.T_map_there.translation);
    const double bearing = left > 3.0 * kCloseEnough ? std::atan2(there.y(), there.x()) : 0.0;
    step.velocity = {sign * speed, 0.0, std::clamp(kSteers * bearing, -kSteersAt, kSteersAt)};
    return step;
  }
  const double error = WrapAngle(visit.T_map_there.angle - T_map_base.angle);
  step.there = std::abs(error) <= options.goal_heading_tolerance;
  if (step.there) return step;
  // Faster than in the controller: the time counts here, not how exactly it ends.
  const double most = std::min(options.max_turn_rate, std::sqrt(1.5 * options.turn_acceleration * std::abs(error)));
  const double change = options.turn_acceleration * period;
  step.velocity.yaw = std::clamp(std::copysign(std::min(most, 4.0 * std::abs(error)), error), velocity.yaw - change,
                                 velocity.yaw + change);
  return step;
}

double GapOfVisit(const Visit& visit, const Foresight& foresight, const NavigateOptions& options,
                  const Costmap& costmap, const Rigid2& T_map_base, const PlaneVelocity& velocity, double delay) {
  const Way in = WayIn(visit, options, T_map_base, velocity);
  const Rigid2 T_map_there(in.places.back(), visit.T_map_there.angle);
  const double lowest = -std::numeric_limits<double>::infinity();
  const auto ways_out = WaysOut(T_map_there, foresight, options, costmap);
  return std::min(GapAlong(in, foresight, options, delay, lowest),
                  WidestOut(ways_out, foresight, options, delay + in.seconds()));
}

std::vector<double> GapsOut(const Rigid2& T_map_place, const Foresight& foresight, const NavigateOptions& options,
                            const Costmap& costmap) {
  if (foresight.empty() || IsBesideAll(foresight, options, T_map_place.translation)) return {};
  std::vector<Way> ways = WaysOut(T_map_place, foresight, options, costmap);
  const auto long_stay = static_cast<std::size_t>(kLongStay / kTick);
  ways.push_back({std::vector<Eigen::Vector2d>(long_stay, T_map_place.translation)});
  std::vector<double> gaps;
  for (int k = 0; k < foresight.count(); ++k)
    gaps.push_back(WidestOut(ways, foresight, options, k * Foresight::kPeriod));
  return gaps;
}

std::optional<Visit> FindVisit(const Rigid2& T_map_goal, const Foresight& foresight, const NavigateOptions& options,
                               const Costmap& costmap, const Rigid2& T_map_base, double least) {
  std::optional<Visit> best;
  double worth = -std::numeric_limits<double>::infinity();
  // Half the tolerance to some side may be what is missing.
  const double aside = 0.5 * options.goal_tolerance;
  Finder(T_map_goal, foresight, options, costmap, T_map_base).Find(least, &best, &worth);
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector2d offset(aside * std::cos(i * M_PI_4), aside * std::sin(i * M_PI_4));
    const Rigid2 T_map_there(T_map_goal.translation + offset, T_map_goal.angle);
    Finder(T_map_there, foresight, options, costmap, T_map_base).Find(least, &best, &worth);
  }
  return best;
}

}  // namespace planar_vslam
