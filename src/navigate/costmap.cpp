#include "planar_vslam/navigate/costmap.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr std::int8_t kOccupiedFrom = 65;  // per cent: map_server's occupied_thresh

bool IsOccupied(std::int8_t cell) { return cell >= kOccupiedFrom; }

std::size_t Index(int i) { return static_cast<std::size_t>(i); }

bool IsUsable(const OccupancyGrid2d& map) {
  return map.width > 0 && map.height > 0 && map.resolution > 0.0 && std::isfinite(map.resolution) &&
         map.origin.allFinite() && map.cells.size() == Index(map.width) * Index(map.height);
}

}  // namespace

bool Costmap::SetMap(OccupancyGrid2d map) {
  if (!IsUsable(map)) return false;
  const bool same = HaveSameLayout(map_, map);
  map_ = std::move(map);
  if (!same) {
    marks_.clear();
    touched_.clear();
    marked_at_.assign(map_.cells.size(), kNever);
    laser_distance_.assign(map_.cells.size(), static_cast<float>(Reach()));
  }
  map_distance_.resize(map_.cells.size());
  InflateMap({0, 0, map_.width, map_.height});
  return true;
}

bool Costmap::UpdateMap(const GridRegion& region, const std::vector<std::int8_t>& cells) {
  if (region.x < 0 || region.y < 0 || region.width <= 0 || region.height <= 0) return false;
  if (region.width > map_.width - region.x || region.height > map_.height - region.y) return false;
  if (cells.size() != Index(region.width) * Index(region.height)) return false;
  for (int y = 0; y < region.height; ++y) {
    std::copy_n(cells.begin() + static_cast<std::ptrdiff_t>(y) * region.width, region.width,
                map_.cells.begin() + static_cast<std::ptrdiff_t>(region.y + y) * map_.width + region.x);
  }
  InflateMap(region);
  return true;
}

// Cells inside an obstacle have nothing to add to what its edge says of free space.
bool Costmap::IsEdge(int cell, bool unknown) const {
  const int x = cell % map_.width, y = cell / map_.width;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (x + dx < 0 || y + dy < 0 || x + dx >= map_.width || y + dy >= map_.height) continue;
      const std::int8_t other = map_.At(x + dx, y + dy);
      if (unknown ? other >= 0 : !IsOccupied(other)) return true;
    }
  }
  return false;
}

GridRegion Costmap::Grown(const GridRegion& region, int cells) const {
  const int x0 = std::max(0, region.x - cells), x1 = std::min(map_.width, region.x + region.width + cells);
  const int y0 = std::max(0, region.y - cells), y1 = std::min(map_.height, region.y + region.height + cells);
  return {x0, y0, x1 - x0, y1 - y0};
}

// Cells beside the changed ones may become, or no longer be, edges; what they reach is concerned, too.
void Costmap::InflateMap(const GridRegion& changed) {
  const int reach = static_cast<int>(std::ceil(Reach() / map_.resolution));
  const GridRegion concerned = Grown(changed, reach + 1), sources = Grown(concerned, reach);
  const double unknown_offset = options_.robot_radius - options_.unknown_margin;
  for (int y = concerned.y; y < concerned.y + concerned.height; ++y) {
    std::fill_n(map_distance_.begin() + static_cast<std::ptrdiff_t>(y) * map_.width + concerned.x, concerned.width,
                static_cast<float>(Reach()));
  }
  for (int y = sources.y; y < sources.y + sources.height; ++y) {
    for (int x = sources.x; x < sources.x + sources.width; ++x) {
      const int cell = y * map_.width + x;
      const bool unknown = map_.cells[Index(cell)] < 0 && !options_.allow_unknown;
      if (!unknown && !IsOccupied(map_.cells[Index(cell)])) continue;
      if (IsEdge(cell, unknown)) Stamp(cell, unknown ? unknown_offset : 0.0, concerned, &map_distance_, nullptr);
      map_distance_[Index(cell)] = std::min(map_distance_[Index(cell)], 0.0F);
    }
  }
}

void Costmap::Stamp(int cell, double offset, const GridRegion& within, std::vector<float>* distances,
                    std::vector<int>* touched) const {
  const int reach = static_cast<int>(std::ceil(Reach() / map_.resolution));
  const int x = cell % map_.width, y = cell / map_.width;
  const int x0 = std::max(within.x, x - reach), x1 = std::min(within.x + within.width - 1, x + reach);
  const int y0 = std::max(within.y, y - reach), y1 = std::min(within.y + within.height - 1, y + reach);
  for (int v = y0; v <= y1; ++v) {
    for (int u = x0; u <= x1; ++u) {
      const double distance = std::sqrt((u - x) * (u - x) + (v - y) * (v - y)) * map_.resolution + offset;
      float& stored = (*distances)[Index(v * map_.width + u)];
      if (distance >= static_cast<double>(stored)) continue;
      if (touched != nullptr) touched->push_back(v * map_.width + u);
      stored = static_cast<float>(distance);
    }
  }
}

