#include "planar_vslam/mapping2d/legged.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include "planar_vslam/geometry/check.h"
#include "posts.h"

namespace planar_vslam {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;  // m, around the outline; the first two are legs

struct Candidate {
  Corners corners;
  std::vector<int> legs;  // ascending
  Overhang outer, inner;  // a cell beyond the corners, two cells within
};

// The corners moved outwards by `margin`, along and across the first side.
Overhang Outline(const Corners& corners, double margin) {
  const Eigen::Vector2d middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  const Eigen::Vector2d along = (corners[1] - corners[0]).normalized(), across(-along.y(), along.x());
  Overhang overhang;
  overhang.outlines.emplace_back();
  for (const Eigen::Vector2d& corner : corners) {
    const Eigen::Vector2d d = corner - middle;
    const Eigen::Vector2d outwards =
        std::copysign(1.0, d.dot(along)) * along + std::copysign(1.0, d.dot(across)) * across;
    overhang.outlines[0].emplace_back(corner + margin * outwards);
  }
  return overhang;
}

Candidate MakeCandidate(const Corners& corners, std::vector<int> legs, double resolution) {
  std::sort(legs.begin(), legs.end());
  return {corners, std::move(legs), Outline(corners, resolution), Outline(corners, -2.0 * resolution)};
}

Eigen::AlignedBox2d BoxOf(const Overhang& overhang) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : overhang.outlines[0]) box.extend(corner);
  return box;
}

class LeggedFinder {
 public:
  LeggedFinder(const LeggedEvidence& evidence, const LeggedOptions& options, const OverhangOptions& face)
      : evidence_(evidence),
        options_(options),
        face_(face),
        grid_(evidence.laser),
        posts_(evidence.laser, options.max_leg) {}

  std::vector<Overhang> Find() {
    const int count = static_cast<int>(posts_.centers().size());
    for (int a = 0; a < count; ++a) {
      for (const int b : posts_.Within(At(a), options_.max_side)) {
        if (a != b) AddCandidates(a, b);
      }
    }
    std::set<int> used;
    std::vector<Overhang> found = OnFourLegs(&used);
    for (Overhang& overhang : AgainstWalls(&used)) found.push_back(std::move(overhang));
    return found;
  }

 private:
  const Eigen::Vector2d& At(int post) const { return posts_.centers()[static_cast<std::size_t>(post)]; }

  // Over the side from leg a to leg b, to its left: legs at the other corners, or something big behind both.
  void AddCandidates(int a, int b) {
    const double side = (At(b) - At(a)).norm(), tolerance = 1.5 * grid_.resolution;  // a leg shows on a few cells
    if (side < options_.min_side || side > options_.max_side) return;
    const Eigen::Vector2d along = (At(b) - At(a)) / side, left(-along.y(), along.x());
    const auto offset = [&](int from, int to) {
      const Eigen::Vector2d d = At(to) - At(from);
      return Eigen::Vector2d(d.dot(along), d.dot(left));
    };
    const double longest = side + tolerance;  // from its longer side, whose direction is the surer one
    for (const int d : posts_.Within(At(a) + 0.5 * longest * left, std::hypot(0.5 * longest, tolerance))) {
      const Eigen::Vector2d to_d = offset(a, d);
      if (std::abs(to_d.x()) > tolerance || to_d.y() < options_.min_side || to_d.y() > longest) continue;
      for (const int c : posts_.Within(At(b) + to_d.y() * left, std::hypot(tolerance, tolerance))) {
        const Eigen::Vector2d to_c = offset(b, c);
        if (std::abs(to_c.x()) > tolerance || std::abs(to_c.y() - to_d.y()) > tolerance) continue;
        on_four_legs_.push_back(MakeCandidate({At(a), At(b), At(c), At(d)}, {a, b, c, d}, grid_.resolution));
      }
    }
    const auto behind_b = posts_.BigThingBehind(At(b), left, options_.max_side);
    const auto behind_a = posts_.BigThingBehind(At(a), left, options_.max_side);
    if (!behind_a.has_value() || !behind_b.has_value()) return;
    // Furniture is a rectangle, if it stands askew before the wall: it ends where its first corner meets it.
    const double depth = std::min((*behind_a - At(a)).norm(), (*behind_b - At(b)).norm());
    const Corners corners = {At(a), At(b), At(b) + depth * left, At(a) + depth * left};
    against_wall_.push_back(MakeCandidate(corners, {a, b}, grid_.resolution));
  }

  std::vector<Overhang> OnFourLegs(std::set<int>* used) const {
    std::vector<Overhang> found;
    std::set<std::vector<int>> seen;  // a square is a candidate from several sides
    for (const Candidate& candidate : on_four_legs_) {
      if (!seen.insert(candidate.legs).second || !IsOpenSpace(candidate) || IsSeenThrough(candidate)) continue;
      used->insert(candidate.legs.begin(), candidate.legs.end());
      found.push_back(candidate.outer);
      found.back().height = options_.max_height;
    }
    return found;
  }

