#include "planar_vslam/feature/matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "planar_vslam/feature/hamming.h"
#include "test_images.h"

namespace planar_vslam {
namespace {

Descriptor RandomDescriptor(std::mt19937& generator) {
  std::uniform_int_distribution<std::uint64_t> word;
  Descriptor descriptor{};
  for (std::uint64_t& w : descriptor) w = word(generator);
  return descriptor;
}

Descriptor WithFlippedBits(Descriptor descriptor, int count) {
  for (int bit = 0; bit < count; ++bit)
    descriptor[static_cast<std::size_t>(bit / 64)] ^= std::uint64_t{1} << (bit % 64);
  return descriptor;
}

FrameFeatures Features(const std::vector<Descriptor>& descriptors, const std::vector<float>& angles = {}) {
  FrameFeatures features;
  features.descriptors = descriptors;
  features.keypoints.resize(descriptors.size());
  for (std::size_t i = 0; i < angles.size(); ++i) features.keypoints[i].angle = angles[i];
  features.grid = ImageGrid(features.keypoints);
  return features;
}

std::vector<int> AllIndices(const FrameFeatures& features) {
  std::vector<int> indices(features.keypoints.size());
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

std::vector<Eigen::Vector2f> OwnPixels(const FrameFeatures& features) {
  std::vector<Eigen::Vector2f> pixels;
  for (const Keypoint& keypoint : features.keypoints) pixels.push_back(keypoint.pixel);
  return pixels;
}

std::vector<FeatureMatch> MatchAll(const FrameFeatures& first, const FrameFeatures& second,
                                   const MatchOptions& options) {
  return MatchBruteForce(first, AllIndices(first), second, AllIndices(second), options);
}

void ExpectOneToOne(const std::vector<FeatureMatch>& matches) {
  std::set<int> firsts, seconds;
  for (const FeatureMatch& match : matches) {
    EXPECT_TRUE(firsts.insert(match.first).second) << match.first;
    EXPECT_TRUE(seconds.insert(match.second).second) << match.second;
  }
}

TEST(MatchBruteForce, FindsEachOfShuffledDescriptors) {
  std::mt19937 generator(1);
  std::vector<Descriptor> descriptors;
  for (int i = 0; i < 200; ++i) descriptors.push_back(RandomDescriptor(generator));
  std::vector<int> order(descriptors.size());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), generator);
  std::vector<Descriptor> shuffled;
  for (const int i : order) shuffled.push_back(WithFlippedBits(descriptors[static_cast<std::size_t>(i)], i % 40));

  const std::vector<FeatureMatch> matches = MatchAll(Features(descriptors), Features(shuffled), MatchOptions{});
  ASSERT_EQ(matches.size(), descriptors.size());
  for (const FeatureMatch& match : matches) {
    EXPECT_EQ(order[static_cast<std::size_t>(match.second)], match.first);
    EXPECT_EQ(match.distance, match.first % 40);
  }
}

TEST(MatchBruteForce, OnlyLooksAtTheGivenSubsets) {
  std::mt19937 generator(2);
  const Descriptor a = RandomDescriptor(generator), b = RandomDescriptor(generator), c = RandomDescriptor(generator);
  const std::vector<FeatureMatch> matches =
      MatchBruteForce(Features({a, b, c}), {1, 2}, Features({c, b, a}), {2, 1}, MatchOptions{});
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].first, 1);
  EXPECT_EQ(matches[0].second, 1);
}

TEST(MatchBruteForce, DistanceAndRatioLimits) {
  std::mt19937 generator(3);
  const Descriptor a = RandomDescriptor(generator);
  MatchOptions options;
  options.max_distance = 50;
  options.ratio = 0.9;
  EXPECT_EQ(MatchAll(Features({a}), Features({WithFlippedBits(a, 50)}), options).size(), 1U);
  EXPECT_TRUE(MatchAll(Features({a}), Features({WithFlippedBits(a, 51)}), options).empty());
  // 18 is not below 0.9 * 20, 17 is.
  EXPECT_TRUE(MatchAll(Features({a}), Features({WithFlippedBits(a, 18), WithFlippedBits(a, 20)}), options).empty());
  EXPECT_EQ(MatchAll(Features({a}), Features({WithFlippedBits(a, 17), WithFlippedBits(a, 20)}), options).size(), 1U);
  // Two equal candidates are no match, however good.
  EXPECT_TRUE(MatchAll(Features({a}), Features({a, a}), options).empty());
}

