#pragma once
// Thins corners so that what is left covers the image evenly.
#include <array>
#include <cstdint>
#include <vector>

#include "corner_detector.h"

namespace planar_vslam {

class Quadtree {
 public:
  // Divides `area` into quarters, the larger areas first and the fuller ones first among equals, until `count` areas
  // hold a corner; keeps the strongest corner of each, in reading order. Never more than `count`.
  void Thin(const std::vector<Corner>& corners, const cv::Rect& area, int count, std::vector<Corner>* kept);

 private:
  struct Node {
    float x = 0.0F, y = 0.0F, width = 0.0F, height = 0.0F;
    int begin = 0, end = 0;  // its corners in order_
    int size() const { return end - begin; }
  };
  void MakeRoots(const std::vector<Corner>& corners, const cv::Rect& area);
  void Divide(const std::vector<Corner>& corners, int count);
  void Split(const std::vector<Corner>& corners, const Node& node);
  // Brings the corners of [begin, end) into the order of their parts 0, 1, ..., and leaves them in order within a part.
  // Returns where each part begins, and `end`.
  template <std::size_t Parts, class PartOf>
  std::array<int, Parts + 1> Partition(int begin, int end, const PartOf& part_of);

  std::vector<int> order_;          // indices of corners, those of a node side by side
  std::vector<int> moved_;          // scratch of Partition
  std::vector<std::uint8_t> part_;  // scratch of Partition
  std::vector<Node> nodes_;         // of the current depth, each with two corners or more
  std::vector<Node> children_;
  std::vector<Node> leaves_;
};

}  // namespace planar_vslam
