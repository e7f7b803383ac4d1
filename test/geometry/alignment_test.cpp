#include "planar_vslam/geometry/alignment.h"

#include <gtest/gtest.h>

#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

std::vector<Eigen::Vector3d> RandomPoints(std::mt19937& generator, int count, double height) {
  std::uniform_real_distribution<double> side(-5.0, 5.0), up(-height, height);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double x = side(generator), y = side(generator);
    points.emplace_back(x, y, height > 0.0 ? up(generator) : 0.0);
  }
  return points;
}

std::vector<Eigen::Vector3d> Moved(const std::vector<Eigen::Vector3d>& points, const Similarity3& motion) {
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& point : points) moved.push_back(motion.Apply(point));
  return moved;
}

void ExpectNear(const Similarity3& a, const Similarity3& b) {
  EXPECT_NEAR(a.scale, b.scale, 1e-9);
  EXPECT_LT((a.T_target_source.translation - b.T_target_source.translation).norm(), 1e-8);
  EXPECT_LT(a.T_target_source.rotation.angularDistance(b.T_target_source.rotation), 1e-7);
}

TEST(Alignment, RecoversRandomSimilaritiesOfSolidAndFlatPoints) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> scale(0.1, 5.0);
  for (int i = 0; i < 50; ++i) {
    for (const double height : {2.0, 0.0}) {
      const auto source = RandomPoints(generator, 20, height);
      Similarity3 truth;
      truth.T_target_source = test::RandomRigid3(generator, 10.0);
      ExpectNear(AlignPoints(source, Moved(source, truth), Alignment::kSe3), truth);
      truth.scale = scale(generator);
      ExpectNear(AlignPoints(source, Moved(source, truth), Alignment::kSim3), truth);
    }
  }
}

TEST(Alignment, RecoversRandomPlaneMotionsAndLeavesHeightsAlone) {
  std::mt19937 generator(2);
  for (int i = 0; i < 50; ++i) {
    const auto source = RandomPoints(generator, 2 + i, 1.0);
    Similarity3 truth;
    truth.T_target_source = Embed3(test::RandomRigid2(generator, 10.0));
    auto target = Moved(source, truth);
    for (Eigen::Vector3d& point : target) point.z() += 0.3;
    ExpectNear(AlignPoints(source, target, Alignment::kSe2), truth);
  }
}

TEST(Alignment, MirroredPointsStillGiveAProperRotation) {
  std::mt19937 generator(3);
  const auto source = RandomPoints(generator, 20, 2.0);
  auto target = source;
  for (Eigen::Vector3d& point : target) point.x() = -point.x();
  EXPECT_NEAR(AlignPoints(source, target, Alignment::kSim3).T_target_source.R().determinant(), 1.0, 1e-9);
}

TEST(Alignment, IsTheLeastSquaresOptimumOfNoisyPoints) {
  std::mt19937 generator(4);
  std::normal_distribution<double> noise(0.0, 0.1);
  const auto source = RandomPoints(generator, 50, 2.0);
  Similarity3 truth;
  truth.T_target_source = test::RandomRigid3(generator, 3.0);
  auto target = Moved(source, truth);
  for (Eigen::Vector3d& point : target) point += Eigen::Vector3d(noise(generator), noise(generator), noise(generator));
  const auto cost = [&](const Similarity3& motion) {
    double sum = 0.0;
    for (std::size_t i = 0; i < source.size(); ++i) sum += (motion.Apply(source[i]) - target[i]).squaredNorm();
    return sum;
  };
  const Similarity3 best = AlignPoints(source, target, Alignment::kSe3);
  for (int axis = 0; axis < 6; ++axis) {
    for (const double step : {1e-3, -1e-3}) {
      Similarity3 other = best;
      other.T_target_source = best.T_target_source * ExpSe3(step * Vector6d::Unit(axis));
      EXPECT_LT(cost(best), cost(other)) << axis;
    }
  }
}

TEST(Alignment, TooFewPairsOrNoneAskedForGiveIdentity) {
  const std::vector<Eigen::Vector3d> one = {{1.0, 2.0, 3.0}}, two = {{1.0, 2.0, 3.0}, {2.0, 2.0, 3.0}};
  const std::vector<Eigen::Vector3d> three = {{1.0, 2.0, 3.0}, {2.0, 2.0, 3.0}, {5.0, 2.0, 1.0}};
  const std::vector<Eigen::Vector3d> shifted = {{2.0, 2.0, 3.0}, {3.0, 2.0, 3.0}, {6.0, 2.0, 1.0}};
  ExpectNear(AlignPoints({}, {}, Alignment::kSim3), Similarity3());
  ExpectNear(AlignPoints(one, {{9.0, 9.0, 9.0}}, Alignment::kSe2), Similarity3());
  ExpectNear(AlignPoints(two, {{0.0, 0.0, 0.0}, {0.0, 5.0, 0.0}}, Alignment::kSe3), Similarity3());
  ExpectNear(AlignPoints(three, shifted, Alignment::kNone), Similarity3());
}

}  // namespace
}  // namespace planar_vslam