TEST(MatchBruteForce, ConflictsGoToTheSmallerDistanceThenTheSmallerIndex) {
  std::mt19937 generator(4);
  const Descriptor a = RandomDescriptor(generator);
  const std::vector<FeatureMatch> nearer =
      MatchAll(Features({WithFlippedBits(a, 9), WithFlippedBits(a, 3)}), Features({a}), MatchOptions{});
  ASSERT_EQ(nearer.size(), 1U);
  EXPECT_EQ(nearer[0].first, 1);
  const std::vector<FeatureMatch> tied =
      MatchAll(Features({WithFlippedBits(a, 3), WithFlippedBits(a, 3)}), Features({a}), MatchOptions{});
  ASSERT_EQ(tied.size(), 1U);
  EXPECT_EQ(tied[0].first, 0);
}

TEST(MatchBruteForce, EmptySidesGiveNothing) {
  std::mt19937 generator(5);
  const FrameFeatures none = Features({}), one = Features({RandomDescriptor(generator)});
  EXPECT_TRUE(MatchAll(none, one, MatchOptions{}).empty());
  EXPECT_TRUE(MatchAll(one, none, MatchOptions{}).empty());
}

TEST(KeepConsistentRotation, DropsWhatTurnsAnotherWay) {
  std::mt19937 generator(6);
  std::uniform_real_distribution<float> angle(0.0F, 6.28F);
  std::normal_distribution<float> noise(0.0F, 0.05F);
  const float full_turn = 2.0F * static_cast<float>(M_PI);
  for (const float turn : {0.0F, 1.0F, 3.14F, 6.2F}) {
    std::vector<float> first_angles, second_angles;
    std::vector<FeatureMatch> matches;
    for (int i = 0; i < 100; ++i) {
      const bool is_outlier = i % 10 == 0;
      const float error = is_outlier ? 1.0F + 0.04F * static_cast<float>(i) : noise(generator);
      first_angles.push_back(angle(generator));
      second_angles.push_back(std::fmod(first_angles.back() + turn + error + full_turn, full_turn));
      matches.push_back({i, i, 0});
    }
    const std::vector<Descriptor> descriptors(100);
    KeepConsistentRotation(Features(descriptors, first_angles), Features(descriptors, second_angles), &matches);
    EXPECT_GE(matches.size(), 90U);
    EXPECT_LE(matches.size(), 92U);
    EXPECT_TRUE(std::is_sorted(matches.begin(), matches.end(),
                               [](const FeatureMatch& a, const FeatureMatch& b) { return a.first < b.first; }));
  }
}

TEST(KeepConsistentRotation, KeepsThreeBinsAndNoMore) {
  // Changes of 0, 60, 120 and 180 degrees, seen 4, 3, 2 and 1 times.
  std::vector<float> angles;
  std::vector<FeatureMatch> matches;
  for (int group = 0; group < 4; ++group) {
    for (int i = 0; i < 4 - group; ++i) {
      matches.push_back({static_cast<int>(angles.size()), static_cast<int>(angles.size()), 0});
      angles.push_back(static_cast<float>(group) * static_cast<float>(M_PI) / 3.0F);
    }
  }
  const std::vector<Descriptor> descriptors(angles.size());
  KeepConsistentRotation(Features(descriptors), Features(descriptors, angles), &matches);
  ASSERT_EQ(matches.size(), 9U);
  EXPECT_EQ(matches.back().first, 8);
  std::vector<FeatureMatch> none;
  KeepConsistentRotation(Features({}), Features({}), &none);
  EXPECT_TRUE(none.empty());
}

