#include "planar_vslam/feature/line_search.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace planar_vslam {
namespace {

// Neighbours next to each other: by strips of the image, and along each strip.
std::vector<int> SortedByPlace(const std::vector<Keypoint>& keypoints, const std::vector<int>& indices) {
  constexpr float kStrip = 80.0F;   // px: about as wide as a block of some hundred keypoints' image is long
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

// Four numbers that every processor of this house computes with at once.
using Four = float __attribute__((vector_size(16)));
using FourFlags = std::int32_t __attribute__((vector_size(16)));

Four Load(const float* numbers) {
  Four four;
  std::memcpy(&four, numbers, sizeof(four));
  return four;
}

Four Abs(Four four) { return four < 0.0F ? -four : four; }

// Bit k: whether flag k is set.
unsigned Bits(FourFlags flags) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(flags)));
#else
  return (flags[0] & 1) | (flags[1] & 2) | (flags[2] & 4) | (flags[3] & 8);
#endif
}

// Appends the numbers of the bits that are set, plus `first`; returns the new end. Each bit takes the same time.
template <unsigned Count>
std::uint32_t* AppendBits(unsigned bits, std::uint32_t first, std::uint32_t* end) {
  for (unsigned k = 0; k < Count; ++k) {
    *end = first + k;
    end += (bits >> k) & 1U;
  }
  return end;
}

}  // namespace

LineSearch::LineSearch(const std::vector<Keypoint>& keypoints, const std::vector<int>& indices,
                       const std::vector<float>& squared_reach) {
  constexpr std::size_t kBlock = kParts * kLanes;
  const std::vector<int> sorted = SortedByPlace(keypoints, indices);
  blocks_.reserve((sorted.size() + kBlock - 1) / kBlock);
  for (std::size_t begin = 0; begin < sorted.size(); begin += kBlock) {
    Add(keypoints, sorted.data() + begin, sorted.data() + std::min(begin + kBlock, sorted.size()), squared_reach);
  }
}

void LineSearch::Add(const std::vector<Keypoint>& keypoints, const int* begin, const int* end,
                     const std::vector<float>& squared_reach) {
  Block& block = blocks_.emplace_back();
  for (Keypoints& part : block) part.squared_reach.fill(-1.0F);
  Eigen::Vector2f lower = keypoints[static_cast<std::size_t>(*begin)].pixel, upper = lower;
  float longest = 0.0F;
  for (const int* i = begin; i != end; ++i) {
    const Keypoint& keypoint = keypoints[static_cast<std::size_t>(*i)];
    const float reach = squared_reach[static_cast<std::size_t>(keypoint.octave)];
    const auto k = static_cast<std::size_t>(i - begin);
    Keypoints& part = block[k / kLanes];
    part.x[k % kLanes] = keypoint.pixel.x();
    part.y[k % kLanes] = keypoint.pixel.y();
    part.squared_reach[k % kLanes] = reach;
    part.index[k % kLanes] = *i;
    lower = lower.cwiseMin(keypoint.pixel);
    upper = upper.cwiseMax(keypoint.pixel);
    longest = std::max(longest, reach);
  }
  SetBox(lower, upper, longest);
}

// Of the last block.
void LineSearch::SetBox(const Eigen::Vector2f& lower, const Eigen::Vector2f& upper, float squared_reach) {
  const std::size_t lane = (blocks_.size() - 1) % kLanes;
  if (lane == 0) {
    constexpr float kNone = -1e30F;  // px
    boxes_.emplace_back().reach.fill(kNone);
  }
  constexpr float kSlack = 1.0F;  // px, so that no rounding loses a keypoint
  Boxes& boxes = boxes_.back();
  boxes.x[lane] = 0.5F * (lower.x() + upper.x());
  boxes.y[lane] = 0.5F * (lower.y() + upper.y());
  boxes.half_width[lane] = 0.5F * (upper.x() - lower.x());
  boxes.half_height[lane] = 0.5F * (upper.y() - lower.y());
  boxes.reach[lane] = std::sqrt(squared_reach) + kSlack;
}

void LineSearch::Find(const Eigen::Vector3f& line, std::vector<int>* indices) const {
  const float a = line.x(), b = line.y(), c = line.z();
  const float norm = line.head<2>().squaredNorm(), length = std::sqrt(norm);
  const auto crossed = [&](const Boxes& boxes, std::size_t k) {
    const Four distance = a * Load(&boxes.x[k]) + b * Load(&boxes.y[k]) + c;
    const Four extent = std::abs(a) * Load(&boxes.half_width[k]) + std::abs(b) * Load(&boxes.half_height[k]);
    return Bits(Abs(distance) <= extent + length * Load(&boxes.reach[k]));
  };
  const auto on_line = [&](const Keypoints& part, std::size_t k) {
    const Four distance = a * Load(&part.x[k]) + b * Load(&part.y[k]) + c;
    return Bits(distance * distance <= Load(&part.squared_reach[k]) * norm);
  };
  constexpr std::size_t kBoxes = 8;  // so many at a time, and then what is in them
  for (std::size_t first = 0; first < boxes_.size(); first += kBoxes) {
    std::array<std::uint32_t, kBoxes * kLanes + 1> near;
    std::uint32_t* end = near.data();
    for (std::size_t i = first; i < std::min(first + kBoxes, boxes_.size()); ++i) {
      const unsigned bits = crossed(boxes_[i], 0) | crossed(boxes_[i], kLanes / 2) << kLanes / 2;
      end = AppendBits<kLanes>(bits, static_cast<std::uint32_t>(i * kLanes), end);
    }
    struct Found {
      const Keypoints* part;
      unsigned bits;
    };
    std::array<Found, kBoxes * kLanes * kParts + 1> found;
    std::size_t count = 0;
    for (const std::uint32_t* block = near.data(); block != end; ++block) {
      for (const Keypoints& part : blocks_[*block]) {
        found[count] = {&part, on_line(part, 0) | on_line(part, kLanes / 2) << kLanes / 2};
        count += found[count].bits != 0 ? 1 : 0;
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      for (unsigned bits = found[i].bits; bits != 0; bits &= bits - 1) {
        indices->push_back(found[i].part->index[static_cast<std::size_t>(__builtin_ctz(bits))]);
      }
    }
  }
}

}  // namespace planar_vslam
