#include "route.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam::sim {
namespace {

using Eigen::Vector2d;
using Line = std::vector<Vector2d>;

constexpr double kSmallest = 10.0;  // m^2 the robot's middle can be, at least
constexpr double kComfort = 0.3;    // m of clearance more than needed, within which short cuts are not tighter

class Router {
 public:
  Router(const FreeSpace& space, const RouteWish& wish, Draws* draws)
      : space_(space), wish_(wish), draws_(*draws), places_(space.LargestComponent(wish.clearance)) {
    visits_.assign(static_cast<std::size_t>(space.cells()), 0);
  }

  std::optional<Line> Route() {
    if (static_cast<double>(places_.size()) * FreeSpace::kCell * FreeSpace::kCell < kSmallest) return std::nullopt;
    here_ = draws_.Pick(places_);
    line_ = {space_.CentreOf(here_)};
    switch (wish_.style) {
      case RouteStyle::kRounds:
        DriveRounds();
        break;
      case RouteStyle::kBackAgain:
        Wander(0.5 * wish_.length, false);
        for (std::size_t i = line_.size() - 1; i-- > 0;) line_.push_back(line_[i]);
        [[fallthrough]];  // where the way there was cut short
      case RouteStyle::kWander:
        Wander(wish_.length, false);
        break;
      case RouteStyle::kOneWay:
        Wander(wish_.length, true);
        break;
    }
    return CutTo(RoundCorners(line_), wish_.length);
  }

 private:
  // From place to place; `fresh`: where it was not before.
  void Wander(double length, bool fresh) {
    while (LengthOf(line_) < length) {
      const FreeSpace::Ways ways = space_.WaysFrom(here_, wish_.clearance);
      DriveTo(fresh ? FreshPlace(ways) : OtherPlace(ways), ways);
    }
  }

  // A place some metres off, if there is one.
  int OtherPlace(const FreeSpace::Ways& ways) {
    int place = here_;
    for (int i = 0; i < 20; ++i) {
      const int other = draws_.Pick(places_);
      const double length = ways.length[static_cast<std::size_t>(other)];
      if (length > 3.0 && length < 25.0) return other;
      if (length > ways.length[static_cast<std::size_t>(place)]) place = other;
    }
    return place;
  }

  // The place to which least of the way is known.
  int FreshPlace(const FreeSpace::Ways& ways) {
    int best = here_;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 30; ++i) {
      const int other = OtherPlace(ways);
      int known = 0, all = 0;
      for (int cell = other; cell >= 0; cell = ways.before[static_cast<std::size_t>(cell)], ++all)
        known += visits_[static_cast<std::size_t>(cell)] > 0 ? 1 : 0;
      const double share = static_cast<double>(known) / all;
      if (all > 1 && share < least) best = other, least = share;
    }
    return best;
  }

  // Some places in their order around the middle, again and again.
  void DriveRounds() {
    std::vector<std::pair<double, int>> stations;  // by bearing
    Vector2d middle = Vector2d::Zero();
    for (const int place : places_) middle += space_.CentreOf(place) / static_cast<double>(places_.size());
    const int count = draws_.Whole(3, 6);
    for (int i = 0; i < count; ++i) {
      // The farthest out of a few.
      int station = draws_.Pick(places_);
      for (int j = 0; j < 4; ++j) {
        const int other = draws_.Pick(places_);
        if ((space_.CentreOf(other) - middle).norm() > (space_.CentreOf(station) - middle).norm()) station = other;
      }
      const Vector2d out = space_.CentreOf(station) - middle;
      stations.emplace_back(std::atan2(out.y(), out.x()), station);
    }
    std::sort(stations.begin(), stations.end());
    here_ = stations[0].second;
    line_ = {space_.CentreOf(here_)};
    const double before = LengthOf(line_);
    for (std::size_t i = 1; LengthOf(line_) < wish_.length; ++i) {
      DriveTo(stations[i % stations.size()].second, space_.WaysFrom(here_, wish_.clearance));
      if (i > 2 * stations.size() && LengthOf(line_) - before < 1.0) return Wander(wish_.length, false);
    }
  }

