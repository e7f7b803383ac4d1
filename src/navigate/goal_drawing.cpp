#include "planar_vslam/navigate/goal_drawing.h"

#include <cmath>
#include <limits>
#include <random>

namespace planar_vslam {
namespace {

// The cells where `clearance` is kept that are connected with the nearest such cell.
std::vector<bool> Reachable(const Costmap& costmap, const Eigen::Vector2d& start, double clearance) {
  const int width = costmap.map().width, count = static_cast<int>(costmap.map().cells.size());
  const auto passable = [&](int cell) { return costmap.ClearanceOfCell(cell, Layers::kMapOnly) >= clearance; };
  std::vector<bool> reached(static_cast<std::size_t>(count), false);
  int first = -1;
  double nearest = std::numeric_limits<double>::infinity();
  for (int cell = 0; cell < count; ++cell) {
    const double distance = (costmap.CentreOf(cell) - start).norm();
    if (distance >= nearest || !passable(cell)) continue;
    first = cell;
    nearest = distance;
  }
  std::vector<int> waiting;
  const auto reach = [&](int cell) {
    if (reached[static_cast<std::size_t>(cell)] || !passable(cell)) return;
    reached[static_cast<std::size_t>(cell)] = true;
    waiting.push_back(cell);
  };
  if (first >= 0) reach(first);
  while (!waiting.empty()) {
    const int cell = waiting.back();
    waiting.pop_back();
    if (cell % width > 0) reach(cell - 1);
    if (cell % width + 1 < width) reach(cell + 1);
    if (cell >= width) reach(cell - width);
    if (cell + width < count) reach(cell + width);
  }
  return reached;
}

}  // namespace

std::vector<Rigid2> DrawGoals(const Costmap& costmap, const Eigen::Vector2d& start, const GoalDrawing& drawing) {
  if (!costmap.has_map()) return {};
  const std::vector<bool> reached = Reachable(costmap, start, drawing.way_clearance);
  std::vector<int> places;
  for (int cell = 0; cell < static_cast<int>(reached.size()); ++cell) {
    const bool free = costmap.ClearanceOfCell(cell, Layers::kMapOnly) >= drawing.clearance;
    if (reached[static_cast<std::size_t>(cell)] && free) places.push_back(cell);
  }
  if (places.empty()) return {};
  std::mt19937_64 generator(drawing.seed);
  std::uniform_int_distribution<std::size_t> place(0, places.size() - 1);
  std::uniform_real_distribution<double> heading(-M_PI, M_PI);
  std::vector<Rigid2> goals;
  for (int i = 0; i < drawing.count; ++i) {
    const Eigen::Vector2d p = costmap.CentreOf(places[place(generator)]);
    goals.emplace_back(p.x(), p.y(), heading(generator));
  }
  return goals;
}

}  // namespace planar_vslam
