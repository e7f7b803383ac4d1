#include "planar_vslam/sim/solids.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

using Polygon = std::vector<Eigen::Vector2d>;

constexpr int kPillarSides = 16;

// Builds the parts of one object in its own frame: x to the right of its front, y towards its back.
class Builder {
 public:
  Builder(const ObjectSpec& object, int index, std::vector<Prism>* prisms)
      : object_(object), T_world_object_(object.at, object.yaw), index_(index), prisms_(prisms) {}

  // A box with the footprint [low, high] and heights above the object's bottom.
  void Box(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double bottom, double top,
           const TextureSpec& texture) {
    Add({low, {high.x(), low.y()}, high, {low.x(), high.y()}}, bottom, top, texture);
  }
  void Add(const Polygon& footprint, double bottom, double top, const TextureSpec& texture) {
    Prism prism{{}, object_.bottom + bottom, object_.bottom + top, texture, index_, false, {}};
    for (const Eigen::Vector2d& corner : footprint) prism.footprint.push_back(T_world_object_ * corner);
    prisms_->push_back(std::move(prism));
  }
  // A box to drive on whose top rises linearly along x.
  void Slope(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double low_top, double high_top,
             const TextureSpec& texture) {
    Box(low, high, 0.0, std::max(low_top, high_top), texture);
    Prism& prism = prisms_->back();
    prism.is_floor = true;
    prism.corner_tops = {low_top, high_top, high_top, low_top};
    for (double& top : prism.corner_tops) top += object_.bottom;
  }
  void Legs(double thickness, double top, const TextureSpec& texture) {
    const Eigen::Vector2d half = 0.5 * object_.size;
    const double far_x = half.x() - thickness, far_y = half.y() - thickness;
    for (const Eigen::Vector2d& low : {Eigen::Vector2d(-half.x(), -half.y()), Eigen::Vector2d(far_x, -half.y()),
                                       Eigen::Vector2d(far_x, far_y), Eigen::Vector2d(-half.x(), far_y)}) {
      Box(low, low + Eigen::Vector2d::Constant(thickness), 0.0, top, texture);
    }
  }

 private:
  const ObjectSpec& object_;
  Rigid2 T_world_object_;
  int index_;
  std::vector<Prism>* prisms_;
};

void BuildTable(const ObjectSpec& object, Builder& builder) {
  constexpr double kTop = 0.04, kLeg = 0.05;  // m, thicknesses
  const Eigen::Vector2d half = 0.5 * object.size;
  const double under = std::max(0.5 * object.height, object.height - kTop);
  builder.Legs(std::min(kLeg, half.minCoeff()), under, TextureSpec{"wood", 90});
  builder.Box(-half, half, under, object.height, object.texture);
}

void BuildChair(const ObjectSpec& object, Builder& builder) {
  constexpr double kSeatHeight = 0.46, kSeat = 0.05, kBack = 0.04, kLeg = 0.035;  // m
  const Eigen::Vector2d half = 0.5 * object.size;
  const double seat = std::min(kSeatHeight, 0.6 * object.height);
  builder.Legs(std::min(kLeg, half.minCoeff()), seat - kSeat, TextureSpec{"plain", 60});
  builder.Box(-half, half, seat - kSeat, seat, object.texture);
  builder.Box({-half.x(), half.y() - std::min(kBack, half.y())}, half, seat, object.height, object.texture);
}

// Side and back panels, boards, and a row of books on each board but the top one.
void BuildShelf(const ObjectSpec& object, Builder& builder) {
  const Eigen::Vector2d half = 0.5 * object.size;
  const double panel = std::min(0.02, 0.1 * object.size.minCoeff());  // m
  builder.Box(-half, {-half.x() + panel, half.y()}, 0.0, object.height, object.texture);
  builder.Box({half.x() - panel, -half.y()}, half, 0.0, object.height, object.texture);
  builder.Box({-half.x() + panel, half.y() - panel}, {half.x() - panel, half.y()}, 0.0, object.height, object.texture);
  const double gap = (object.height - panel) / (object.boards - 1);
  const double left = -half.x() + panel, right = half.x() - panel, inner = right - left;
  for (int board = 0; board < object.boards; ++board) {
    const double z = board * gap;
    builder.Box({left, -half.y()}, {right, half.y() - panel}, z, z + panel, object.texture);
    if (board + 1 == object.boards) break;
    // The rows differ in length, height and depth, so that shelves do not look like wallpaper.
    const double fill = 0.55 + 0.11 * (board * 3 % 4), tall = 0.62 + 0.08 * (board * 2 % 3);
    const double front = -half.y() + object.size.y() * (0.1 + 0.06 * (board % 3));
    const double start = board % 2 == 0 ? left : right - fill * inner;
    builder.Box({start, front}, {start + fill * inner, half.y() - panel}, z + panel, z + panel + tall * (gap - panel),
                TextureSpec{"books"});
  }
}

void BuildPillar(const ObjectSpec& object, Builder& builder) {
  Polygon circle;
  for (int i = 0; i < kPillarSides; ++i) {
    const double angle = 2.0 * M_PI * i / kPillarSides;
    circle.emplace_back(0.5 * object.size.x() * std::cos(angle), 0.5 * object.size.y() * std::sin(angle));
  }
  builder.Add(circle, 0.0, object.height, object.texture);
}

