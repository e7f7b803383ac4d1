#include "free_space.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "planar_vslam/sim/solids.h"

namespace planar_vslam::sim {
namespace {

using Eigen::Vector2d;

constexpr int kSides = 8;
constexpr int kStepX[kSides] = {1, 0, -1, 0, 1, 1, -1, -1}, kStepY[kSides] = {0, 1, 0, -1, 1, -1, 1, -1};
constexpr double kWide = 0.8;    // m of clearance from which more makes a way no better
constexpr double kNarrow = 3.0;  // what a metre of the narrowest way costs more than one of a wide way

}  // namespace

FreeSpace::FreeSpace(const World& world)
    : columns_(static_cast<int>(world.room.size.x() / kCell)), rows_(static_cast<int>(world.room.size.y() / kCell)) {
  const Vector2d room = world.room.size.head<2>();
  for (int cell = 0; cell < cells(); ++cell) {
    const Vector2d at = CentreOf(cell);
    clearance_.push_back(std::min({kReach, at.minCoeff(), (room - at).minCoeff()}));
  }
  for (const Prism& solid : MakeSolids(world.objects)) {
    if (!solid.MeetsBand(kBodyLow, kBodyHigh)) continue;
    Eigen::AlignedBox2d box;
    for (const Vector2d& corner : solid.footprint) box.extend(corner);
    const auto index = [](double along, int count) {
      return std::clamp(static_cast<int>(along / kCell), 0, count - 1);
    };
    const int x0 = index(box.min().x() - kReach, columns_), x1 = index(box.max().x() + kReach, columns_);
    const int y0 = index(box.min().y() - kReach, rows_), y1 = index(box.max().y() + kReach, rows_);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        double& clearance = clearance_[static_cast<std::size_t>(y * columns_ + x)];
        clearance = std::min(clearance, Distance(CentreOf(y * columns_ + x), solid.footprint));
      }
    }
  }
}

int FreeSpace::CellAt(const Vector2d& at) const {
  const int x = static_cast<int>(std::floor(at.x() / kCell)), y = static_cast<int>(std::floor(at.y() / kCell));
  return x < 0 || y < 0 || x >= columns_ || y >= rows_ ? -1 : y * columns_ + x;
}

Vector2d FreeSpace::CentreOf(int cell) const {
  return kCell * (Vector2d(cell % columns_, cell / columns_) + Vector2d::Constant(0.5));
}

double FreeSpace::Clearance(const Vector2d& at) const {
  const int cell = CellAt(at);
  return cell < 0 ? 0.0 : ClearanceOf(cell);
}

double FreeSpace::Clearance(const Vector2d& from, const Vector2d& to) const {
  constexpr double kStep = 0.5 * kCell;
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kStep)));
  double least = kReach;
  for (int i = 0; i <= steps; ++i)
    least = std::min(least, Clearance(from + static_cast<double>(i) / steps * (to - from)));
  return least;
}

int FreeSpace::Neighbour(int cell, int side) const {
  const int x = cell % columns_ + kStepX[side], y = cell / columns_ + kStepY[side];
  return x < 0 || y < 0 || x >= columns_ || y >= rows_ ? -1 : y * columns_ + x;
}

std::vector<int> FreeSpace::LargestComponent(double clearance) const {
  std::vector<int> largest;
  std::vector<char> seen(clearance_.size(), 0);
  for (int first = 0; first < cells(); ++first) {
    if (seen[static_cast<std::size_t>(first)] != 0 || ClearanceOf(first) < clearance) continue;
    std::vector<int> component = {first};
    seen[static_cast<std::size_t>(first)] = 1;
    for (std::size_t i = 0; i < component.size(); ++i) {
      for (int side = 0; side < kSides; ++side) {
        const int next = Neighbour(component[i], side);
        if (next < 0 || seen[static_cast<std::size_t>(next)] != 0 || ClearanceOf(next) < clearance) continue;
        seen[static_cast<std::size_t>(next)] = 1;
        component.push_back(next);
      }
    }
    if (component.size() > largest.size()) largest = std::move(component);
  }
  return largest;
}

FreeSpace::Ways FreeSpace::WaysFrom(int start, double clearance) const {
  Ways ways{std::vector<int>(clearance_.size(), -1),
            std::vector<double>(clearance_.size(), std::numeric_limits<double>::infinity())};
  std::vector<double> cost = ways.length;
  using Entry = std::pair<double, int>;  // ties go to the lower cell
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[static_cast<std::size_t>(start)] = ways.length[static_cast<std::size_t>(start)] = 0.0;
  open.emplace(0.0, start);
  while (!open.empty()) {
    const auto [reached, cell] = open.top();
    open.pop();
    if (reached > cost[static_cast<std::size_t>(cell)]) continue;
    for (int side = 0; side < kSides; ++side) {
      const int next = Neighbour(cell, side);
      if (next < 0 || ClearanceOf(next) < clearance) continue;
      const double step = kCell * std::hypot(kStepX[side], kStepY[side]);
      const double tight = std::max(0.0, 1.0 - (ClearanceOf(next) - clearance) / (kWide - clearance));
      const double total = reached + step * (1.0 + kNarrow * tight * tight);
      const auto n = static_cast<std::size_t>(next);
      if (total >= cost[n]) continue;
      cost[n] = total;
      ways.before[n] = cell;
      ways.length[n] = ways.length[static_cast<std::size_t>(cell)] + step;
      open.emplace(total, next);
    }
  }
  return ways;
}

}  // namespace planar_vslam::sim
