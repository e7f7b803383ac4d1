#include "planar_vslam/geometry/two_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

constexpr double kFocal = 500.0, kCx = 320.0, kCy = 240.0;  // px
constexpr double kNoise = 0.5;                              // px
constexpr int kMatches = 300;

struct Scene {
  std::vector<Eigen::Vector3d> points;  // in the first camera
  std::vector<Eigen::Vector2d> first, second;
  Rigid3 T_first_second;
};

Eigen::Vector2d Pixel(const Eigen::Vector3d& p) { return {kFocal * p.x() / p.z() + kCx, kFocal * p.y() / p.z() + kCy}; }

// `depth_at` gives the depth of the point on a ray (x, y, 1).
template <class Depth>
Scene MakeScene(std::uint32_t seed, const Rigid3& T_first_second, double noise, double outlier_share, Depth depth_at) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> u(0.0, 2.0 * kCx), v(0.0, 2.0 * kCy), share(0.0, 1.0);
  std::normal_distribution<double> normal;
  const auto error = [&] { return noise * normal(generator); };
  Scene scene;
  scene.T_first_second = T_first_second;
  while (scene.first.size() < kMatches) {
    const double x = (u(generator) - kCx) / kFocal, y = (v(generator) - kCy) / kFocal;
    const Eigen::Vector3d p = depth_at(x, y, share(generator)) * Eigen::Vector3d(x, y, 1.0);
    const Eigen::Vector3d q = T_first_second.Inverse() * p;
    const Eigen::Vector2d first_error(error(), error());
    const Eigen::Vector2d second_error(error(), error());
    const Eigen::Vector2d wrong(u(generator), v(generator));
    const bool outlier = share(generator) < outlier_share;
    if (q.z() < 0.1) continue;
    scene.points.push_back(p);
    scene.first.push_back(Pixel(p) + first_error);
    scene.second.push_back(outlier ? wrong : Eigen::Vector2d(Pixel(q) + second_error));
  }
  return scene;
}

double Cloud(double, double, double share) { return 2.0 + 6.0 * share; }
// A wall about 4 m away, seen at an angle.
double Wall(double x, double, double) { return 4.0 / (1.0 + 0.5 * x); }

Rigid3 Sideways() { return Rigid3(ExpSo3(Eigen::Vector3d(0.02, -0.1, 0.01)), Eigen::Vector3d(0.6, 0.02, 0.1)); }

TwoViewResult Estimate(const Scene& scene, std::uint32_t seed = 7) {
  return EstimateTwoViewMotion(scene.first, scene.second, kFocal, kFocal, kCx, kCy, TwoViewOptions(), seed);
}

double DirectionErrorDegrees(const TwoViewResult& result, const Scene& scene) {
  const Eigen::Vector3d a = result.T_first_second.translation, b = scene.T_first_second.translation;
  return RadiansToDegrees(std::atan2(a.cross(b).norm(), a.dot(b)));
}
double RotationErrorDegrees(const TwoViewResult& result, const Scene& scene) {
  return RadiansToDegrees(result.T_first_second.rotation.angularDistance(scene.T_first_second.rotation));
}

// Share of the set points whose scaled depth is within `tolerance` (relative) of the truth.
double ShareOfGoodDepths(const TwoViewResult& result, const Scene& scene, double tolerance) {
  const double scale = scene.T_first_second.translation.norm();
  int set = 0, good = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (!result.points[i]) continue;
    ++set;
    if (std::abs(scale * result.points[i]->z() / scene.points[i].z() - 1.0) < tolerance) ++good;
  }
  return set == 0 ? 0.0 : static_cast<double>(good) / set;
}

int SetPoints(const TwoViewResult& result) {
  int set = 0;
  for (const auto& point : result.points) set += point.has_value() ? 1 : 0;
  return set;
}

TEST(TwoView, ExactGeneralSceneIsRecoveredExactly) {
  const Scene scene = MakeScene(1, Sideways(), 0.0, 0.0, Cloud);
  const TwoViewResult result = Estimate(scene);
  ASSERT_EQ(result.status, TwoViewStatus::kOk);
  EXPECT_FALSE(result.used_homography);
  EXPECT_NEAR(result.T_first_second.translation.norm(), 1.0, 1e-12);
  EXPECT_LT(RotationErrorDegrees(result, scene), 1e-3);
  EXPECT_LT(DirectionErrorDegrees(result, scene), 1e-2);
  EXPECT_DOUBLE_EQ(ShareOfGoodDepths(result, scene, 1e-3), 1.0);
}

