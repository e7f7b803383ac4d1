#include "planar_vslam/localize/likelihood_field.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace planar_vslam {
namespace {

// Shares of beams, rounded, of drives in rooms where furniture had moved: at the right place three of four end on a
// mapped surface. At a wrong one a quarter does, since free space is small and surfaces are everywhere.
constexpr double kHitRight = 0.75, kHitElsewhere = 0.25;
constexpr double kFreeRight = 0.20,
                 kFreeElsewhere = 0.80;  // of those that miss: they end in free space or beyond walls
constexpr double kUnseenRight = 0.40, kUnseenElsewhere = 0.80;
constexpr double kSurfaceSigma = 0.08;  // m: range noise, errors of the map, half a cell, half a step of the search
constexpr std::uint8_t kNothing = 0, kFree = 1, kSurface = 2;

}  // namespace

const double LikelihoodField::kOnSurface = std::log(kHitRight / kHitElsewhere);
const double LikelihoodField::kInFree = std::log(kFreeRight / kFreeElsewhere);
const double LikelihoodField::kUnseen = std::log(kUnseenRight / kUnseenElsewhere);

std::vector<Eigen::Vector2d> PointsOf(const PlanarScan& scan, const Rigid3& T_frame_laser) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = scan.ranges[i];
    if (!(range >= scan.range_min && range < scan.range_max)) continue;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Eigen::Vector3d p = T_frame_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0.0);
    points.emplace_back(p.head<2>());
  }
  return points;
}

std::vector<Eigen::Vector2d> Thinned(const std::vector<Eigen::Vector2d>& points, double size) {
  std::set<std::pair<long, long>> taken;
  std::vector<Eigen::Vector2d> thinned;
  for (const Eigen::Vector2d& p : points) {
    if (taken.insert({std::lround(p.x() / size), std::lround(p.y() / size)}).second) thinned.push_back(p);
  }
  return thinned;
}

LikelihoodField::LikelihoodField(const std::vector<PosedSweep>& sweeps) {
  std::vector<std::vector<Eigen::Vector2d>> hits;
  hits.reserve(sweeps.size());
  for (const PosedSweep& sweep : sweeps)
    hits.push_back(PointsOf(*sweep.scan, Embed3(sweep.T_map_base) * sweep.T_base_laser));
  Lay(hits);
  if (empty()) return;
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), kNothing);
  for (std::size_t i = 0; i < sweeps.size(); ++i) Sweep(sweeps[i], hits[i], &seen);
  for (const std::vector<Eigen::Vector2d>& points : hits) {
    for (const Eigen::Vector2d& p : points) {
      const Eigen::Vector2d cell = CellsOf(p);
      seen[Index(static_cast<int>(cell.x()) + kMargin, static_cast<int>(cell.y()) + kMargin)] = kSurface;
    }
  }
  Score(seen);
  Pool();
}

// The rectangle that holds all points.
void LikelihoodField::Lay(const std::vector<std::vector<Eigen::Vector2d>>& hits) {
  bool any = false;
  Eigen::Vector2d upper = Eigen::Vector2d::Zero();
  for (const std::vector<Eigen::Vector2d>& points : hits) {
    for (const Eigen::Vector2d& p : points) {
      if (!any) origin_ = upper = p;
      any = true;
      origin_ = origin_.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
  }
  if (!any) return;
  origin_ -= Eigen::Vector2d::Constant(kCell);
  columns_ = static_cast<int>(CellsOf(upper).x()) + 2;
  rows_ = static_cast<int>(CellsOf(upper).y()) + 2;
  width_ = columns_ + 2 * kMargin;
  height_ = rows_ + 2 * kMargin;
}

// The cells between the laser and what it hit are free.
void LikelihoodField::Sweep(const PosedSweep& sweep, const std::vector<Eigen::Vector2d>& hits,
                            std::vector<std::uint8_t>* seen) const {
  const Eigen::Vector2d laser = CellsOf((Embed3(sweep.T_map_base) * sweep.T_base_laser).translation.head<2>());
  for (const Eigen::Vector2d& hit : hits) {
    const Eigen::Vector2d ray = CellsOf(hit) - laser;
    const int steps = static_cast<int>(ray.norm());  // one a cell; the last is the surface's
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector2d cell = laser + (static_cast<double>(i) / steps) * ray;
      const int column = static_cast<int>(std::floor(cell.x())) + kMargin;
      const int row = static_cast<int>(std::floor(cell.y())) + kMargin;
      if (column < 0 || row < 0 || column >= width_ || row >= height_) continue;
      (*seen)[Index(column, row)] = kFree;
    }
  }
}

