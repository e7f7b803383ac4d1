#include "planar_vslam/planar/relative_pose_factor.h"

#include <array>

#include "factor_testing.h"
#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/planar/planar_prior.h"
#include "planar_vslam/planar/preintegration.h"
#include "support/factor_twins.h"

namespace planar_vslam::test {
namespace {

Matrix6d SomeCovariance() {
  PlanarMotion odometry;
  odometry.T_i_j = Rigid2(0.4, 0.1, 0.6);
  odometry.covariance << 4e-4, 1e-4, -5e-5, 1e-4, 6e-4, 2e-4, -5e-5, 2e-4, 3e-4;
  odometry.distance = 0.5;
  return LiftedCovariance(odometry, OdometryNoise());
}

// Pairs of nasty poses with a measurement that is off by up to `error` in each direction.
struct Case {
  Rigid3 T_map_i, T_map_j, T_i_j_measured;
  std::vector<Block> Blocks() const { return {ToBlock(T_map_i), ToBlock(T_map_j)}; }
};
std::vector<Case> Cases(double error) {
  std::mt19937 generator(3);
  const std::vector<Rigid3> poses = NastyPoses();
  std::vector<Case> cases;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Rigid3& T_map_i = poses[k];
    for (const Rigid3& T_map_j : {poses[(k + 1) % poses.size()], T_map_i * ExpSe3(RandomTangent(generator, 0.3))}) {
      const Rigid3 T_i_j = T_map_i.Inverse() * T_map_j;
      cases.push_back({T_map_i, T_map_j, T_i_j * ExpSe3(RandomTangent(generator, error))});
    }
  }
  return cases;
}

TEST(RelativePoseFactor, ResidualIsZeroAtTruth) {
  for (const Case& c : Cases(0.0)) {
    EXPECT_LT(RelativePoseResidual(c.T_map_i, c.T_map_j, c.T_i_j_measured, nullptr, nullptr).norm(), 1e-13);
  }
}

TEST(RelativePoseFactor, ResidualIsThePerturbationAtJ) {
  std::mt19937 generator(4);
  for (const Case& c : Cases(0.0)) {
    const Vector6d d = RandomTangent(generator, 0.8);
    const Rigid3 T_map_j = c.T_map_j * ExpSe3(d);
    EXPECT_LT((RelativePoseResidual(c.T_map_i, T_map_j, c.T_i_j_measured, nullptr, nullptr) - d).norm(), 1e-11);
  }
}

TEST(RelativePoseFactor, ResidualDoesNotDependOnTheMapFrame) {
  const Rigid3 T_new_map = FromYaw(3.0, 10.0, -20.0) * ExpSe3(0.3 * Vector6d::Ones());
  for (const Case& c : Cases(0.4)) {
    const Vector6d e = RelativePoseResidual(c.T_map_i, c.T_map_j, c.T_i_j_measured, nullptr, nullptr);
    const Vector6d moved =
        RelativePoseResidual(T_new_map * c.T_map_i, T_new_map * c.T_map_j, c.T_i_j_measured, nullptr, nullptr);
    EXPECT_LT((e - moved).norm(), 1e-11);
  }
}

TEST(RelativePoseFactor, HasNoJumpAtTheHeadingSeam) {
  const Rigid3 T_i_j = FromYaw(0.2, 0.3, 0.0);
  for (const double yaw : {M_PI - 0.2, M_PI - 0.1, M_PI - 1e-12, M_PI, -M_PI, -M_PI + 1e-12, -M_PI + 0.1}) {
    const Rigid3 T_map_i = FromYaw(WrapAngle(yaw), 2.0, 1.0);
    const Rigid3 T_map_j = T_map_i * FromYaw(0.2 + 0.01, 0.3, 0.0);
    const Vector6d e = RelativePoseResidual(T_map_i, T_map_j, T_i_j, nullptr, nullptr);
    EXPECT_LT((e - 0.01 * Vector6d::Unit(5)).norm(), 1e-12) << yaw;
  }
}

TEST(RelativePoseFactor, GradientsAreRight) {
  const Matrix6d S = SquareRootInformation(SomeCovariance());
  for (const Case& c : Cases(0.7)) ExpectGradientsRight(RelativePoseFactor<6>(c.T_i_j_measured, S), c.Blocks());
  for (const Case& c : Cases(0.0)) ExpectGradientsRight(RelativePoseFactor<6>(c.T_i_j_measured, S), c.Blocks());
}

TEST(RelativePoseFactor, EqualsItsAutomaticTwin) {
  const Matrix6d S = SquareRootInformation(SomeCovariance());
  for (const double error : {0.0, 1e-5, 0.7}) {
    for (const Case& c : Cases(error)) {
      const ceres::AutoDiffCostFunction<OdometryTwin, 6, 7, 7> twin(new OdometryTwin{c.T_i_j_measured, S});
      ExpectTwins(RelativePoseFactor<6>(c.T_i_j_measured, S), twin, c.Blocks());
    }
  }
}

// The covariance of a lifted link has no terms between the two parts: their costs add up to that of the whole.
TEST(RelativePoseFactor, PartsHaveRightGradientsAndAddUpToTheWhole) {
  const Matrix6d S = SquareRootInformation(SomeCovariance());
  for (const double error : {0.0, 0.7}) {
    for (const Case& c : Cases(error)) {
      const RelativePoseFactor<3> planar(c.T_i_j_measured, S(kPlanarRows, Eigen::all));
      const RelativePoseFactor<3> floor(c.T_i_j_measured, S(kFloorRows, Eigen::all));
      ExpectGradientsRight(planar, c.Blocks());
      ExpectGradientsRight(floor, c.Blocks());
      const double whole =
          EvaluateLocal(RelativePoseFactor<6>(c.T_i_j_measured, S), c.Blocks()).residuals.squaredNorm();
      const double parts = EvaluateLocal(planar, c.Blocks()).residuals.squaredNorm() +
                           EvaluateLocal(floor, c.Blocks()).residuals.squaredNorm();
      EXPECT_NEAR(parts, whole, 1e-9 * (1.0 + whole));
    }
  }
}

// What tips a robot over on the spot, as a ramp does, is nothing the wheels measure, and the other way round.
TEST(RelativePoseFactor, TiltIsNoneOfTheWheelsBusiness) {
  const Matrix6d S = SquareRootInformation(SomeCovariance());
  const Rigid3 T_i_j = FromYaw(0.2, 0.5, 0.1);
  const auto Residuals = [&](const std::array<int, 3>& rows, const Vector6d& d) {
    const RelativePoseFactor<3> part(T_i_j, S(rows, Eigen::all));
    return EvaluateLocal(part, {ToBlock(Rigid3()), ToBlock(T_i_j * ExpSe3(d))}).residuals.norm();
  };
  const Vector6d tipped = 0.1 * Vector6d::Unit(4), slipped = 0.1 * Vector6d::Unit(0) + 0.1 * Vector6d::Unit(5);
  EXPECT_LT(Residuals(kPlanarRows, tipped), 1e-9);
  EXPECT_GT(Residuals(kFloorRows, tipped), 1.0);
  EXPECT_LT(Residuals(kFloorRows, slipped), 1e-9);
  EXPECT_GT(Residuals(kPlanarRows, slipped), 1.0);
}

TEST(RelativePoseFactor, FillsOnlyTheJacobiansAskedFor) {
  const Case c = Cases(0.3)[5];
  const std::vector<Block> blocks = c.Blocks();
  const double* parameters[2] = {blocks[0].data(), blocks[1].data()};
  const RelativePoseFactor<6> factor(c.T_i_j_measured, SquareRootInformation(SomeCovariance()));
  const Evaluation all = EvaluateLocal(factor, blocks);

  Vector6d residuals;
  ASSERT_TRUE(factor.Evaluate(parameters, residuals.data(), nullptr));
  EXPECT_EQ(residuals, all.residuals);
  for (const std::size_t wanted : {0u, 1u}) {
    PoseJacobianMap J;
    double* jacobians[2] = {nullptr, nullptr};
    jacobians[wanted] = J.data();
    ASSERT_TRUE(factor.Evaluate(parameters, residuals.data(), jacobians));
    Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
    PoseManifold().PlusJacobian(parameters[wanted], plus.data());
    EXPECT_LT((J * plus - all.local_jacobians[wanted]).norm(), 1e-9);
  }
}

// The paper writes the residual between camera poses. With its covariance taken through the adjoint it is the same
// cost, also while the head turns between i and j.
TEST(RelativePoseFactor, CameraFormHasTheSameCost) {
  std::mt19937 generator(5);
  const Matrix6d covariance = SomeCovariance();
  for (const Case& c : Cases(0.3)) {
    const Rigid3 T_base_camera_i = RandomRigid3(generator, 0.5);
    const Rigid3 T_base_camera_j = T_base_camera_i * ExpSe3(RandomTangent(generator, 0.4));
    const Rigid3 T_ci_cj = T_base_camera_i.Inverse() * c.T_i_j_measured * T_base_camera_j;
    const Matrix6d adjoint = AdjointSe3(T_base_camera_j.Inverse());

    const Vector6d base = RelativePoseResidual(c.T_map_i, c.T_map_j, c.T_i_j_measured, nullptr, nullptr);
    const Vector6d camera =
        RelativePoseResidual(c.T_map_i * T_base_camera_i, c.T_map_j * T_base_camera_j, T_ci_cj, nullptr, nullptr);
    EXPECT_LT((camera - adjoint * base).norm(), 1e-10);

    const Matrix6d S_base = SquareRootInformation(covariance);
    const Matrix6d S_camera = SquareRootInformation(adjoint * covariance * adjoint.transpose());
    const double cost = (S_base * base).squaredNorm();
    EXPECT_NEAR((S_camera * camera).squaredNorm(), cost, 1e-6 * cost);
  }
}

// What goes wrong without the adjoint: optical axes are not the base's, so drift along x is weighed as drift in height.
TEST(RelativePoseFactor, CameraFormNeedsTheAdjoint) {
  const Rigid3 T_base_camera(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.1, 0.0, 0.9));
  const Rigid3 T_i_j = FromYaw(0.0, 0.5, 0.0);
  const Rigid3 T_map_j = T_i_j * FromYaw(0.0, 0.03, 0.0);
  const Matrix6d S_base = SquareRootInformation(SomeCovariance());
  const Vector6d base = RelativePoseResidual(Rigid3(), T_map_j, T_i_j, nullptr, nullptr);
  const Vector6d camera = RelativePoseResidual(T_base_camera, T_map_j * T_base_camera,
                                               T_base_camera.Inverse() * T_i_j * T_base_camera, nullptr, nullptr);
  EXPECT_GT((S_base * camera).squaredNorm(), 2.0 * (S_base * base).squaredNorm());
}