  std::vector<Overhang> AgainstWalls(std::set<int>* used) const {
    std::vector<std::tuple<double, std::vector<int>, Overhang>> tops;  // points per m2, legs, outline
    for (const Candidate& candidate : against_wall_) {
      if (used->count(candidate.legs[0]) + used->count(candidate.legs[1]) > 0 || !IsOpenSpace(candidate)) continue;
      const std::vector<Eigen::Vector3d> top = TopOf(candidate);
      if (static_cast<int>(top.size()) < face_.min_points || !IsCovered(candidate.corners, top)) continue;
      Overhang overhang = candidate.outer;
      for (const Eigen::Vector3d& p : top) overhang.height += p.z() / static_cast<double>(top.size());
      if (AreLinesThrough(candidate.inner, overhang.height)) continue;
      const double area = static_cast<double>(CellsWithin(candidate.inner).size());
      tops.emplace_back(static_cast<double>(top.size()) / area, candidate.legs, std::move(overhang));
    }
    std::stable_sort(tops.begin(), tops.end(), [](const auto& x, const auto& y) {
      return std::get<0>(x) != std::get<0>(y) ? std::get<0>(x) > std::get<0>(y) : std::get<1>(x) < std::get<1>(y);
    });
    std::vector<Overhang> found;
    for (auto& [density, legs, overhang] : tops) {
      if (used->count(legs[0]) + used->count(legs[1]) > 0) continue;
      used->insert(legs.begin(), legs.end());
      found.push_back(std::move(overhang));
    }
    return found;
  }

  std::vector<Eigen::Vector2i> CellsWithin(const Overhang& overhang) const {
    const Eigen::AlignedBox2d box = BoxOf(overhang);
    const Eigen::Vector2i low = CellAt(grid_, box.min()), high = CellAt(grid_, box.max());
    std::vector<Eigen::Vector2i> cells;
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        if (IsInside(grid_, x, y) && overhang.Contains(CenterOf(grid_, x, y))) cells.emplace_back(x, y);
      }
    }
    return cells;
  }

  // Between the legs the laser has to see mostly free space and nothing big, and the robot must not have been there.
  bool IsOpenSpace(const Candidate& candidate) const {
    constexpr double kFree = 0.5, kBig = 0.05;  // shares of the cells
    double free = 0.0, big = 0.0;
    const std::vector<Eigen::Vector2i> cells = CellsWithin(candidate.inner);
    for (const Eigen::Vector2i& cell : cells) {
      free += grid_.At(cell.x(), cell.y()) == 0 ? 1.0 : 0.0;
      big += posts_.IsBig(cell.x(), cell.y()) ? 1.0 : 0.0;
    }
    const auto all = static_cast<double>(cells.size());
    if (cells.empty() || free < kFree * all || big > kBig * all) return false;
    return std::none_of(evidence_.path.begin(), evidence_.path.end(),
                        [&](const Eigen::Vector2d& p) { return candidate.outer.Contains(p); });
  }

  bool AreLinesThrough(const Overhang& inner, double height) const {
    return LinesThrough(evidence_.sight_lines, inner, height, 0.0, 2.0 * face_.thickness) >= face_.min_sight_lines;
  }

  // At every height that a top may have.
  bool IsSeenThrough(const Candidate& candidate) const {
    constexpr double kStep = 0.05;  // m
    for (int i = 0; options_.min_height + i * kStep <= options_.max_height + 1e-9; ++i) {
      if (!AreLinesThrough(candidate.inner, options_.min_height + i * kStep)) return false;
    }
    return true;
  }

  // The points within that lie at one height; of several heights those of the most points.
  std::vector<Eigen::Vector3d> TopOf(const Candidate& candidate) const {
    std::vector<Eigen::Vector3d> within;
    const Eigen::AlignedBox2d box = BoxOf(candidate.inner);
    for (const Eigen::Vector3d& p : evidence_.points) {
      const bool at_height = p.z() >= options_.min_height && p.z() <= options_.max_height;
      if (at_height && box.contains(p.head<2>()) && candidate.inner.Contains(p.head<2>())) within.push_back(p);
    }
    std::stable_sort(within.begin(), within.end(), [](const auto& p, const auto& q) { return p.z() < q.z(); });
    auto best = std::pair(within.begin(), within.begin());
    for (auto first = within.begin(), last = first; first != within.end(); ++first) {
      while (last != within.end() && last->z() <= first->z() + 2.0 * face_.thickness) ++last;
      if (last - first > best.second - best.first) best = {first, last};
    }
    return {best.first, best.second};
  }

  // Whether the top's points are near enough to half of the area, and to a third of each quarter of it.
  bool IsCovered(const Corners& corners, const std::vector<Eigen::Vector3d>& top) const {
    constexpr int kSteps = 10, kHalf = kSteps / 2;  // of samples, each way
    std::array<int, 4> covered{};
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const double u = (i + 0.5) / kSteps, v = (j + 0.5) / kSteps;
        const Eigen::Vector2d at =
            (1.0 - v) * ((1.0 - u) * corners[0] + u * corners[1]) + v * ((1.0 - u) * corners[3] + u * corners[2]);
        const bool near = std::any_of(top.begin(), top.end(), [&](const Eigen::Vector3d& p) {
          return (p.head<2>() - at).norm() <= 0.5 * face_.max_gap;
        });
        covered[static_cast<std::size_t>(i / kHalf + 2 * (j / kHalf))] += near ? 1 : 0;
      }
    }
    const int total = covered[0] + covered[1] + covered[2] + covered[3];
    return 2 * total >= kSteps * kSteps && 3 * *std::min_element(covered.begin(), covered.end()) >= kHalf * kHalf;
  }

  const LeggedEvidence& evidence_;
  const LeggedOptions& options_;
  const OverhangOptions& face_;
  const OccupancyGrid2d& grid_;
  Posts posts_;
  std::vector<Candidate> on_four_legs_, against_wall_;
};

}  // namespace

std::vector<Overhang> FindLegged(const LeggedEvidence& evidence, const LeggedOptions& options,
                                 const OverhangOptions& overhang) {
  const std::vector<std::string> problems = options.Problems();
  PV_CHECK(problems.empty(), problems.front());
  if (!options.enabled || evidence.laser.cells.empty()) return {};
  return LeggedFinder(evidence, options, overhang).Find();
}

}  // namespace planar_vslam
