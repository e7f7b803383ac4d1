#include "schur_solver.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "schur_system.h"

namespace planar_vslam {
namespace {

// Of the steps, as Nielsen has it.
struct Damping {
  double lambda = 1e-4, growth = 2.0;

  void Accept(double ratio) {
    const double x = 2.0 * ratio - 1.0;
    lambda *= std::max(1.0 / 3.0, 1.0 - x * x * x);
    growth = 2.0;
  }
  void Reject() {
    lambda *= growth;
    growth *= 2.0;
  }
  bool exhausted() const { return lambda > 1e12; }
};

// Adds the time it lives.
class AddTime {
 public:
  explicit AddTime(double* ms) : ms_(ms) {}
  ~AddTime() { *ms_ += watch_.Milliseconds(); }
  AddTime(const AddTime&) = delete;
  AddTime& operator=(const AddTime&) = delete;

 private:
  double* ms_;
  Stopwatch watch_;
};

struct Times {
  double residuals_ms = 0.0, jacobians_ms = 0.0, linear_solver_ms = 0.0;
};

double Evaluate(SchurSystem* system, Times* times) {
  const AddTime timed(&times->residuals_ms);
  return system->Evaluate();
}
void Linearize(SchurSystem* system, Times* times) {
  const AddTime timed(&times->jacobians_ms);
  system->Linearize();
}
bool Solve(SchurSystem* system, double lambda, Times* times) {
  const AddTime timed(&times->linear_solver_ms);
  return system->Solve(lambda);
}

// Moves to the end of the damped step if that lowers the cost: then the gain. Else nothing moves.
std::optional<double> TryStep(double cost, SchurSystem* system, BundleProblem* problem, Damping* damping,
                              Times* times) {
  if (!Solve(system, damping->lambda, times)) {
    damping->Reject();
    return std::nullopt;
  }
  constexpr double kLeastRatio = 1e-3;  // of true to predicted decrease
  const std::vector<BundlePose> poses = problem->poses;
  const std::vector<BundlePoint> points = problem->points;
  system->Move();
  const double gain = cost - Evaluate(system, times);
  const double ratio = gain / system->PredictedDecrease(damping->lambda);
  if (gain == 0.0 || (gain > 0.0 && ratio > kLeastRatio)) {  // never where the cost is no number
    damping->Accept(ratio);
    return gain;
  }
  problem->poses = poses;
  problem->points = points;
  damping->Reject();
  return std::nullopt;
}

}  // namespace

BundleOutcome SolveWithSchur(BundleProblem* problem, const BundleLimits& limits) {
  SchurSystem system(problem);
  Times times;
  BundleOutcome outcome;
  double cost = Evaluate(&system, &times);
  outcome.initial_cost = outcome.final_cost = cost;
  outcome.iterations = 1;
  outcome.usable = system.IsFinite() && std::isfinite(cost);
  outcome.message = outcome.usable ? "iterations used up" : "the state is not finite";
  if (!outcome.usable) return outcome;
  Damping damping;
  bool moved = true;
  while (outcome.iterations <= limits.max_iterations) {
    if (moved) Linearize(&system, &times);
    ++outcome.iterations;
    const std::optional<double> gain = TryStep(cost, &system, problem, &damping, &times);
    moved = gain.has_value();
    cost -= gain.value_or(0.0);
    if (moved && *gain <= limits.relative_gain * cost) {
      outcome.message = "gain below its limit";
      break;
    }
    if (limits.hurry != nullptr && limits.hurry->load(std::memory_order_relaxed)) {
      outcome.message = "in a hurry";
      break;
    }
    if (!moved && damping.exhausted()) {
      outcome.message = "no step lowers the cost";
      break;
    }
  }
  outcome.final_cost = cost;
  outcome.times = {{"bundle.residuals", times.residuals_ms},
                   {"bundle.jacobians", times.jacobians_ms},
                   {"bundle.linear_solver", times.linear_solver_ms}};
  return outcome;
}

}  // namespace planar_vslam