// Five feet, a column, seat and back.
void BuildSwivelChair(const ObjectSpec& object, Builder& builder) {
  constexpr double kSeatHeight = 0.48, kSeat = 0.07, kBack = 0.05, kColumn = 0.03, kFoot = 0.02;  // m
  constexpr int kFeet = 5;
  const Eigen::Vector2d half = 0.5 * object.size;
  const TextureSpec metal{"plain", 45};
  for (int i = 0; i < kFeet; ++i) {
    const double angle = 2.0 * M_PI * i / kFeet + 0.3;
    const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
    const double reach = half.minCoeff();
    builder.Add({-kFoot * across, reach * along - kFoot * across, reach * along + kFoot * across, kFoot * across}, 0.04,
                0.11, metal);
  }
  const double seat = std::min(kSeatHeight, 0.6 * object.height);
  builder.Box({-kColumn, -kColumn}, {kColumn, kColumn}, 0.11, seat - kSeat, metal);
  builder.Box(-half, half, seat - kSeat, seat, object.texture);
  builder.Box({-0.8 * half.x(), half.y() - kBack}, {0.8 * half.x(), half.y()}, seat + 0.08, object.height,
              object.texture);
}

// Pieces between the doorways, and lintels above them.
void BuildWall(const ObjectSpec& object, Builder& builder) {
  const double half_length = 0.5 * object.size.x(), half_width = 0.5 * object.size.y();
  const auto piece = [&](double from, double to, double bottom) {
    if (to - from < 1e-6) return;
    builder.Box({from - half_length, -half_width}, {to - half_length, half_width}, bottom, object.height,
                object.texture);
  };
  double done = 0.0;
  for (const DoorwaySpec& doorway : object.doorways) {
    piece(done, doorway.along - 0.5 * doorway.width, 0.0);
    done = doorway.along + 0.5 * doorway.width;
    if (doorway.height < object.height) piece(doorway.along - 0.5 * doorway.width, done, doorway.height);
  }
  piece(done, object.size.x(), 0.0);
}

// Rises along its x axis, is level for the plateau, and falls again or ends.
void BuildRamp(const ObjectSpec& object, Builder& builder) {
  const double end = 0.5 * object.size.x(), half_width = 0.5 * object.size.y();
  const double rise = (object.size.x() - object.plateau) / (object.both_ways ? 2.0 : 1.0);
  const auto piece = [&](double from, double to, double from_height, double to_height) {
    if (to - from < 1e-6) return;
    builder.Slope({from, -half_width}, {to, half_width}, from_height, to_height, object.texture);
  };
  piece(-end, -end + rise, 0.0, object.height);
  piece(-end + rise, -end + rise + object.plateau, object.height, object.height);
  if (object.both_ways) piece(end - rise, end, object.height, 0.0);
}

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

std::vector<Prism> MakeSolids(const std::vector<ObjectSpec>& objects) {
  std::vector<Prism> prisms;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const ObjectSpec& object = objects[i];
    Builder builder(object, static_cast<int>(i), &prisms);
    const Eigen::Vector2d half = 0.5 * object.size;
    switch (object.kind) {
      case ObjectKind::kBox:
        builder.Box(-half, half, 0.0, object.height, object.texture);
        break;
      case ObjectKind::kTable:
        BuildTable(object, builder);
        break;
      case ObjectKind::kChair:
        BuildChair(object, builder);
        break;
      case ObjectKind::kSwivelChair:
        BuildSwivelChair(object, builder);
        break;
      case ObjectKind::kWall:
        BuildWall(object, builder);
        break;
      case ObjectKind::kRamp:
        BuildRamp(object, builder);
        break;
      case ObjectKind::kShelf:
        BuildShelf(object, builder);
        break;
      case ObjectKind::kPillar:
        BuildPillar(object, builder);
        break;
    }
  }
  return prisms;
}

double Prism::TopAt(const Eigen::Vector2d& at) const {
  if (corner_tops.empty()) return top;
  // Linear over the rectangle, from the edge through the first corner to the opposite one.
  const Eigen::Vector2d along = footprint[1] - footprint[0], across = footprint[3] - footprint[0];
  const Eigen::Vector2d from_corner = at - footprint[0];
  return corner_tops[0] + (corner_tops[1] - corner_tops[0]) * from_corner.dot(along) / along.squaredNorm() +
         (corner_tops[3] - corner_tops[0]) * from_corner.dot(across) / across.squaredNorm();
}

double Distance(const Eigen::Vector2d& point, const std::vector<Eigen::Vector2d>& polygon) {
  bool inside = true;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d edge = polygon[(i + 1) % polygon.size()] - a, to_point = point - a;
    inside = inside && Cross(edge, to_point) >= 0.0;
    const double along = std::clamp(edge.dot(to_point) / edge.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (to_point - along * edge).norm());
  }
  return inside ? 0.0 : nearest;
}

bool OverlapsSquare(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& min, double side) {
  constexpr double kTouch = 1e-9;  // m, what rounding may make of two edges that only touch
  const Polygon square = {min, min + Eigen::Vector2d(side, 0), min + Eigen::Vector2d(side, side),
                          min + Eigen::Vector2d(0, side)};
  // Two convex shapes are apart exactly when an edge of one of them separates them.
  const auto separated_by_edge_of = [](const Polygon& a, const Polygon& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Eigen::Vector2d edge = (a[(i + 1) % a.size()] - a[i]).normalized();
      const auto outside = [&](const Eigen::Vector2d& p) { return Cross(edge, p - a[i]) < kTouch; };
      if (std::all_of(b.begin(), b.end(), outside)) return true;
    }
    return false;
  };
  return !separated_by_edge_of(polygon, square) && !separated_by_edge_of(square, polygon);
}

}  // namespace planar_vslam