void LikelihoodField::Score(const std::vector<std::uint8_t>& seen) {
  constexpr int kReach = 6;  // cells: beyond, the nearest surface tells nothing
  constexpr int kStand = 6;  // cells from free ones: a robot where furniture stood
  const auto quantum = [](double log_odds) {
    return static_cast<std::uint8_t>(std::lround((log_odds - kLeast) / kQuantum));
  };
  unknown_ = quantum(kUnseen);
  std::vector<std::uint8_t>& score = highest_[0];
  std::vector<std::uint8_t>& standing = standing_[0];
  score.resize(seen.size());
  standing.assign(seen.size(), 0);
  for (std::size_t i = 0; i < seen.size(); ++i) score[i] = quantum(seen[i] == kNothing ? kUnseen : kInFree);
  std::array<std::uint8_t, 2 * kReach * kReach + 1> near{};
  for (std::size_t squared = 0; squared < near.size(); ++squared) {
    const double distance2 = kCell * kCell * static_cast<double>(squared);
    const double right = kHitRight * std::exp(-0.5 * distance2 / (kSurfaceSigma * kSurfaceSigma));
    near[squared] = quantum(std::log(std::max(right / kHitElsewhere + kFreeRight, kFreeRight / kFreeElsewhere)));
  }
  surface_ = near[0];
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const std::uint8_t here = seen[Index(column, row)];
      if (here == kFree) free_area_ += kCell * kCell;
      if (here == kNothing) continue;
      const int reach = here == kFree ? kStand : kReach;
      for (int y = std::max(0, row - reach); y <= std::min(height_ - 1, row + reach); ++y) {
        for (int x = std::max(0, column - reach); x <= std::min(width_ - 1, column + reach); ++x) {
          if (here == kFree) {
            standing[Index(x, y)] = 1;
            continue;
          }
          const auto squared = static_cast<std::size_t>((x - column) * (x - column) + (y - row) * (y - row));
          score[Index(x, y)] = std::max(score[Index(x, y)], near[squared]);
        }
      }
    }
  }
}

// Each level from the one before: four squares are one twice as large. What lies outside was not seen.
void LikelihoodField::Pool() {
  for (std::size_t level = 1; level < kLevels; ++level) {
    const int half = 1 << (level - 1);
    const auto pool = [&](const std::vector<std::uint8_t>& fine, std::uint8_t outside,
                          std::vector<std::uint8_t>* coarse) {
      coarse->resize(fine.size());
      const auto at = [&](int column, int row) {
        return column < width_ && row < height_ ? fine[Index(column, row)] : outside;
      };
      for (int row = 0; row < height_; ++row) {
        for (int column = 0; column < width_; ++column) {
          (*coarse)[Index(column, row)] = std::max(std::max(at(column, row), at(column + half, row)),
                                                   std::max(at(column, row + half), at(column + half, row + half)));
        }
      }
    };
    pool(highest_[level - 1], unknown_, &highest_[level]);
    pool(standing_[level - 1], 0, &standing_[level]);
  }
}

bool LikelihoodField::MayStand(int level, int column, int row) const {
  column += kMargin, row += kMargin;
  if (column < 0 || row < 0 || column >= width_ || row >= height_) return false;
  return standing_[static_cast<std::size_t>(level)][Index(column, row)] != 0;
}

bool LikelihoodField::Crosses(const Eigen::Vector2d& laser_map, const Eigen::Vector2d& hit_map) const {
  constexpr double kBefore = 0.3;  // m before the end: the surface itself, seen from a pose that is a little off
  const Eigen::Vector2d ray = (hit_map - laser_map) / kCell;
  const double length = ray.norm() - kBefore / kCell;
  const Eigen::Vector2d start = CellsOf(laser_map);
  for (double along = 0.0; along < length; along += 1.0) {
    const Eigen::Vector2d cell = start + along * ray.normalized();
    if (Highest(0, static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y()))) == surface_)
      return true;
  }
  return false;
}

double LikelihoodField::LogOdds(const Eigen::Vector2d& p_map) const {
  const Eigen::Vector2d cell = CellsOf(p_map);
  constexpr double kFar = 1e6;  // cells
  return ToLogOdds(Highest(0, static_cast<int>(std::floor(std::clamp(cell.x(), -kFar, kFar))),
                           static_cast<int>(std::floor(std::clamp(cell.y(), -kFar, kFar)))));
}

double LikelihoodField::LogOdds(const std::vector<Eigen::Vector2d>& points, const Rigid2& T_map_base) const {
  if (points.empty()) return 0.0;
  double sum = 0.0;
  const Eigen::Matrix2d R = T_map_base.R();
  for (const Eigen::Vector2d& p : points) sum += LogOdds(Eigen::Vector2d(T_map_base.translation + R * p));
  return sum / static_cast<double>(points.size());
}

}  // namespace planar_vslam
