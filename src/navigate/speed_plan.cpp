#include "planar_vslam/navigate/speed_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {
namespace {

constexpr int kLevels = 5;  // of speed, from 0 to the highest
// Chosen by looking at seeds 1, 3 and 4 of mechatronics_lab, as those of foresight.cpp.
constexpr double kStandsInTheWay = 0.5;  // s, what a second costs where people walk at times
constexpr double kLate = 0.02;           // s, what a second costs more for each second of driving that is left then:
                                         // of two ways to be somewhere in the end, the one that is nearer earlier
constexpr double kCaught = 40.0;         // s, that somebody walks into it when it leaves the goal
constexpr double kGapOut = 0.03;         // m, then, at least
constexpr double kNearTheGoal = 1.5;     // s of driving
constexpr double kEndsInTheWay = 4.0;    // s, likewise to be there when foresight ends

std::size_t Index(int i) { return static_cast<std::size_t>(i); }

class Planner {
 public:
  Planner(const SpeedProblem& problem, const Foresight& foresight, const NavigateOptions& options)
      : problem_(problem),
        options_(options),
        places_(static_cast<int>(problem.path.size())),
        steps_(std::max(1, foresight.count() - 1)),
        delay_(static_cast<int>(std::ceil(problem.delay / Foresight::kPeriod))) {
    rate_.reserve(Index((steps_ + 1) * places_));
    for (int t = 0; t <= steps_; ++t) {
      for (const Eigen::Vector2d& p : problem.path) rate_.push_back(RiskAt(foresight, options, p, t).rate);
    }
    cost_.assign(Index((steps_ + 1) * places_ * kLevels), 0.0F);
    choice_.assign(cost_.size(), 0);
  }

  SpeedPlan Plan() {
    for (int s = 0; s < places_; ++s) {
      for (int level = 0; level < kLevels; ++level) Cost(steps_, s, level) = static_cast<float>(AfterAll(s, level));
    }
    for (int t = steps_ - 1; t >= 0; --t) {
      for (int s = 0; s < places_; ++s) {
        for (int level = 0; level < kLevels; ++level) Choose(t, s, level);
      }
    }
    return Followed();
  }

 private:
  float& Cost(int t, int s, int level) { return cost_[Index((t * places_ + s) * kLevels + level)]; }
  double Rate(int t, int s) const { return rate_[Index(std::min(t, steps_) * places_ + s)]; }
  bool IsGoal(int s) const { return s + 1 == places_ && problem_.beyond < SpeedStep(options_); }

  // Of driving, at the highest speed.
  double TimeLeft(int s) const {
    return ((places_ - 1 - s) * SpeedStep(options_) + std::max(0.0, problem_.beyond)) / options_.max_speed;
  }

  // Braking included, so that to arrive at speed when foresight ends is no better than to have arrived.
  double AfterAll(int s, int level) const {
    const double braking = TimeLeft(s) < kNearTheGoal ? level * Foresight::kPeriod : 0.0;
    return TimeLeft(s) + braking + (problem_.walked[Index(s)] && !IsGoal(s) ? kEndsInTheWay : 0.0);
  }

  // Standing at the goal from t on, as long as it takes.
  double Holding(int t, int s) const {
    double cost = 0.0;
    const int end = t + static_cast<int>(std::ceil(problem_.hold / Foresight::kPeriod));
    for (int k = t; k < end && k <= steps_; ++k) cost += Foresight::kPeriod * Rate(k, s);
    return cost + (IsCaught(end) ? kCaught : 0.0);
  }

  // Whether somebody walks into a robot that leaves the goal then, whatever way it takes.
  bool IsCaught(int t) const {
    const std::vector<double>& gaps = problem_.gaps_out;
    return !gaps.empty() && gaps[std::min(Index(t), gaps.size() - 1)] < kGapOut;
  }

  void Choose(int t, int s, int level) {
    double best = std::numeric_limits<double>::infinity();
    if (IsGoal(s) && level == 0 && t >= delay_) best = Holding(t, s);
    int chosen = 0;
    for (int next = std::max(0, level - 1); next <= std::min(kLevels - 1, level + 1); ++next) {
      if (t < delay_ && next > 0) break;
      if (next >= level && next > 0 && SpeedOf(next) > problem_.limit[Index(s)] + 1e-6) break;
      const int to = std::min(places_ - 1, s + level + next);
      double rate = 1.0 + kLate * TimeLeft(to) + 0.5 * (Rate(t, s) + Rate(t + 1, to));
      if (level + next == 0 && problem_.walked[Index(s)]) rate += kStandsInTheWay;
      const double cost = Foresight::kPeriod * rate + static_cast<double>(Cost(t + 1, to, next));
      if (cost >= best) continue;
      best = cost;
      chosen = next;
    }
    Cost(t, s, level) = static_cast<float>(best);
    choice_[Index((t * places_ + s) * kLevels + level)] = static_cast<std::uint8_t>(chosen);
  }

  double SpeedOf(int level) const { return options_.max_speed * level / (kLevels - 1); }

  SpeedPlan Followed() {
    const double share = problem_.speed / options_.max_speed;
    int level = std::clamp(static_cast<int>(std::lround(share * (kLevels - 1))), 0, kLevels - 1);
    SpeedPlan plan;
    plan.cost = static_cast<double>(Cost(0, 0, level));
    for (int t = 0, s = 0; t < steps_; ++t) {
      if (Rate(t, s) >= Risk::kContact) {
        plan.contact = true;
        plan.contact_in = t * Foresight::kPeriod;
        break;
      }
      const int next = choice_[Index((t * places_ + s) * kLevels + level)];
      if (t == 0) plan.speed = SpeedOf(next);
      s = std::min(places_ - 1, s + level + next);
      level = next;
      if (IsGoal(s) && level == 0) {
        // It may be gone before somebody comes.
        const int end = t + 1 + static_cast<int>(std::ceil(problem_.hold / Foresight::kPeriod));
        for (int k = t + 1; k < std::min(end, steps_) && !plan.contact; ++k) {
          plan.contact = Rate(k, s) >= Risk::kContact;
          plan.contact_in = k * Foresight::kPeriod;
        }
        if (!plan.contact && IsCaught(end)) {
          plan.contact = true;
          plan.contact_in = end * Foresight::kPeriod;
        }
        break;
      }
    }
    return plan;
  }

  const SpeedProblem& problem_;
  const NavigateOptions& options_;
  int places_, steps_, delay_;
  std::vector<double> rate_;  // of risk, a step and place
  std::vector<float> cost_;   // to go, a step, place and level
  std::vector<std::uint8_t> choice_;
};

}  // namespace

double SpeedStep(const NavigateOptions& options) {
  return 0.5 * Foresight::kPeriod * options.max_speed / (kLevels - 1);
}

int SpeedPlaces(const NavigateOptions& options) {
  return 1 + static_cast<int>(std::ceil(options.foresight * options.max_speed / SpeedStep(options)));
}

SpeedPlan PlanSpeed(const SpeedProblem& problem, const Foresight& foresight, const NavigateOptions& options) {
  PV_CHECK(!problem.path.empty() && problem.limit.size() == problem.path.size() &&
               problem.walked.size() == problem.path.size(),
           "a path with its limits");
  return Planner(problem, foresight, options).Plan();
}

}  // namespace planar_vslam