// A return beside an obstacle of the map is that obstacle: noise of the pose must not narrow a door.
bool Costmap::IsExplained(int cell) const {
  const int x = cell % map_.width, y = cell / map_.width;
  for (int v = std::max(0, y - 1); v <= std::min(map_.height - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(map_.width - 1, x + 1); ++u) {
      if (IsOccupied(map_.At(u, v))) return true;
    }
  }
  return false;
}

void Costmap::ClearBeam(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const double length = (to - from).norm();
  const double step = 0.5 * map_.resolution;
  for (double s = 0.0; s < length; s += step) {
    const int cell = CellOf(from + (to - from) * (s / length));
    if (cell >= 0) marked_at_[Index(cell)] = kNever;
  }
}

void Costmap::AddSweep(double time, const Rigid2& T_map_laser, const PlanarScan& scan,
                       const std::vector<std::size_t>& people) {
  if (!has_map() || !T_map_laser.translation.allFinite() || !std::isfinite(T_map_laser.angle)) return;
  std::vector<int> hits;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = static_cast<double>(scan.ranges[i]);
    if (std::isnan(range) || range < scan.range_min) continue;
    const bool hit = range < scan.range_max && range <= options_.mark_range;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    // The last cell and the one before it belong to what was hit.
    const double clear = std::min(range, options_.mark_range) - (hit ? 1.5 * map_.resolution : 0.0);
    if (clear > 0.0) ClearBeam(T_map_laser.translation, T_map_laser * (direction * clear));
    const bool marks = hit && !std::binary_search(people.begin(), people.end(), i);
    const int cell = marks ? CellOf(T_map_laser * (direction * range)) : -1;
    if (cell >= 0 && !IsExplained(cell)) hits.push_back(cell);
  }
  for (const int cell : hits) {
    if (marked_at_[Index(cell)] == kNever) marks_.push_back({cell, time});
    marked_at_[Index(cell)] = time;
  }
  const double oldest = time - options_.mark_lifetime;
  std::vector<Mark> kept;
  std::sort(marks_.begin(), marks_.end(), [](const Mark& a, const Mark& b) { return a.cell < b.cell; });
  for (const Mark& mark : marks_) {
    double& marked_at = marked_at_[Index(mark.cell)];
    if (marked_at < oldest) marked_at = kNever;
    const bool twice = !kept.empty() && kept.back().cell == mark.cell;
    if (marked_at != kNever && !twice) kept.push_back({mark.cell, marked_at});
  }
  marks_ = std::move(kept);
  InflateMarks();
}

void Costmap::InflateMarks() {
  for (const int cell : touched_) laser_distance_[Index(cell)] = static_cast<float>(Reach());
  touched_.clear();
  const GridRegion everywhere{0, 0, map_.width, map_.height};
  for (const Mark& mark : marks_) Stamp(mark.cell, 0.0, everywhere, &laser_distance_, &touched_);
}

void Costmap::ClearMarks() {
  for (const Mark& mark : marks_) marked_at_[Index(mark.cell)] = kNever;
  marks_.clear();
  InflateMarks();
}

CellKind Costmap::KindAt(const Eigen::Vector2d& p_map) const {
  const int cell = CellOf(p_map);
  if (cell < 0) return CellKind::kOutside;
  const std::int8_t value = map_.cells[Index(cell)];
  if (IsOccupied(value) || marked_at_[Index(cell)] != kNever) return CellKind::kOccupied;
  return value < 0 ? CellKind::kUnknown : CellKind::kFree;
}

double Costmap::ClearanceOfCell(int cell, Layers layers) const {
  float distance = map_distance_[Index(cell)];
  if (layers == Layers::kMapAndLaser) distance = std::min(distance, laser_distance_[Index(cell)]);
  return static_cast<double>(distance) - 0.5 * map_.resolution - options_.robot_radius;
}

double Costmap::Clearance(const Eigen::Vector2d& p_map, Layers layers) const {
  const int cell = CellOf(p_map);
  return cell < 0 ? kNever : ClearanceOfCell(cell, layers);
}

double Costmap::DistanceToMap(const Eigen::Vector2d& p_map) const {
  const int cell = CellOf(p_map);
  return cell < 0 ? kNever : static_cast<double>(map_distance_[Index(cell)]) - 0.5 * map_.resolution;
}

double Costmap::CostOfCell(int cell, Layers layers) const {
  const double clearance = ClearanceOfCell(cell, layers);
  if (clearance >= options_.inflation_radius - options_.robot_radius) return 0.0;
  return std::exp(-options_.inflation_decay * std::max(0.0, clearance));
}

int Costmap::CellOf(const Eigen::Vector2d& p_map) const {
  const Eigen::Vector2d at = (p_map - map_.origin) / map_.resolution;
  // Written so that NaN is outside.
  if (!(at.x() >= 0.0 && at.y() >= 0.0 && at.x() < map_.width && at.y() < map_.height)) return -1;
  return static_cast<int>(at.y()) * map_.width + static_cast<int>(at.x());
}

Eigen::Vector2d Costmap::CentreOf(int cell) const {
  const int x = cell % map_.width, y = cell / map_.width;
  return map_.origin + map_.resolution * Eigen::Vector2d(x + 0.5, y + 0.5);
}

}  // namespace planar_vslam
