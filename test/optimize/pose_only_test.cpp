#include "planar_vslam/optimize/pose_only.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "planar_vslam/planar/preintegration.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

struct Scene {
  test::SyntheticWorld world;
  PoseOnlyProblem problem;
  std::vector<PoseObservation> observations;
  Rigid3 truth;
};

Scene MakeScene(double pixel_noise) {
  Scene s;
  test::SyntheticWorldOptions options;
  options.pixel_noise = pixel_noise;
  s.world = test::MakeSyntheticWorld(options);
  const Keyframe& keyframe = s.world.map.keyframes.At(KeyframeId{3});
  s.truth = keyframe.T_map_base;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) continue;
    s.observations.push_back({s.world.map.landmarks.At(keyframe.landmarks[i]).p_map,
                              keyframe.features->keypoints[i].pixel.cast<double>(), 1.0, true});
  }
  s.problem.T_base_camera = keyframe.T_base_camera;
  s.problem.camera = s.world.camera;
  Vector6d off;
  off << 0.1, -0.08, 0.05, 0.03, -0.02, 0.06;
  s.problem.T_map_base = s.truth * ExpSe3(off);
  return s;
}

double Error(const Rigid3& a, const Rigid3& b) { return LogSe3(a.Inverse() * b).norm(); }

TEST(OptimizePose, FindsTheTruePoseFromExactPixels) {
  Scene s = MakeScene(0.0);
  ASSERT_GT(s.observations.size(), 30U);
  const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
  EXPECT_LT(Error(result.T_map_base, s.truth), 1e-5);
  EXPECT_EQ(result.inliers, static_cast<int>(s.observations.size()));
}

TEST(OptimizePose, RejectsAThirdOfWrongMatches) {
  Scene s = MakeScene(0.3);
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> pixel(30.0, 400.0);
  for (std::size_t i = 0; i < s.observations.size(); i += 3)
    s.observations[i].pixel = {pixel(generator), pixel(generator)};
  const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
  EXPECT_LT(Error(result.T_map_base, s.truth), 0.02);
  for (std::size_t i = 0; i < s.observations.size(); ++i) {
    const Eigen::Vector3d p = (s.truth * s.problem.T_base_camera).Inverse() * s.observations[i].p_map;
    const bool wrong = (s.problem.camera.ProjectUndistorted(p) - s.observations[i].pixel).norm() > 10.0;
    EXPECT_TRUE(!wrong || !s.observations[i].inlier) << i;
  }
}

TEST(OptimizePose, CovarianceCoversTheError) {
  double squared = 0.0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    test::SyntheticWorldOptions options;
    options.pixel_noise = 1.0;
    options.points = 120;
    options.seed = static_cast<std::uint32_t>(100 + run);
    Scene s = MakeScene(0.0);
    s.world = test::MakeSyntheticWorld(options);
    const Keyframe& keyframe = s.world.map.keyframes.At(KeyframeId{3});
    s.observations.clear();
    for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      if (!keyframe.landmarks[i].valid()) continue;
      s.observations.push_back({s.world.map.landmarks.At(keyframe.landmarks[i]).p_map,
                                keyframe.features->keypoints[i].pixel.cast<double>(), 1.0, true});
    }
    const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
    const Vector6d error = LogSe3(s.truth.Inverse() * result.T_map_base);
    squared += error.dot(result.information * error);
  }
  // Mean of a chi-square with 6 dof over 40 runs: 6 +- 3 sigma of 0.55; the cut of the outlier test narrows it a
  // little.
  EXPECT_NEAR(squared / kRuns, 6.0, 1.8);
}

