// What stands fixed: tables, shelves, racks, pillars.
#include "building.h"

namespace planar_vslam::sim {
namespace {

enum class Side { kSouth, kEast, kNorth, kWest };

// A thing of the size [along the wall, away from it], its back to that side of the area.
ObjectSpec AgainstWall(ObjectKind kind, const Area& area, Side side, double along, const Vector2d& size) {
  constexpr double kGap = 0.06;  // m, half of an inner wall's thickness and a little
  const double away = kGap + 0.5 * size.y();
  ObjectSpec object;
  object.kind = kind;
  object.size = size;
  switch (side) {
    case Side::kSouth:
      object.at = {area.min().x() + along, area.min().y() + away}, object.yaw = M_PI;
      break;
    case Side::kEast:
      object.at = {area.max().x() - away, area.min().y() + along}, object.yaw = -M_PI_2;
      break;
    case Side::kNorth:
      object.at = {area.min().x() + along, area.max().y() - away}, object.yaw = 0.0;
      break;
    case Side::kWest:
      object.at = {area.min().x() + away, area.min().y() + along}, object.yaw = M_PI_2;
      break;
  }
  return object;
}

class Furnisher {
 public:
  Furnisher(Building* building, Draws* draws) : building_(*building), draws_(*draws) {}

  void Fill(const Zone& zone) {
    const Vector2d size = zone.area.sizes();
    switch (zone.use) {
      case Use::kLab:
        FillWalls(zone.area, 0.75, 0.8);
        AddIslands(zone.area);
        return;
      case Use::kHall:
        FillWalls(zone.area, 0.25, 0.6);
        AddPillars(zone.area);
        return;
      case Use::kStore:
        AddRacks(zone.area);
        return;
      case Use::kRoom:
        FillWalls(zone.area, 0.55, 0.7);
        if (size.minCoeff() > 4.0 && draws_.Chance(0.5))
          AddTable(zone.area.center(), {1.6, 0.8}, draws_.Chance(0.5) ? 0.0 : M_PI_2);
        return;
      case Use::kPassage:
        if (size.minCoeff() > 2.0) FillWalls(zone.area, 0.15, 0.4);
        return;
    }
  }

 private:
  // Not in a doorway nor right before one.
  bool InTheWay(const ObjectSpec& object) const {
    constexpr double kBefore = 1.1, kAside = 0.3;  // m
    const double reach = 0.5 * object.size.norm();
    for (const Opening& opening : building_.openings) {
      const Vector2d from = object.at - opening.at;
      const double through = std::abs(from.dot(opening.across));
      const double aside = std::abs(from.x() * opening.across.y() - from.y() * opening.across.x());
      if (through < kBefore + reach && aside < 0.5 * opening.width + kAside + reach) return true;
    }
    return false;
  }
  void Add(const ObjectSpec& object) {
    if (!InTheWay(object)) building_.world.objects.push_back(object);
  }

  // Shelves, tables and cabinets along the walls, with gaps: `density` is the share of places that are used.
  void FillWalls(const Area& area, double density, double deepest) {
    constexpr double kCorner = 0.7;  // m, left free in corners
    for (const Side side : {Side::kSouth, Side::kEast, Side::kNorth, Side::kWest}) {
      const double length = side == Side::kSouth || side == Side::kNorth ? area.sizes().x() : area.sizes().y();
      for (double along = kCorner + draws_.Uniform(0.0, 1.0); along < length - kCorner;) {
        const double wide = draws_.Uniform(0.6, 1.8);
        const bool used = draws_.Chance(density), fits = along + wide < length - kCorner;
        if (used && fits) AddAtWall(area, side, along + 0.5 * wide, wide, deepest);
        along += wide + draws_.Uniform(0.05, 0.8);
      }
    }
  }

  void AddAtWall(const Area& area, Side side, double along, double wide, double deepest) {
    const auto kind = draws_.Weighted<ObjectKind>(
        {{3.0, ObjectKind::kShelf}, {deepest < 0.6 ? 0.0 : 3.0, ObjectKind::kTable}, {2.0, ObjectKind::kBox}});
    const double deep = kind == ObjectKind::kTable ? deepest : std::min(deepest, draws_.Uniform(0.3, 0.5));
    ObjectSpec object = AgainstWall(kind, area, side, along, {wide, deep});
    object.texture = Finish();
    const double highest = building_.world.room.size.z() - 0.3;
    object.height = std::min(highest, draws_.Uniform(0.8, 2.1));
    object.boards = std::max(2, static_cast<int>(object.height / 0.38) + 1);
    if (kind == ObjectKind::kTable) object.height = kTableHeight;
    Add(object);
    if (kind == ObjectKind::kTable) PutOn(object);
  }

  void AddTable(const Vector2d& at, const Vector2d& size, double yaw) {
    ObjectSpec table;
    table.kind = ObjectKind::kTable;
    table.at = at, table.size = size, table.yaw = yaw;
    table.height = kTableHeight;
    table.texture = Finish();
    Add(table);
    PutOn(table);
  }