TEST(RelativePoseFactor, SolverFindsTheMeasuredPoseAgain) {
  const Rigid3 T_map_i = FromYaw(M_PI - 0.05, 3.0, 2.0);
  const Rigid3 T_i_j = FromYaw(0.1, 0.4, 0.02);
  std::mt19937 generator(6);
  for (int trial = 0; trial < 10; ++trial) {
    Block i = ToBlock(T_map_i), j = ToBlock(T_map_i * T_i_j * ExpSe3(RandomTangent(generator, 0.3)));
    PoseManifold manifold;
    ceres::Problem::Options ownership;
    ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(ownership);
    problem.AddResidualBlock(new RelativePoseFactor<6>(T_i_j, SquareRootInformation(SomeCovariance())), nullptr,
                             i.data(), j.data());
    problem.AddResidualBlock(new PlanarPriorFactor({0.01, DegreesToRadians(0.5)}), nullptr, j.data());
    problem.SetManifold(i.data(), &manifold);
    problem.SetManifold(j.data(), &manifold);
    problem.SetParameterBlockConstant(i.data());
    ceres::Solver::Options options;
    options.function_tolerance = 1e-16;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    EXPECT_LT(LogSe3((T_map_i * T_i_j).Inverse() * LoadPose(j.data())).norm(), 1e-7) << summary.BriefReport();
  }
}

}  // namespace
}  // namespace planar_vslam::test
