#pragma once
// Where keyframes, or their cameras, stand as seen from above: those around a point are found without a look at the
// others.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "planar_vslam/map/id.h"

namespace planar_vslam {

// Copies share their content until one of them changes.
class KeyframeGrid {
 public:
  void Add(KeyframeId id, const Eigen::Vector3d& p_map);
  // `p_map` and `from` are where it was added.
  void Move(KeyframeId id, const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  void Remove(KeyframeId id, const Eigen::Vector3d& p_map);

  // All that are within `distance` of `p_map` in x and in y, and some a little further, each once, by cell and id.
  std::vector<KeyframeId> Around(const Eigen::Vector3d& p_map, double distance) const;

  friend bool operator==(const KeyframeGrid& a, const KeyframeGrid& b);

 private:
  struct Cell {
    std::int32_t x = 0, y = 0;
    friend bool operator<(Cell a, Cell b) { return a.x != b.x ? a.x < b.x : a.y < b.y; }
  };
  struct Place {
    Cell cell;
    KeyframeId id;
    friend bool operator<(const Place& a, const Place& b) {
      if (a.cell < b.cell || b.cell < a.cell) return a.cell < b.cell;
      return a.id < b.id;
    }
  };
  static Cell CellOf(double x, double y);

  SharedValue<std::vector<Place>> places_;  // ascending
};

}  // namespace planar_vslam
