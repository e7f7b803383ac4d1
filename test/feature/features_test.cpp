#include "planar_vslam/feature/features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace planar_vslam {
namespace {

std::vector<Keypoint> RandomKeypoints(std::size_t count, float extent, std::mt19937& generator) {
  std::uniform_real_distribution<float> coordinate(-extent, extent);
  std::uniform_int_distribution<int> octave(0, 7);
  std::vector<Keypoint> keypoints(count);
  for (Keypoint& keypoint : keypoints) {
    keypoint.pixel.x() = coordinate(generator);
    keypoint.pixel.y() = coordinate(generator);
    keypoint.octave = octave(generator);
  }
  return keypoints;
}

std::vector<int> SearchAll(const std::vector<Keypoint>& keypoints, const Eigen::Vector2f& center, float radius,
                           int min_octave, int max_octave) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const Eigen::Vector2f difference = keypoints[i].pixel - center;
    if (difference.cwiseAbs().maxCoeff() <= radius && keypoints[i].octave >= min_octave &&
        keypoints[i].octave <= max_octave) {
      indices.push_back(static_cast<int>(i));
    }
  }
  return indices;
}

TEST(HammingDistance, CountsDifferingBits) {
  const Descriptor zeros{0, 0, 0, 0};
  Descriptor some = zeros;
  EXPECT_EQ(HammingDistance(zeros, some), 0);
  some[0] = 1;
  some[3] = std::uint64_t{1} << 63;
  EXPECT_EQ(HammingDistance(zeros, some), 2);
  const Descriptor ones{~std::uint64_t{0}, ~std::uint64_t{0}, ~std::uint64_t{0}, ~std::uint64_t{0}};
  EXPECT_EQ(HammingDistance(zeros, ones), 256);
}

TEST(ImageGrid, FindsWhatASearchOfAllKeypointsFinds) {
  std::mt19937 generator(3);
  // The largest extent has more cells than the grid keeps.
  for (const float extent : {5.0F, 300.0F, 50000.0F}) {
    const std::vector<Keypoint> keypoints = RandomKeypoints(700, extent, generator);
    const ImageGrid grid(keypoints);
    std::uniform_real_distribution<float> coordinate(-1.2F * extent, 1.2F * extent), radius(0.0F, 0.5F * extent);
    std::uniform_int_distribution<int> octave(-1, 8);
    for (int query = 0; query < 200; ++query) {
      const float x = coordinate(generator), y = coordinate(generator), r = radius(generator);
      const int low = octave(generator), high = octave(generator);
      std::vector<int> found;
      grid.Search(keypoints, {x, y}, r, low, high, &found);
      EXPECT_EQ(found, SearchAll(keypoints, {x, y}, r, low, high));
    }
  }
}

TEST(ImageGrid, BoundaryBelongsToTheSearch) {
  std::vector<Keypoint> keypoints(3);
  keypoints[0].pixel = {0.0F, 0.0F};
  keypoints[1].pixel = {16.0F, 16.0F};
  keypoints[2].pixel = {32.0F, 0.0F};
  std::vector<int> found;
  ImageGrid(keypoints).Search(keypoints, {16.0F, 0.0F}, 16.0F, 0, 0, &found);
  EXPECT_EQ(found, (std::vector<int>{0, 1, 2}));
}

TEST(ImageGrid, AppendsToWhatIsThere) {
  std::vector<Keypoint> keypoints(2);
  keypoints[1].pixel = {100.0F, 0.0F};
  std::vector<int> found{7};
  const ImageGrid grid(keypoints);
  grid.Search(keypoints, {0.0F, 0.0F}, 1.0F, 0, 0, &found);
  grid.Search(keypoints, {100.0F, 0.0F}, 1.0F, 0, 0, &found);
  EXPECT_EQ(found, (std::vector<int>{7, 0, 1}));
}

TEST(ImageGrid, NothingToFind) {
  std::vector<int> found;
  ImageGrid().Search({}, {0.0F, 0.0F}, 10.0F, 0, 7, &found);
  ImageGrid(std::vector<Keypoint>{}).Search({}, {0.0F, 0.0F}, 10.0F, 0, 7, &found);
  const std::vector<Keypoint> one(1);
  const ImageGrid grid(one);
  grid.Search(one, {0.0F, 0.0F}, -1.0F, 0, 7, &found);
  grid.Search(one, {std::numeric_limits<float>::quiet_NaN(), 0.0F}, 10.0F, 0, 7, &found);
  grid.Search(one, {1e9F, -1e9F}, 10.0F, 0, 7, &found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace planar_vslam
