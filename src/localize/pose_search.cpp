#include "planar_vslam/localize/pose_search.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace planar_vslam {
namespace {

constexpr double kStepAngle = DegreesToRadians(2.0);  // 0.1 m at 3 m, half of it either way: within the field's sigma

// Poses whose base lies in one square of cells, with one heading.
struct Block {
  int bound = 0;  // no pose in it has a higher sum
  int level = 0;
  int heading = 0, column = 0, row = 0;
};
// The order of the queue: highest bound first, then finest, then by place.
bool ComesLater(const Block& a, const Block& b) {
  if (a.bound != b.bound) return a.bound < b.bound;
  if (a.level != b.level) return a.level > b.level;
  if (a.heading != b.heading) return a.heading > b.heading;
  if (a.row != b.row) return a.row > b.row;
  return a.column > b.column;
}

class Search {
 public:
  Search(const LikelihoodField& field, const std::vector<Eigen::Vector2d>& points,
         const std::optional<SearchArea>& area)
      : field_(field), points_(points), area_(area) {
    const double from = area.has_value() ? area->center.angle - area->angle : 0.0;
    const double span = area.has_value() ? 2.0 * std::min(area->angle, M_PI) : 2.0 * M_PI;
    const int count = std::max(1, static_cast<int>(std::ceil(span / kStepAngle)));
    for (int i = 0; i < count; ++i) headings_.push_back(from + (i + 0.5) * span / count);
    for (const double heading : headings_) {
      const Eigen::Matrix2d R = Rigid2(0.0, 0.0, heading).R();
      std::vector<Eigen::Vector2i> cells;
      cells.reserve(points.size());
      for (const Eigen::Vector2d& p : points) {
        const Eigen::Vector2d cell = R * p / LikelihoodField::kCell;
        cells.emplace_back(static_cast<int>(std::lround(cell.x())), static_cast<int>(std::lround(cell.y())));
      }
      rotated_.push_back(std::move(cells));
    }
  }

  std::vector<PlaceOdds> Run(std::size_t limit, double margin) {
    PushAll();
    std::vector<PlaceOdds> places;
    const auto count = static_cast<double>(points_.size());
    while (!queue_.empty() && places.size() < limit) {
      const Block block = queue_.top();
      queue_.pop();
      const double bound = LikelihoodField::ToLogOdds(block.bound / count);
      if (!places.empty() && bound < places.front().log_odds - margin) break;
      if (IsTaken(block, places)) continue;
      if (block.level > 0) {
        Split(block);
        continue;
      }
      places.push_back(Climb(field_, points_, PoseOf(block)));
    }
    std::stable_sort(places.begin(), places.end(),
                     [](const PlaceOdds& a, const PlaceOdds& b) { return a.log_odds > b.log_odds; });
    return WithoutTwins(places);
  }

 private:
  static std::vector<PlaceOdds> WithoutTwins(const std::vector<PlaceOdds>& places) {
    std::vector<PlaceOdds> kept;
    for (const PlaceOdds& place : places) {
      const auto is_same = [&place](const PlaceOdds& other) { return IsSamePlace(other.T_map_base, place.T_map_base); };
      if (std::none_of(kept.begin(), kept.end(), is_same)) kept.push_back(place);
    }
    return kept;
  }

  Rigid2 PoseOf(const Block& block) const {
    const double half = 0.5 * (1 << block.level);
    const Eigen::Vector2d cells(block.column + half, block.row + half);
    return {field_.PointOf(cells), headings_[static_cast<std::size_t>(block.heading)]};
  }
  bool IsTaken(const Block& block, const std::vector<PlaceOdds>& places) const {
    constexpr int kFine = 2;  // levels whose blocks are small against a place
    if (block.level > kFine) return false;
    const Rigid2 T = PoseOf(block);
    return std::any_of(places.begin(), places.end(),
                       [&T](const PlaceOdds& place) { return IsSamePlace(place.T_map_base, T); });
  }
  bool IsInArea(const Block& block) const {
    if (!field_.MayStand(block.level, block.column, block.row)) return false;
    if (!area_.has_value()) return true;
    const double half = LikelihoodField::kCell * (1 << block.level);
    return (PoseOf(block).translation - area_->center.translation).norm() <= area_->radius + half;
  }
  void Push(Block block) {
    if (!IsInArea(block)) return;
    int sum = 0;
    for (const Eigen::Vector2i& cell : rotated_[static_cast<std::size_t>(block.heading)])
      sum += field_.Highest(block.level, block.column + cell.x(), block.row + cell.y());
    block.bound = sum;
    queue_.push(block);
  }
  void PushAll() {
    constexpr int kTop = LikelihoodField::kLevels - 1;
    constexpr int kSize = 1 << kTop;
    for (int heading = 0; heading < static_cast<int>(headings_.size()); ++heading) {
      for (int row = 0; row < field_.rows(); row += kSize) {
        for (int column = 0; column < field_.columns(); column += kSize) Push({0, kTop, heading, column, row});
      }
    }
  }
  void Split(const Block& block) {
    const int half = 1 << (block.level - 1);
    for (const int row : {block.row, block.row + half}) {
      for (const int column : {block.column, block.column + half})
        Push({0, block.level - 1, block.heading, column, row});
    }
  }

  const LikelihoodField& field_;
  const std::vector<Eigen::Vector2d>& points_;
  const std::optional<SearchArea> area_;
  std::vector<double> headings_;
  std::vector<std::vector<Eigen::Vector2i>> rotated_;  // points in cells, by heading
  std::priority_queue<Block, std::vector<Block>, decltype(&ComesLater)> queue_{&ComesLater};
};

}  // namespace

bool IsSamePlace(const Rigid2& a, const Rigid2& b) {
  return (a.translation - b.translation).norm() <= kSamePlaceDistance &&
         std::abs(WrapAngle(a.angle - b.angle)) <= kSamePlaceAngle;
}

std::vector<PlaceOdds> FindPlaces(const LikelihoodField& field, const std::vector<Eigen::Vector2d>& points,
                                  const std::optional<SearchArea>& area, std::size_t limit, double margin) {
  if (points.empty() || field.empty()) return {};
  return Search(field, points, area).Run(limit, margin);
}

PlaceOdds Climb(const LikelihoodField& field, const std::vector<Eigen::Vector2d>& points, const Rigid2& guess) {
  constexpr double kLastStep = 0.01;    // m
  constexpr double kTurnPerStep = 0.5;  // rad a metre: a step at 2 m
  constexpr int kMostSteps = 60;
  PlaceOdds best{guess, field.LogOdds(points, guess)};
  double step = 0.5 * LikelihoodField::kCell;
  for (int i = 0; i < kMostSteps && step >= kLastStep; ++i) {
    PlaceOdds next = best;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Eigen::Vector3d xi = Eigen::Vector3d::Zero();
        xi(axis) = sign * step * (axis == 2 ? kTurnPerStep : 1.0);
        const Rigid2 T = best.T_map_base * ExpSe2(xi);
        const double log_odds = field.LogOdds(points, T);
        if (log_odds > next.log_odds) next = {T, log_odds};
      }
    }
    if (next.log_odds <= best.log_odds) step *= 0.5;
    best = next;
  }
  return best;
}

}  // namespace planar_vslam
