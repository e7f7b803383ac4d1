#include "planar_vslam/navigate/global_planner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <queue>
#include <utility>

namespace planar_vslam {
namespace {

std::size_t Index(int i) { return static_cast<std::size_t>(i); }

std::string Text(const char* format, double a, double b, double c = 0.0) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), format, a, b, c);  // NOLINT(cppcoreguidelines-pro-type-vararg)
  return text.data();
}

class Search {
 public:
  Search(const Costmap& costmap, const NavigateOptions& options, Layers layers, const std::vector<float>& extra)
      : costmap_(costmap),
        options_(options),
        layers_(layers),
        extra_(extra),
        width_(costmap.map().width),
        height_(costmap.map().height) {}

  bool Fits(int cell) const { return costmap_.ClearanceOfCell(cell, layers_) >= 0.0; }

  // -1: none within the body's radius.
  int NearestFit(const Eigen::Vector2d& p) const {
    const int reach = static_cast<int>(options_.robot_radius / costmap_.map().resolution);
    const int centre = costmap_.CellOf(p);
    int best = -1;
    double best_distance = std::numeric_limits<double>::infinity();
    for (int y = std::max(0, centre / width_ - reach); y <= std::min(height_ - 1, centre / width_ + reach); ++y) {
      for (int x = std::max(0, centre % width_ - reach); x <= std::min(width_ - 1, centre % width_ + reach); ++x) {
        const int cell = y * width_ + x;
        const double distance = (costmap_.CentreOf(cell) - p).norm();
        if (distance >= best_distance || !Fits(cell)) continue;
        best = cell;
        best_distance = distance;
      }
    }
    return best;
  }

  // Cells from start to goal; empty: no way.
  std::vector<int> Run(int start, int goal) {
    const std::size_t count = costmap_.map().cells.size();
    cost_.assign(count, std::numeric_limits<float>::infinity());
    parent_.assign(count, -1);
    goal_ = goal;
    cost_[Index(start)] = 0.0F;
    open_.emplace(Bound(start), start);
    while (!open_.empty()) {
      const auto [bound, cell] = open_.top();
      open_.pop();
      if (cell == goal) return WayTo(goal);
      if (bound > static_cast<double>(cost_[Index(cell)]) + Bound(cell) + 1e-6) continue;  // reached cheaper since
      Expand(cell);
    }
    return {};
  }

 private:
  // Octile distance in cells: never more than the true cost.
  double Bound(int cell) const {
    const int dx = std::abs(cell % width_ - goal_ % width_), dy = std::abs(cell / width_ - goal_ / width_);
    return std::max(dx, dy) + (M_SQRT2 - 1.0) * std::min(dx, dy);
  }

  void Expand(int cell) {
    const int x = cell % width_, y = cell / width_;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if ((dx == 0 && dy == 0) || x + dx < 0 || y + dy < 0 || x + dx >= width_ || y + dy >= height_) continue;
        const int next = (y + dy) * width_ + x + dx;
        if (!Fits(next)) continue;
        const double length = dx != 0 && dy != 0 ? M_SQRT2 : 1.0;
        const double extra = extra_.empty() ? 0.0 : static_cast<double>(extra_[Index(next)]);
        const auto cost =
            static_cast<float>(static_cast<double>(cost_[Index(cell)]) +
                               length * (1.0 + extra + options_.inflation_weight * costmap_.CostOfCell(next, layers_)));
        if (cost >= cost_[Index(next)]) continue;
        cost_[Index(next)] = cost;
        parent_[Index(next)] = cell;
        open_.emplace(static_cast<double>(cost) + Bound(next), next);
      }
    }
  }

  std::vector<int> WayTo(int goal) const {
    std::vector<int> way;
    for (int cell = goal; cell >= 0; cell = parent_[Index(cell)]) way.push_back(cell);
    std::reverse(way.begin(), way.end());
    return way;
  }

  using Entry = std::pair<double, int>;
  const Costmap& costmap_;
  const NavigateOptions& options_;
  Layers layers_;
  const std::vector<float>& extra_;
  int width_, height_, goal_ = 0;
  std::vector<float> cost_;
  std::vector<int> parent_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
};

