#include "quadtree.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace planar_vslam {

template <std::size_t Parts, class PartOf>
std::array<int, Parts + 1> Quadtree::Partition(int begin, int end, const PartOf& part_of) {
  // Without branches: which part a corner belongs to is as good as random.
  std::array<int, Parts + 1> bounds{};  // at first the number of corners in the parts before
  for (int i = begin; i < end; ++i) {
    const auto at = static_cast<std::size_t>(i);
    part_[at] = static_cast<std::uint8_t>(part_of(order_[at]));
    ++bounds[part_[at] + 1U];
  }
  bounds[0] = begin;
  for (std::size_t part = 0; part < Parts; ++part) bounds[part + 1] += bounds[part];
  std::array<int, Parts + 1> next = bounds;
  for (int i = begin; i < end; ++i) {
    const auto at = static_cast<std::size_t>(i);
    moved_[static_cast<std::size_t>(next[part_[at]]++)] = order_[at];
  }
  std::copy(moved_.begin() + begin, moved_.begin() + end, order_.begin() + begin);
  return bounds;
}

void Quadtree::MakeRoots(const std::vector<Corner>& corners, const cv::Rect& area) {
  // As many areas side by side as make them closest to squares.
  const float w = static_cast<float>(area.width), h = static_cast<float>(area.height);
  const int columns = std::max(1, static_cast<int>(std::lround(w / h)));
  const int rows = std::max(1, static_cast<int>(std::lround(h / w)));
  for (std::vector<int>* indices : {&order_, &moved_}) indices->resize(corners.size());
  part_.resize(corners.size());
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.clear();
  leaves_.clear();
  children_.clear();
  Node root{0.0F, 0.0F, w / static_cast<float>(columns), h / static_cast<float>(rows), 0, 0};
  const int end = static_cast<int>(corners.size());
  for (int i = 0; i < columns * rows; ++i) {
    const int column = i % columns, row = i / columns;
    root.x = static_cast<float>(area.x) + static_cast<float>(column) * root.width;
    root.y = static_cast<float>(area.y) + static_cast<float>(row) * root.height;
    const bool is_last = i + 1 == columns * rows;
    const float right = root.x + root.width, bottom = root.y + root.height;
    const auto is_outside = [&](int index) {
      const Corner& corner = corners[static_cast<std::size_t>(index)];
      return static_cast<float>(corner.x) >= right || static_cast<float>(corner.y) >= bottom;
    };
    root.end = is_last ? end : Partition<2>(root.begin, end, is_outside)[1];
    if (root.size() == 1) leaves_.push_back(root);
    if (root.size() > 1) nodes_.push_back(root);
    root.begin = root.end;
  }
}

void Quadtree::Split(const std::vector<Corner>& corners, const Node& node) {
  const float half_width = 0.5F * node.width, half_height = 0.5F * node.height;
  const float right = node.x + half_width, bottom = node.y + half_height;
  const auto quarter_of = [&](int index) {
    const Corner& corner = corners[static_cast<std::size_t>(index)];
    return (static_cast<float>(corner.x) >= right ? 1 : 0) + (static_cast<float>(corner.y) >= bottom ? 2 : 0);
  };
  const std::array<int, 5> bounds = Partition<4>(node.begin, node.end, quarter_of);
  const Node quarters[] = {{node.x, node.y, half_width, half_height, bounds[0], bounds[1]},
                           {right, node.y, half_width, half_height, bounds[1], bounds[2]},
                           {node.x, bottom, half_width, half_height, bounds[2], bounds[3]},
                           {right, bottom, half_width, half_height, bounds[3], bounds[4]}};
  for (const Node& quarter : quarters) {
    if (quarter.size() == 1) leaves_.push_back(quarter);
    if (quarter.size() > 1) children_.push_back(quarter);
  }
}

void Quadtree::Divide(const std::vector<Corner>& corners, int count) {
  // Each round divides the nodes of one depth. Different corners never share a pixel, so this ends.
  const auto is_fuller = [](const Node& a, const Node& b) { return a.size() > b.size(); };
  bool is_enough = false;
  while (!nodes_.empty() && !is_enough) {
    std::stable_sort(nodes_.begin(), nodes_.end(), is_fuller);
    children_.clear();
    std::size_t next = 0;
    for (; next < nodes_.size(); ++next) {
      is_enough = leaves_.size() + children_.size() + (nodes_.size() - next) >= static_cast<std::size_t>(count);
      if (is_enough) break;
      Split(corners, nodes_[next]);
    }
    leaves_.insert(leaves_.end(), nodes_.begin() + static_cast<std::ptrdiff_t>(next), nodes_.end());
    nodes_.swap(children_);
  }
  leaves_.insert(leaves_.end(), nodes_.begin(), nodes_.end());
}

void Quadtree::Thin(const std::vector<Corner>& corners, const cv::Rect& area, int count, std::vector<Corner>* kept) {
  kept->clear();
  if (corners.empty() || count <= 0) return;
  MakeRoots(corners, area);
  Divide(corners, count);
  for (const Node& leaf : leaves_) {
    // The first of the strongest.
    const Corner* strongest = &corners[static_cast<std::size_t>(order_[static_cast<std::size_t>(leaf.begin)])];
    for (int i = leaf.begin + 1; i < leaf.end; ++i) {
      const Corner* other = &corners[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
      strongest = other->response > strongest->response ? other : strongest;
    }
    kept->push_back(*strongest);
  }
  // The last division may give up to two areas too many.
  if (kept->size() > static_cast<std::size_t>(count)) {
    const auto is_stronger = [](const Corner& a, const Corner& b) {
      return std::tie(b.response, a.y, a.x) < std::tie(a.response, b.y, b.x);
    };
    std::nth_element(kept->begin(), kept->begin() + count, kept->end(), is_stronger);
    kept->resize(static_cast<std::size_t>(count));
  }
  std::sort(kept->begin(), kept->end(),
            [](const Corner& a, const Corner& b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); });
}

}  // namespace planar_vslam