// J^T J of reprojection_factor.h's error at the solution, by central differences.
TEST(OptimizePose, InformationIsThatOfTheInliers) {
  Scene s = MakeScene(0.7);
  for (std::size_t i = 0; i < s.observations.size(); i += 2) s.observations[i].sigma = 1.7;
  for (std::size_t i = 0; i < s.observations.size(); i += 5) s.observations[i].pixel.x() += 40.0;
  const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
  Matrix6d expected = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  int inliers = 0;
  for (const PoseObservation& o : s.observations) {
    const auto error = [&](const Vector6d& step) -> Eigen::Vector2d {
      const Rigid3 T_camera_map = (result.T_map_base * ExpSe3(step) * s.problem.T_base_camera).Inverse();
      return (s.problem.camera.ProjectUndistorted(T_camera_map * o.p_map) - o.pixel) / o.sigma;
    };
    if (!o.inlier) continue;
    ++inliers;
    Eigen::Matrix<double, 2, 6> J;
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      J.col(k) = (error(kStep * Vector6d::Unit(k)) - error(-kStep * Vector6d::Unit(k))) / (2.0 * kStep);
    }
    expected += J.transpose() * J;
    gradient += J.transpose() * error(Vector6d::Zero());
  }
  EXPECT_EQ(inliers, result.inliers);
  EXPECT_LT(inliers, static_cast<int>(s.observations.size()));
  EXPECT_LT((result.information - expected).norm(), 1e-6 * expected.norm());
  // What is left to go is far below what the pixels tell.
  const Vector6d left = expected.ldlt().solve(gradient);
  EXPECT_LT(left.dot(expected * left), 1e-4);
}

TEST(OptimizePose, StaysWhereItEnded) {
  Scene s = MakeScene(0.7);
  for (std::size_t i = 0; i < s.observations.size(); i += 4) s.observations[i].pixel.y() -= 25.0;
  const PoseOnlyResult first = OptimizePose(s.problem, &s.observations);
  s.problem.T_map_base = first.T_map_base;
  for (PoseObservation& o : s.observations) o.inlier = true;
  const PoseOnlyResult again = OptimizePose(s.problem, &s.observations);
  EXPECT_EQ(again.inliers, first.inliers);
  EXPECT_LT(Error(again.T_map_base, first.T_map_base), 2e-5);
}

TEST(OptimizePose, OdometryPriorCarriesWhatVisionDoesNotSee) {
  Scene s = MakeScene(0.0);
  s.observations.resize(2);  // far too few
  PosePrior prior{s.truth, Matrix6d::Identity() * 1e3};
  s.problem.prior = prior;
  const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
  EXPECT_LT(Error(result.T_map_base, s.truth), 0.2);
}

TEST(OptimizePose, PlanarPriorLeavesHeightAndTiltFree) {
  Scene s = MakeScene(0.0);
  Vector6d tipped = Vector6d::Zero();
  tipped[2] = 0.02;
  tipped[4] = 0.05;
  s.problem.prior = PosePrior{s.truth * ExpSe3(tipped), Matrix6d::Identity() * 1e4};
  EXPECT_GT(Error(OptimizePose(s.problem, &s.observations).T_map_base, s.truth), 0.02);
  for (PoseObservation& o : s.observations) o.inlier = true;
  s.problem.prior->planar = true;
  const Vector6d error = LogSe3(s.truth.Inverse() * OptimizePose(s.problem, &s.observations).T_map_base);
  EXPECT_LT(std::abs(error[2]), 2e-3);
  EXPECT_LT(std::abs(error[4]), 1e-3);
  EXPECT_LT(std::abs(error[5]), 1e-3);
}

TEST(OptimizePose, FloorPriorHoldsHeightAndTilt) {
  Scene s = MakeScene(0.5);
  s.observations.resize(6);
  s.problem.floor = PlanarMode::kSoftSe3;
  s.problem.sigma_height = 0.001;
  s.problem.sigma_tilt = DegreesToRadians(0.01);
  const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
  EXPECT_LT(std::abs(result.T_map_base.translation.z()), 0.005);
  EXPECT_LT((result.T_map_base.R().row(2).head<2>()).norm(), DegreesToRadians(0.05));
}

class OptimizeFloorPose : public ::testing::TestWithParam<PlanarMode> {};