TEST(MatchWithinRadius, LooksNoFurtherThanRadiusAndOctaves) {
  std::mt19937 generator(7);
  const Descriptor a = RandomDescriptor(generator);
  FrameFeatures first = Features({a}), second = Features({a});
  second.keypoints[0].pixel = {10.0F, 0.0F};
  second.keypoints[0].octave = 2;
  second.grid = ImageGrid(second.keypoints);
  const MatchOptions options;
  EXPECT_EQ(MatchWithinRadius(first, second, {{0.0F, 0.0F}}, 10.0F, 2, options).size(), 1U);
  EXPECT_TRUE(MatchWithinRadius(first, second, {{0.0F, 0.0F}}, 9.9F, 2, options).empty());
  EXPECT_TRUE(MatchWithinRadius(first, second, {{0.0F, 0.0F}}, 10.0F, 1, options).empty());
  EXPECT_EQ(MatchWithinRadius(first, second, {{10.0F, 0.0F}}, 0.0F, 2, options).size(), 1U);
}

TEST(MatchWithinRadius, UnlimitedIsBruteForce) {
  const FrameFeatures first = test::ExtractFrom(test::RandomRectangles(320, 240, 200, 1));
  const FrameFeatures second = test::ExtractFrom(test::RandomRectangles(320, 240, 200, 2));
  MatchOptions options;
  options.max_distance = 100;
  const auto within = MatchWithinRadius(first, second, OwnPixels(first), 1e6F, 99, options);
  const auto all = MatchAll(first, second, options);
  ASSERT_EQ(within.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(within[i].first, all[i].first);
    EXPECT_EQ(within[i].second, all[i].second);
    EXPECT_EQ(within[i].distance, all[i].distance);
  }
  ExpectOneToOne(all);
}

TEST(MatchWithinRadius, FollowsAShiftedImage) {
  const cv::Mat world = test::RandomRectangles(660, 500, 500, 3);
  const cv::Point shift(12, 7);
  const FrameFeatures first = test::ExtractFrom(world(cv::Rect(0, 0, 640, 480)).clone());
  const FrameFeatures second = test::ExtractFrom(world(cv::Rect(shift.x, shift.y, 640, 480)).clone());
  const auto matches = MatchWithinRadius(first, second, OwnPixels(first), 20.0F, 1, MatchOptions{});
  ExpectOneToOne(matches);
  ASSERT_GT(matches.size(), first.keypoints.size() / 3);
  std::size_t correct = 0;
  for (const FeatureMatch& match : matches) {
    const Keypoint& p = first.keypoints[static_cast<std::size_t>(match.first)];
    const Keypoint& q = second.keypoints[static_cast<std::size_t>(match.second)];
    const Eigen::Vector2f error = p.pixel - q.pixel - Eigen::Vector2i(shift.x, shift.y).cast<float>();
    if (error.norm() < 1.5F * std::pow(1.2F, static_cast<float>(p.octave))) ++correct;
  }
  EXPECT_GT(static_cast<double>(correct), 0.95 * static_cast<double>(matches.size()));
}

TEST(HammingDistances, AreTheHammingDistancesOfTheIndicesInTheirOrder) {
  std::mt19937 generator(11);
  std::vector<Descriptor> descriptors(20);
  for (Descriptor& d : descriptors) d = RandomDescriptor(generator);
  const Descriptor query = WithFlippedBits(descriptors[7], 13);
  const std::vector<int> indices{7, 0, 19, 7, 3};
  std::vector<int> distances(100, -1);
  HammingDistances(query, descriptors, indices, &distances);
  ASSERT_EQ(distances.size(), indices.size());
  EXPECT_EQ(distances[0], 13);
  for (std::size_t k = 0; k < indices.size(); ++k) {
    EXPECT_EQ(distances[k], HammingDistance(query, descriptors[static_cast<std::size_t>(indices[k])]));
  }
  HammingDistances(query, descriptors, {}, &distances);
  EXPECT_TRUE(distances.empty());
}

}  // namespace
}  // namespace planar_vslam
