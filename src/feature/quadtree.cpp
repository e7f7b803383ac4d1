#include "quadtree.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace planar_vslam {

template <class Predicate>
int Quadtree::Partition(int begin, int end, const Predicate& goes_first) {
  // Without branches: which way a corner goes is as good as random.
  deferred_.resize(static_cast<std::size_t>(end - begin) + 1);
  int* const write_begin = order_.data() + begin;
  int *write = write_begin, *defer = deferred_.data();
  for (const int *index = write_begin, *last = order_.data() + end; index != last; ++index) {
    const int current = *index;
    const bool is_first = goes_first(current);
    *write = *defer = current;
    write += is_first ? 1 : 0;
    defer += is_first ? 0 : 1;
  }
  std::copy(deferred_.data(), defer, write);
  return begin + static_cast<int>(write - write_begin);
}

void Quadtree::MakeRoots(const std::vector<Corner>& corners, const cv::Rect& area) {
  // As many areas side by side as make them closest to squares.
  const float w = static_cast<float>(area.width), h = static_cast<float>(area.height);
  const int columns = std::max(1, static_cast<int>(std::lround(w / h)));
  const int rows = std::max(1, static_cast<int>(std::lround(h / w)));
  order_.resize(corners.size());
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
    root.end = is_last ? end : Partition(root.begin, end, [&](int index) {
      const Corner& corner = corners[static_cast<std::size_t>(index)];
      return static_cast<float>(corner.x) < root.x + root.width && static_cast<float>(corner.y) < root.y + root.height;
    });
    if (root.size() == 1) leaves_.push_back(root);
    if (root.size() > 1) nodes_.push_back(root);
    root.begin = root.end;
  }
}

void Quadtree::Split(const std::vector<Corner>& corners, const Node& node) {
  const float half_width = 0.5F * node.width, half_height = 0.5F * node.height;
  const auto is_left = [&](int index) {
    return static_cast<float>(corners[static_cast<std::size_t>(index)].x) < node.x + half_width;
  };
  const auto is_upper = [&](int index) {
    return static_cast<float>(corners[static_cast<std::size_t>(index)].y) < node.y + half_height;
  };
  const int lower = Partition(node.begin, node.end, is_upper);
  const int upper_right = Partition(node.begin, lower, is_left);
  const int lower_right = Partition(lower, node.end, is_left);
  const float right = node.x + half_width, bottom = node.y + half_height;
  const Node quarters[] = {{node.x, node.y, half_width, half_height, node.begin, upper_right},
                           {right, node.y, half_width, half_height, upper_right, lower},
                           {node.x, bottom, half_width, half_height, lower, lower_right},
                           {right, bottom, half_width, half_height, lower_right, node.end}};
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
    const auto is_weaker = [&](int a, int b) {
      return corners[static_cast<std::size_t>(a)].response < corners[static_cast<std::size_t>(b)].response;
    };
    const auto strongest = std::max_element(order_.begin() + leaf.begin, order_.begin() + leaf.end, is_weaker);
    kept->push_back(corners[static_cast<std::size_t>(*strongest)]);
  }
  // The last division may give up to two areas too many.
  if (kept->size() > static_cast<std::size_t>(count)) {
    std::sort(kept->begin(), kept->end(), [](const Corner& a, const Corner& b) {
      return std::tie(b.response, a.y, a.x) < std::tie(a.response, b.y, b.x);
    });
    kept->resize(static_cast<std::size_t>(count));
  }
  std::sort(kept->begin(), kept->end(),
            [](const Corner& a, const Corner& b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); });
}

}  // namespace planar_vslam