// Pulls points towards the middle of their neighbours, never closer to an obstacle than the planned way comes.
void Smooth(const Costmap& costmap, Layers layers, std::vector<Eigen::Vector2d>* path) {
  constexpr int kRounds = 30;
  const double enough = costmap.map().resolution;  // m of clearance
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 1; i + 1 < path->size(); ++i) {
      const Eigen::Vector2d moved = 0.5 * (*path)[i] + 0.25 * ((*path)[i - 1] + (*path)[i + 1]);
      const double clearance = costmap.Clearance(moved, layers);
      if (clearance >= enough || clearance >= costmap.Clearance((*path)[i], layers)) (*path)[i] = moved;
    }
  }
}

Plan Failed(PlanStatus status, std::string reason) { return {status, std::move(reason), {}}; }

Plan CheckGoal(const Costmap& costmap, const NavigateOptions& options, const Eigen::Vector2d& goal, Layers layers) {
  switch (costmap.KindAt(goal)) {
    case CellKind::kOutside:
      return Failed(PlanStatus::kOutsideMap, Text("the goal (%.2f, %.2f) is outside the map", goal.x(), goal.y()));
    case CellKind::kOccupied:
      if (layers == Layers::kMapOnly && costmap.Clearance(goal, layers) >= 0.0) break;
      return Failed(PlanStatus::kInObstacle, Text("the goal (%.2f, %.2f) is in an obstacle", goal.x(), goal.y()));
    case CellKind::kUnknown:
      if (options.allow_unknown) break;
      return Failed(PlanStatus::kInUnknown, Text("the goal (%.2f, %.2f) is in unknown space", goal.x(), goal.y()));
    case CellKind::kFree:
      break;
  }
  const double clearance = costmap.Clearance(goal, layers);
  if (clearance >= 0.0) return {PlanStatus::kFound, "", {}};
  return Failed(PlanStatus::kTooNarrow,
                Text("the goal (%.2f, %.2f) is too close to an obstacle or to unknown space: the body lacks %.2f m",
                     goal.x(), goal.y(), -clearance));
}

}  // namespace

Plan PlanPath(const Costmap& costmap, const NavigateOptions& options, const Eigen::Vector2d& start,
              const Eigen::Vector2d& goal, Layers layers, const std::vector<float>& extra) {
  if (!goal.allFinite()) return Failed(PlanStatus::kNotFinite, "the goal is not a finite position");
  if (!start.allFinite()) return Failed(PlanStatus::kNotFinite, "the robot's position is not finite");
  if (!costmap.has_map()) return Failed(PlanStatus::kNoMap, "there is no map yet");
  const Plan checked = CheckGoal(costmap, options, goal, layers);
  if (!checked.found()) return checked;
  if (costmap.CellOf(start) < 0)
    return Failed(PlanStatus::kStartBlocked, Text("the robot (%.2f, %.2f) is outside the map", start.x(), start.y()));
  Search search(costmap, options, layers, extra);
  const int first = search.NearestFit(start);
  if (first < 0)
    return Failed(PlanStatus::kStartBlocked,
                  Text("the robot (%.2f, %.2f) stands where its body does not fit", start.x(), start.y()));
  const std::vector<int> way = search.Run(first, costmap.CellOf(goal));
  if (way.empty()) return Failed(PlanStatus::kNoWay, Text("no way to the goal (%.2f, %.2f)", goal.x(), goal.y()));
  Plan plan{PlanStatus::kFound, "", {start}};
  for (const int cell : way) plan.path.push_back(costmap.CentreOf(cell));
  plan.path.back() = goal;
  Smooth(costmap, layers, &plan.path);
  return plan;
}

}  // namespace planar_vslam