TEST_P(OptimizeFloorPose, StaysOnTheFloorAndFindsTheTruth) {
  Scene s = MakeScene(0.0);
  s.problem.floor = GetParam();
  const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
  EXPECT_EQ(result.T_map_base.translation.z(), 0.0);
  EXPECT_EQ(result.T_map_base.R()(2, 2), 1.0);
  EXPECT_LT(Error(result.T_map_base, s.truth), 1e-5);
  EXPECT_EQ(result.inliers, static_cast<int>(s.observations.size()));
}

// One draw of height and tilt an image, pixels, and a prior off by what it says: what the covariance is about.
TEST_P(OptimizeFloorPose, CovarianceCoversTheErrorOfASwayingBase) {
  std::mt19937 generator(4);
  std::normal_distribution<double> normal;
  double squared = 0.0;
  constexpr int kRuns = 60;
  const double prior_sigma = 0.01;  // m and rad
  for (int run = 0; run < kRuns; ++run) {
    Scene s = MakeScene(0.0);
    s.problem.floor = GetParam();
    s.problem.sigma_height = 0.003;
    s.problem.sigma_tilt = DegreesToRadians(0.1);
    const Rigid3 sway(ExpSo3({s.problem.sigma_tilt * normal(generator), s.problem.sigma_tilt * normal(generator), 0.0}),
                      Eigen::Vector3d(0.0, 0.0, s.problem.sigma_height * normal(generator)));
    const Rigid3 truth(sway.rotation * s.truth.rotation, Eigen::Vector3d(s.truth.translation + sway.translation));
    const Rigid3 T_camera_map = (truth * s.problem.T_base_camera).Inverse();
    for (PoseObservation& o : s.observations) {
      o.sigma = 2.0;  // so that sway stays within the limits of the outlier test in all modes
      o.pixel = s.problem.camera.ProjectUndistorted(T_camera_map * o.p_map) +
                o.sigma * Eigen::Vector2d(normal(generator), normal(generator));
    }
    Vector6d off = Vector6d::Zero();
    for (const int k : {0, 1, 5}) off[k] = prior_sigma * normal(generator);
    s.problem.prior = PosePrior{s.truth * ExpSe3(off), Matrix6d::Identity() / prior_sigma};
    const PoseOnlyResult result = OptimizePose(s.problem, &s.observations);
    const Vector6d error = LogSe3(result.T_map_base.Inverse() * truth);
    squared += error.dot(result.information * error);
  }
  // A chi-square of 6 dof over 60 runs: 6 +- 3 sigma of 0.45, and what the cut of the outlier test takes.
  EXPECT_NEAR(squared / kRuns, 6.0, 1.6);
}

TEST_P(OptimizeFloorPose, ManyPointsDoNotAverageTiltOut) {
  Scene s = MakeScene(0.0);
  s.problem.floor = GetParam();
  const auto sigma_of_position = [&s](std::size_t copies) {
    std::vector<PoseObservation> many;
    for (std::size_t k = 0; k < copies; ++k) many.insert(many.end(), s.observations.begin(), s.observations.end());
    const Matrix6d covariance = OptimizePose(s.problem, &many).information.inverse();
    return std::sqrt(covariance.topLeftCorner<2, 2>().trace());
  };
  EXPECT_GT(sigma_of_position(100), 0.3 * sigma_of_position(1));
}

TEST_P(OptimizeFloorPose, PriorEntersWithItsMarginal) {
  Scene s = MakeScene(0.0);
  s.problem.floor = GetParam();
  s.observations.clear();
  Matrix6d covariance = 1e-4 * Matrix6d::Identity();
  covariance(0, 4) = covariance(4, 0) = 0.9e-4;  // forwards and pitch go together
  s.problem.prior = PosePrior{s.truth, SquareRootInformation(covariance)};
  const Matrix6d found = OptimizePose(s.problem, &s.observations).information.inverse();
  EXPECT_NEAR(found(0, 0), 1e-4, 1e-9);
  EXPECT_NEAR(found(5, 5), 1e-4, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Modes, OptimizeFloorPose, ::testing::Values(PlanarMode::kSe2Xyz, PlanarMode::kHard));

}  // namespace
}  // namespace planar_vslam
