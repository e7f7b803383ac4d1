#include "planar_vslam/feature/line_search.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

namespace planar_vslam {
namespace {

const std::vector<float> kSquaredReach{3.8F, 5.5F, 8.0F, 11.5F};  // px^2, an octave each

std::vector<int> Sorted(std::vector<int> indices) {
  std::sort(indices.begin(), indices.end());
  return indices;
}

class LineSearchTest : public ::testing::Test {
 protected:
  float Uniform(float from, float to) { return std::uniform_real_distribution<float>(from, to)(generator_); }

  std::vector<Keypoint> RandomKeypoints(std::size_t count) {
    std::vector<Keypoint> keypoints(count);
    for (Keypoint& k : keypoints) {
      k.pixel = {Uniform(-20.0F, 660.0F), Uniform(-20.0F, 500.0F)};
      k.octave = static_cast<std::int32_t>(generator_() % kSquaredReach.size());
    }
    return keypoints;
  }

  // Through two pixels, in or far beside the image, and of any scale.
  Eigen::Vector3f RandomLine() {
    const float reach = generator_() % 4 == 0 ? 1e5F : 800.0F;
    const Eigen::Vector3f a(Uniform(-reach, reach), Uniform(-reach, reach), 1.0F);
    const Eigen::Vector3f b(Uniform(0.0F, 640.0F), Uniform(0.0F, 480.0F), 1.0F);
    return Uniform(-1.0F, 1.0F) * a.cross(b);
  }

  // As the header says it, keypoint by keypoint.
  static std::vector<int> FindAmongAll(const std::vector<Keypoint>& keypoints, const std::vector<int>& indices,
                                       const Eigen::Vector3f& line) {
    std::vector<int> found;
    for (const int i : indices) {
      const Keypoint& k = keypoints[static_cast<std::size_t>(i)];
      const float distance = line.x() * k.pixel.x() + line.y() * k.pixel.y() + line.z();
      const float reach = kSquaredReach[static_cast<std::size_t>(k.octave)];
      if (distance * distance <= reach * line.head<2>().squaredNorm()) found.push_back(i);
    }
    return found;
  }

  std::mt19937 generator_{7};
};

TEST_F(LineSearchTest, FindsWhatAComparisonWithAllKeypointsFinds) {
  std::size_t found_in_all = 0;
  for (const std::size_t count : {1U, 15U, 16U, 17U, 200U, 1000U}) {
    const std::vector<Keypoint> keypoints = RandomKeypoints(count);
    std::vector<int> indices;
    for (std::size_t i = 0; i < count; ++i) {
      if (count < 20 || generator_() % 3 != 0) indices.push_back(static_cast<int>(i));
    }
    const LineSearch search(keypoints, indices, kSquaredReach);
    for (int k = 0; k < 300; ++k) {
      const Eigen::Vector3f line = RandomLine();
      std::vector<int> found;
      search.Find(line, &found);
      EXPECT_EQ(Sorted(found), Sorted(FindAmongAll(keypoints, indices, line)));
      found_in_all += found.size();
    }
  }
  EXPECT_GT(found_in_all, 1000U);
}

TEST_F(LineSearchTest, AppendsToWhatIsThere) {
  const std::vector<Keypoint> keypoints = RandomKeypoints(1);
  const Eigen::Vector2f& p = keypoints.front().pixel;
  std::vector<int> found{42};
  LineSearch(keypoints, {0}, kSquaredReach).Find({1.0F, 0.0F, -p.x()}, &found);
  EXPECT_EQ(found, (std::vector<int>{42, 0}));
}

TEST_F(LineSearchTest, OfNoKeypointsFindsNone) {
  std::vector<int> found;
  LineSearch({}, {}, kSquaredReach).Find({1.0F, 0.0F, 0.0F}, &found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace planar_vslam
