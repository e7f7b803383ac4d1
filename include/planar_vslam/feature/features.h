#pragma once
// What an image is to the rest of the house: undistorted keypoints with binary descriptors and a grid over them.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace planar_vslam {

// 256-bit binary descriptor. Byte k of OpenCV's ORB row is byte k of this array in memory (little endian words).
using Descriptor = std::array<std::uint64_t, 4>;

// Number of differing bits, 0..256. Not every processor counts bits in one instruction, and a call that does without
// is slow: the counts of the four words are added in fields of 4, 8 and 16 bits side by side.
inline int HammingDistance(const Descriptor& a, const Descriptor& b) {
  constexpr std::uint64_t kPairs = 0x5555555555555555, kNibbles = 0x3333333333333333, kBytes = 0x0F0F0F0F0F0F0F0F;
  constexpr std::uint64_t kShorts = 0x00FF00FF00FF00FF, kSumOfShorts = 0x0001000100010001;
  std::uint64_t bytes = 0;  // at most 32 each
  for (std::size_t half = 0; half < 4; half += 2) {
    std::uint64_t nibbles = 0;  // at most 8 each
    for (std::size_t k = half; k < half + 2; ++k) {
      const std::uint64_t bits = a[k] ^ b[k];
      const std::uint64_t pairs = bits - (bits >> 1 & kPairs);
      nibbles += (pairs & kNibbles) + (pairs >> 2 & kNibbles);
    }
    bytes += (nibbles & kBytes) + (nibbles >> 4 & kBytes);
  }
  return static_cast<int>(((bytes & kShorts) + (bytes >> 8 & kShorts)) * kSumOfShorts >> 48);
}

struct Keypoint {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();      // undistorted, level-0 pixels
  Eigen::Vector2f raw_pixel = Eigen::Vector2f::Zero();  // as seen in the image, level-0 pixels
  float angle = 0.0F;                                   // intensity-centroid orientation, rad in [0, 2 pi)
  float response = 0.0F;                                // FAST score
  std::int32_t octave = 0;                              // pyramid level, 0 is full resolution
};

// Buckets of keypoint indices over the undistorted image, for radius search.
class ImageGrid {
 public:
  ImageGrid() = default;
  explicit ImageGrid(const std::vector<Keypoint>& keypoints);
  // Appends the indices of keypoints within `radius` px (square norm) of `center` whose octave lies in
  // [min_octave, max_octave], in ascending order of index.
  void Search(const std::vector<Keypoint>& keypoints, const Eigen::Vector2f& center, float radius, int min_octave,
              int max_octave, std::vector<int>* indices) const;

 private:
  static constexpr float kCellPixels = 16.0F;
  Eigen::Vector2f origin_ = Eigen::Vector2f::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::int32_t> cell_begin_;  // columns * rows + 1 offsets into members_
  std::vector<std::int32_t> members_;
};

struct FrameFeatures {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;  // one per keypoint
  ImageGrid grid;
};
using FrameFeaturesPtr = std::shared_ptr<const FrameFeatures>;

}  // namespace planar_vslam
