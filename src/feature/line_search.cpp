#include "planar_vslam/feature/line_search.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace planar_vslam {
namespace {

// Neighbours next to each other: by strips of the image, and along each strip.
std::vector<int> SortedByPlace(const std::vector<Keypoint>& keypoints, const std::vector<int>& indices) {
  constexpr float kStrip = 80.0F;   // px: about as wide as a block of some
                                    // hundred keypoints' image is long
  constexpr float kLongest = 1e4F;  // px, of a strip; beyond it the search takes longer, no more
  std::vector<std::pair<float, int>> places;
  places.reserve(indices.size());
  for (const int i : indices) {
    const Eigen::Vector2f& pixel = keypoints[static_cast<std::size_t>(i)].pixel;
    places.emplace_back(std::floor(pixel.y() / kStrip) * kLongest + pixel.x(), i);
  }
  std::sort(places.begin(), places.end());
  std::vector<int> sorted;
  sorted.reserve(places.size());
  for (const auto& [place, i] : places) sorted.push_back(i);
  return sorted;
}

}  // namespace

LineSearch::LineSearch(const std::vector<Keypoint>& keypoints, const std::vector<int>& indices,
                       const std::vector<float>& squared_reach) {
  const std::vector<int> sorted = SortedByPlace(keypoints, indices);
  blocks_.reserve((sorted.size() + kBlock - 1) / kBlock);
  for (std::size_t begin = 0; begin < sorted.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, sorted.size());
    blocks_.push_back(MakeBlock(keypoints, sorted.data() + begin, sorted.data() + end, squared_reach));
  }
}

LineSearch::Block LineSearch::MakeBlock(const std::vector<Keypoint>& keypoints, const int* begin, const int* end,
                                        const std::vector<float>& squared_reach) {
  Block block;
  block.squared_reach.fill(-1.0F);
  const auto keypoint = [&keypoints](int i) -> const Keypoint& { return keypoints[static_cast<std::size_t>(i)]; };
  Eigen::Vector2f lower = keypoint(*begin).pixel, upper = lower;
  for (const int* i = begin; i != end; ++i) {
    const auto k = static_cast<std::size_t>(i - begin);
    block.x[k] = keypoint(*i).pixel.x();
    block.y[k] = keypoint(*i).pixel.y();
    block.squared_reach[k] = squared_reach[static_cast<std::size_t>(keypoint(*i).octave)];
    block.index[k] = *i;
    lower = lower.cwiseMin(keypoint(*i).pixel);
    upper = upper.cwiseMax(keypoint(*i).pixel);
  }
  block.center = 0.5F * (lower + upper);
  constexpr float kSlack = 1.0F;  // px, so that no rounding loses a keypoint
  float radius = 0.0F;
  for (const int* i = begin; i != end; ++i) {
    const float reach = std::sqrt(squared_reach[static_cast<std::size_t>(keypoint(*i).octave)]);
    radius = std::max(radius, (keypoint(*i).pixel - block.center).norm() + reach + kSlack);
  }
  block.squared_radius = radius * radius;
  return block;
}

void LineSearch::Find(const Eigen::Vector3f& line, std::vector<int>* indices) const {
  const float a = line.x(), b = line.y(), c = line.z();
  const float norm = line.head<2>().squaredNorm();
  constexpr std::size_t kWord = sizeof(std::uint64_t);  // bytes; of each, the lowest bit may be set
  for (const Block& block : blocks_) {
    const float off = a * block.center.x() + b * block.center.y() + c;
    if (off * off > block.squared_radius * norm) continue;
    std::array<std::uint8_t, kBlock> near;
    for (std::size_t k = 0; k < kBlock; ++k) {
      const float distance = a * block.x[k] + b * block.y[k] + c;
      near[k] = distance * distance <= block.squared_reach[k] * norm ? 1 : 0;
    }
    for (std::size_t begin = 0; begin < kBlock; begin += kWord) {
      std::uint64_t word = 0;
      std::memcpy(&word, near.data() + begin, kWord);
      for (; word != 0; word &= word - 1) {
        indices->push_back(block.index[begin + static_cast<std::size_t>(__builtin_ctzll(word)) / kWord]);
      }
    }
  }
}

}  // namespace planar_vslam