TEST(TwoView, NoisyGeneralScenesWithOutliersAreRecovered) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const Scene scene = MakeScene(seed, Sideways(), kNoise, 0.2, Cloud);
    const TwoViewResult result = Estimate(scene);
    ASSERT_EQ(result.status, TwoViewStatus::kOk) << seed;
    EXPECT_FALSE(result.used_homography);
    EXPECT_LT(RotationErrorDegrees(result, scene), 0.7) << seed;
    EXPECT_LT(DirectionErrorDegrees(result, scene), 5.0) << seed;
    EXPECT_GT(SetPoints(result), 150) << seed;
    EXPECT_GT(ShareOfGoodDepths(result, scene, 0.2), 0.9) << seed;
    EXPECT_GT(result.parallax_degrees, 1.0);
  }
}

TEST(TwoView, ForwardMotionIsRecovered) {
  const Rigid3 forward(ExpSo3(Eigen::Vector3d(0.0, 0.03, 0.0)), Eigen::Vector3d(0.05, 0.0, 0.8));
  const Scene scene = MakeScene(3, forward, kNoise, 0.1, Cloud);
  const TwoViewResult result = Estimate(scene);
  ASSERT_EQ(result.status, TwoViewStatus::kOk);
  EXPECT_LT(RotationErrorDegrees(result, scene), 0.5);
  EXPECT_LT(DirectionErrorDegrees(result, scene), 5.0);
}

TEST(TwoView, PlanarScenesAreRecoveredThroughTheHomography) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const Scene scene = MakeScene(seed, Sideways(), kNoise, 0.2, Wall);
    const TwoViewResult result = Estimate(scene);
    ASSERT_EQ(result.status, TwoViewStatus::kOk) << seed;
    EXPECT_TRUE(result.used_homography) << seed;
    EXPECT_LT(RotationErrorDegrees(result, scene), 1.0) << seed;
    EXPECT_LT(DirectionErrorDegrees(result, scene), 8.0) << seed;
    EXPECT_GT(ShareOfGoodDepths(result, scene, 0.2), 0.9) << seed;
  }
}

TEST(TwoView, PureRotationIsRefused) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    for (const double noise : {0.0, kNoise, 1.0}) {
      const Rigid3 turn(ExpSo3(Eigen::Vector3d(0.0, 0.15, 0.0)), Eigen::Vector3d::Zero());
      const TwoViewResult result = Estimate(MakeScene(seed, turn, noise, 0.1, Cloud));
      EXPECT_EQ(result.status, TwoViewStatus::kLowParallax) << seed << " " << noise;
      EXPECT_EQ(SetPoints(result), 0);
    }
  }
}

TEST(TwoView, ABaselineTooShortForTheDepthIsRefused) {
  const Rigid3 short_step(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.01, 0.0, 0.0));
  EXPECT_EQ(Estimate(MakeScene(4, short_step, kNoise, 0.0, Cloud)).status, TwoViewStatus::kLowParallax);
}

TEST(TwoView, UnrelatedPixelsGiveNoModel) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    EXPECT_EQ(Estimate(MakeScene(seed, Sideways(), kNoise, 1.0, Cloud)).status, TwoViewStatus::kNoModel) << seed;
  }
}

TEST(TwoView, APlaneWithTwoExplanationsIsAmbiguous) {
  // Driving towards a wall, every point is nearer to the second camera: both decompositions keep them all in front.
  const Rigid3 approach(ExpSo3(Eigen::Vector3d(0.0, 0.05, 0.0)), Eigen::Vector3d(0.3, 0.0, 0.6));
  const TwoViewResult result = Estimate(MakeScene(5, approach, 0.2, 0.0, Wall));
  EXPECT_EQ(result.status, TwoViewStatus::kAmbiguous);
  EXPECT_EQ(SetPoints(result), 0);
}

TEST(TwoView, TooFewMatchesAndTooFewPointsAreSaid) {
  Scene scene = MakeScene(6, Sideways(), 0.1, 0.0, Cloud);
  scene.first.resize(40);
  scene.second.resize(40);
  EXPECT_EQ(Estimate(scene).status, TwoViewStatus::kTooFewPoints);
  scene.first.resize(7);
  scene.second.resize(7);
  const TwoViewResult result = Estimate(scene);
  EXPECT_EQ(result.status, TwoViewStatus::kTooFewMatches);
  EXPECT_EQ(result.points.size(), 7u);
}

TEST(TwoView, SameSeedSameResult) {
  const Scene scene = MakeScene(8, Sideways(), kNoise, 0.2, Cloud);
  const TwoViewResult a = Estimate(scene, 11), b = Estimate(scene, 11);
  EXPECT_EQ(a.T_first_second.translation, b.T_first_second.translation);
  EXPECT_EQ(a.T_first_second.rotation.coeffs(), b.T_first_second.rotation.coeffs());
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) EXPECT_EQ(a.points[i], b.points[i]);
}

}  // namespace
}  // namespace planar_vslam
