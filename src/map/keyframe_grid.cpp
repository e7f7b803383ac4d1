#include "planar_vslam/map/keyframe_grid.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kCellSize = 0.5;  // m in a metric map

std::int32_t Along(double x) {
  constexpr double kFarthest = 1e9;  // beyond all maps, within 32 bits
  return std::isfinite(x) ? static_cast<std::int32_t>(std::floor(std::clamp(x / kCellSize, -kFarthest, kFarthest))) : 0;
}

}  // namespace

KeyframeGrid::Cell KeyframeGrid::CellOf(double x, double y) { return {Along(x), Along(y)}; }

void KeyframeGrid::Add(KeyframeId id, const Eigen::Vector3d& p_map) {
  if (!places_) places_ = SharedValue<std::vector<Place>>::Make();
  const Place place{CellOf(p_map.x(), p_map.y()), id};
  std::vector<Place>& places = places_.Own();
  places.insert(std::lower_bound(places.begin(), places.end(), place), place);
}

void KeyframeGrid::Remove(KeyframeId id, const Eigen::Vector3d& p_map) {
  if (!places_) return;
  const Place place{CellOf(p_map.x(), p_map.y()), id};
  std::vector<Place>& places = places_.Own();
  const auto at = std::lower_bound(places.begin(), places.end(), place);
  if (at != places.end() && at->id == id) places.erase(at);
}

void KeyframeGrid::Move(KeyframeId id, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Cell before = CellOf(from.x(), from.y()), after = CellOf(to.x(), to.y());
  if (!(before < after) && !(after < before)) return;
  Remove(id, from);
  Add(id, to);
}

std::vector<KeyframeId> KeyframeGrid::Around(const Eigen::Vector3d& p_map, double distance) const {
  std::vector<KeyframeId> around;
  if (!places_) return around;
  constexpr double kRounding = 1e-6;  // m
  const double reach = distance + kRounding;
  const Cell low = CellOf(p_map.x() - reach, p_map.y() - reach), high = CellOf(p_map.x() + reach, p_map.y() + reach);
  const auto first_of = [](auto from, auto end, Cell cell) {
    return std::lower_bound(from, end, cell, [](const Place& place, Cell c) { return place.cell < c; });
  };
  for (auto it = first_of(places_->begin(), places_->end(), low); it != places_->end() && it->cell.x <= high.x;) {
    if (it->cell.y < low.y) {
      it = first_of(it, places_->end(), {it->cell.x, low.y});
    } else if (it->cell.y > high.y) {
      it = first_of(it, places_->end(), {it->cell.x + 1, low.y});
    } else {
      around.push_back((it++)->id);
    }
  }
  return around;
}

bool operator==(const KeyframeGrid& a, const KeyframeGrid& b) {
  static const std::vector<KeyframeGrid::Place> none;
  const auto& x = a.places_ ? *a.places_ : none;
  const auto& y = b.places_ ? *b.places_ : none;
  return std::equal(x.begin(), x.end(), y.begin(), y.end(),
                    [](const auto& i, const auto& j) { return !(i < j) && !(j < i); });
}

}  // namespace planar_vslam
