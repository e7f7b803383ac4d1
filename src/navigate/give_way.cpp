#include "planar_vslam/navigate/give_way.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_vslam/navigate/turning.h"

namespace planar_vslam {
namespace {

constexpr double kTurnStep = M_PI / 12.0;            // rad
constexpr double kLengthStep = 0.2, kLongest = 1.6;  // m
constexpr double kCheck = 0.05;                      // m between two places of the body that are checked
constexpr double kEndsInTheWay = 4.0;                // s, as for a speed plan
constexpr double kStraight = 0.1;                    // rad: so little is turned on the way
constexpr double kBackShare = 0.6;                   // of the highest speed, backwards: few lasers look there

// Speeding up from `from` and never braking: what is ahead of the end is short of it, which is the safe side.
double LengthAfter(double from, double top, double acceleration, double time) {
  if (time <= 0.0) return 0.0;
  const double speeding = std::min(time, std::max(0.0, top - from) / acceleration);
  return from * speeding + 0.5 * acceleration * speeding * speeding + std::max(0.0, time - speeding) * top;
}

// Brake, turn, drive straight, stand.
class Manoeuvre {
 public:
  Manoeuvre(const NavigateOptions& options, double speed, double turn, double length)
      : options_(options), turn_(turn), length_(length) {
    const bool goes_on = turn == 0.0 && speed * length > 0.0;
    from_ = goes_on ? std::abs(speed) : 0.0;
    if (goes_on) return;
    braking_ = 0.5 * speed * std::abs(speed) / options.acceleration;
    starts_ = std::abs(speed) / options.acceleration + (turn == 0.0 ? 0.0 : TurnTime(options, std::abs(turn)));
  }

  // Of the axis, in the base's frame now.
  Eigen::Vector2d After(double time) const {
    const double top = (length_ < 0.0 ? kBackShare : 1.0) * options_.max_speed;
    const double driven = LengthAfter(from_, std::max(top, from_), options_.acceleration, time - starts_);
    return At(std::copysign(std::min(std::abs(length_), driven), length_));
  }
  Eigen::Vector2d At(double length) const {
    return Eigen::Vector2d(braking_, 0.0) + length * Eigen::Vector2d(std::cos(turn_), std::sin(turn_));
  }
  double Starts() const { return starts_; }

 private:
  const NavigateOptions& options_;
  double turn_, length_, braking_ = 0.0, from_ = 0.0, starts_ = 0.0;
};

class Finder {
 public:
  Finder(const Foresight& foresight, const NavigateOptions& options, const Rigid2& T_map_base, double speed,
         const Surroundings& surroundings, const IsWalked& is_walked)
      : foresight_(foresight),
        options_(options),
        T_map_base_(T_map_base),
        speed_(speed),
        surroundings_(surroundings),
        is_walked_(is_walked),
        needed_(std::min(options.safety_margin, surroundings.Clearance() - 0.001)) {}

  WayOut Find() {
    Try(0.0, 0.0);
    for (int i = -6; i <= 6; ++i) {
      for (const double direction : {1.0, -1.0}) TryDirection(i * kTurnStep, direction);
    }
    return best_;
  }

 private:
  // All lengths until something is in the way.
  void TryDirection(double turn, double direction) {
    double checked = 0.0;
    for (double length = kLengthStep; length <= kLongest + 1e-9; length += kLengthStep) {
      const Manoeuvre manoeuvre(options_, speed_, turn, direction * length);
      for (; checked <= length + 1e-9; checked += kCheck) {
        if (surroundings_.ClearanceAt(manoeuvre.At(direction * checked)) < needed_) return;
      }
      Try(turn, direction * length);
    }
  }

  void Try(double turn, double length) {
    const Manoeuvre manoeuvre(options_, speed_, turn, length);
    WayOut way;
    way.turn = turn;
    way.length = length;
    way.cost = 2.0 * std::abs(length) / options_.max_speed + manoeuvre.Starts();
    for (int k = 0; k < foresight_.count(); ++k) {
      const Risk risk = RiskAt(foresight_, options_, T_map_base_ * manoeuvre.After(k * Foresight::kPeriod), k);
      way.cost += Foresight::kPeriod * risk.rate;
      way.contact = way.contact || risk.contact();
    }
    if (is_walked_(T_map_base_ * manoeuvre.At(length))) way.cost += kEndsInTheWay;
    if (way.cost < least_) best_ = way;
    least_ = std::min(least_, way.cost);
  }

  const Foresight& foresight_;
  const NavigateOptions& options_;
  const Rigid2& T_map_base_;
  double speed_;
  const Surroundings& surroundings_;
  const IsWalked& is_walked_;
  double needed_;  // m of clearance
  WayOut best_;
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace

WayOut FindWayOut(const Foresight& foresight, const NavigateOptions& options, const Rigid2& T_map_base,
                  const PlaneVelocity& velocity, const Surroundings& surroundings, const IsWalked& is_walked) {
  WayOut way = Finder(foresight, options, T_map_base, velocity.x, surroundings, is_walked).Find();
  if (std::abs(way.turn) > kStraight) {
    way.velocity.yaw = std::copysign(options.max_turn_rate, way.turn);
  } else if (way.length != 0.0) {
    way.velocity.x = way.length > 0.0 ? options.max_speed : -kBackShare * options.max_speed;
  }
  return way;
}

}  // namespace planar_vslam