  void DriveTo(int place, const FreeSpace::Ways& ways) {
    std::vector<int> cells;
    for (int cell = place; cell >= 0; cell = ways.before[static_cast<std::size_t>(cell)]) cells.push_back(cell);
    std::reverse(cells.begin(), cells.end());
    for (const int cell : cells) MarkAround(cell);
    const Line leg = Straightened(cells);
    line_.insert(line_.end(), leg.begin() + 1, leg.end());
    here_ = place;
  }

  void MarkAround(int cell) {
    constexpr double kSeen = 0.6;  // m to both sides of the way that count as visited
    for (double x = -kSeen; x <= kSeen; x += FreeSpace::kCell) {
      for (double y = -kSeen; y <= kSeen; y += FreeSpace::kCell) {
        const int beside = space_.CellAt(space_.CentreOf(cell) + Vector2d(x, y));
        if (beside >= 0) ++visits_[static_cast<std::size_t>(beside)];
      }
    }
  }

  // Short cuts, as long as they are hardly tighter than the way they replace.
  Line Straightened(const std::vector<int>& cells) const {
    Line line = {space_.CentreOf(cells[0])};
    for (std::size_t i = 0; i + 1 < cells.size();) {
      double tightest = FreeSpace::kReach;
      std::size_t farthest = i + 1;
      for (std::size_t j = i + 1; j < cells.size(); ++j) {
        tightest = std::min(tightest, space_.ClearanceOf(cells[j]));
        const double needed = std::max(wish_.clearance, std::min(wish_.clearance + kComfort, tightest - 0.02));
        if (space_.Clearance(space_.CentreOf(cells[i]), space_.CentreOf(cells[j])) >= needed) farthest = j;
        if (j > farthest + 40) break;
      }
      line.push_back(space_.CentreOf(cells[farthest]));
      i = farthest;
    }
    return line;
  }

  // Corners cut off where there is room for it.
  Line RoundCorners(const Line& line) const {
    constexpr double kCut = 0.7;  // m, at most
    Line rounded = {line[0]};
    for (std::size_t i = 1; i + 1 < line.size(); ++i) {
      const Vector2d back = line[i - 1] - line[i], on = line[i + 1] - line[i];
      const double cut = std::min({kCut, 0.4 * back.norm(), 0.4 * on.norm()});
      const Vector2d first = line[i] + cut * back.normalized(), second = line[i] + cut * on.normalized();
      const bool sharp = back.normalized().dot(on.normalized()) > 0.5;  // turning back: on the spot
      if (!sharp && cut > 0.1 && space_.Clearance(first, second) >= wish_.clearance + 0.05) {
        rounded.push_back(first);
        rounded.push_back(second);
      } else {
        rounded.push_back(line[i]);
      }
    }
    rounded.push_back(line.back());
    return rounded;
  }

  const FreeSpace& space_;
  const RouteWish& wish_;
  Draws& draws_;
  std::vector<int> places_;
  std::vector<int> visits_;  // of each cell
  int here_ = 0;
  Line line_;
};

}  // namespace

double LengthOf(const Line& line) {
  double length = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
  return length;
}

Line CutTo(const Line& line, double length) {
  Line cut = {line[0]};
  double left = length;
  for (std::size_t i = 1; i < line.size() && left > 0.0; ++i) {
    const Vector2d step = line[i] - line[i - 1];
    if (step.norm() < 1e-3) continue;
    cut.emplace_back(line[i - 1] + std::min(1.0, left / step.norm()) * step);
    left -= step.norm();
  }
  return cut;
}

std::optional<Line> DrawRoute(const FreeSpace& space, const RouteWish& wish, Draws& draws) {
  return Router(space, wish, &draws).Route();
}

}  // namespace planar_vslam::sim