  // Boxes, screens and books on a table.
  void PutOn(const ObjectSpec& table) {
    if (InTheWay(table)) return;
    const int count =
        static_cast<int>(std::lround(draws_.Uniform(0.0, 1.0) * building_.style.clutter * 2.0 * table.size.x()));
    for (int i = 0; i < count; ++i) {
      ObjectSpec thing;
      thing.size = {draws_.Uniform(0.2, 0.5), draws_.Uniform(0.06, 0.35)};
      thing.height = draws_.Uniform(0.12, 0.5);
      thing.bottom = table.height;
      const Vector2d half = 0.5 * table.size - Vector2d::Constant(0.5 * thing.size.norm());
      const double x = draws_.Uniform(-1.0, 1.0), y = draws_.Uniform(-1.0, 1.0);
      thing.at = Rigid2(table.at, table.yaw) * Vector2d(x * std::max(0.0, half.x()), y * std::max(0.0, half.y()));
      thing.yaw = table.yaw + draws_.Uniform(-0.7, 0.7);
      thing.texture = {draws_.Pick<std::string>({"shapes", "photo", "text", "map", "board", "books"})};
      building_.world.objects.push_back(thing);
    }
  }

  // Rows of tables with ways all round.
  void AddIslands(const Area& area) {
    const double lane = draws_.Uniform(1.5, 2.1), margin = lane + 0.75;
    const Vector2d size(draws_.Uniform(1.6, 3.0), draws_.Uniform(0.7, 1.5));
    const Vector2d inner = area.sizes() - Vector2d::Constant(2.0 * margin);
    const auto count = [lane](double room, double one) { return static_cast<int>((room + lane) / (one + lane)); };
    const int columns = count(inner.x(), size.x()), rows = count(inner.y(), size.y());
    for (int i = 0; i < columns; ++i) {
      for (int j = 0; j < rows; ++j) {
        const Vector2d step = size + Vector2d::Constant(lane);
        const Vector2d first = area.center() - 0.5 * Vector2d((columns - 1) * step.x(), (rows - 1) * step.y());
        AddTable(first + Vector2d(i * step.x(), j * step.y()), size, 0.0);
      }
    }
  }

  void AddPillars(const Area& area) {
    if (draws_.Chance(0.2)) return;
    const Vector2d spacing(draws_.Uniform(4.0, 7.0), draws_.Uniform(4.0, 7.0));
    const double radius = draws_.Uniform(0.15, 0.45);
    const TextureSpec texture = draws_.Chance(0.3) ? TextureSpec{"brick"} : building_.world.room.walls;
    for (double x = area.min().x() + 0.5 * spacing.x() + 0.5; x < area.max().x() - 2.0; x += spacing.x()) {
      for (double y = area.min().y() + 0.5 * spacing.y() + 0.5; y < area.max().y() - 2.0; y += spacing.y()) {
        ObjectSpec pillar;
        pillar.kind = ObjectKind::kPillar;
        pillar.at = {x, y}, pillar.size = {2.0 * radius, 2.0 * radius};
        pillar.height = building_.world.room.size.z();
        pillar.texture = texture;
        Add(pillar);
      }
    }
  }

  // Double rows of racks along y, aisles between that look alike, ways across at both ends and perhaps in the middle.
  void AddRacks(const Area& area) {
    const double aisle = draws_.Uniform(1.8, 3.0), deep = draws_.Uniform(0.6, 1.0), end = draws_.Uniform(1.8, 2.8);
    const double unit = draws_.Uniform(1.6, 2.6),
                 height = std::min(building_.world.room.size.z() - 0.5, draws_.Uniform(1.8, 3.4));
    const bool across = draws_.Chance(0.6);
    const int boards = draws_.Whole(3, 5);
    const double length = area.sizes().y() - 2.0 * end;
    const int units = static_cast<int>(length / unit);
    for (double x = area.min().x() + aisle + deep; x < area.max().x() - aisle - deep; x += aisle + 2.0 * deep) {
      for (int k = 0; k < units; ++k) {
        if (across && units > 3 && k == units / 2) continue;
        const double y = area.min().y() + end + (k + 0.5) * unit;
        for (const double side : {-1.0, 1.0}) {
          ObjectSpec rack;
          rack.kind = ObjectKind::kShelf;
          rack.at = {x + 0.5 * side * deep, y};
          rack.size = {unit - 0.02, deep - 0.01};
          rack.yaw = side > 0.0 ? M_PI_2 : -M_PI_2;
          rack.height = height, rack.boards = boards;
          rack.texture = Finish();
          if (building_.style.alike || draws_.Chance(0.9)) Add(rack);
        }
      }
    }
  }

  TextureSpec Finish() {
    TextureSpec finish = building_.style.furniture;
    // Three of them: every other shade is another texture to draw and to hold.
    if (!building_.style.alike) finish.shade = std::clamp(finish.shade + 35 * draws_.Whole(-1, 1), 50, 220);
    return finish;
  }

  static constexpr double kTableHeight = 0.74;  // m
  Building& building_;
  Draws& draws_;
};

}  // namespace

void Furnish(Building* building, Draws& draws) {
  Furnisher furnisher(building, &draws);
  const std::vector<Zone> zones = building->zones;
  for (const Zone& zone : zones) furnisher.Fill(zone);
}

}  // namespace planar_vslam::sim
