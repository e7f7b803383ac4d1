#include "planar_vslam/planar/pose_manifold.h"

#include "factor_testing.h"

namespace planar_vslam::test {
namespace {

using PlusMatrix = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;

Block Plus(const Block& x, const Vector6d& d) {
  Block y(kPoseBlockSize);
  EXPECT_TRUE(PoseManifold().Plus(x.data(), d.data(), y.data()));
  return y;
}

Vector6d Minus(const Block& y, const Block& x) {
  Vector6d d;
  EXPECT_TRUE(PoseManifold().Minus(y.data(), x.data(), d.data()));
  return d;
}

Eigen::Map<const Eigen::Matrix<double, 7, 1>> AsVector(const Block& block) {
  return Eigen::Map<const Eigen::Matrix<double, 7, 1>>(block.data());
}

TEST(PoseManifold, StoresAndLoadsExactly) {
  for (const Rigid3& T : NastyPoses()) {
    const Block block = ToBlock(T);
    EXPECT_EQ(LoadPose(block.data()).translation, T.translation);
    EXPECT_EQ(LoadPose(block.data()).rotation.coeffs(), T.rotation.coeffs());
    EXPECT_EQ(block[0], T.translation.x());
    EXPECT_EQ(block[3], T.rotation.x());
    EXPECT_EQ(block[6], T.rotation.w());
  }
}

TEST(PoseManifold, PlusOfNothingStaysAndMinusOfItselfIsNothing) {
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    EXPECT_LT((AsVector(Plus(x, Vector6d::Zero())) - AsVector(x)).norm(), 1e-14);
    EXPECT_LT(Minus(x, x).norm(), 1e-15);
  }
}

TEST(PoseManifold, MinusUndoesPlusAndPlusUndoesMinus) {
  std::mt19937 generator(1);
  const std::vector<Rigid3> poses = NastyPoses();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Block x = ToBlock(poses[k]);
    const Vector6d d = RandomTangent(generator, 1.5);
    EXPECT_LT((Minus(Plus(x, d), x) - d).norm(), 1e-12);

    const Block y = ToBlock(poses[(k + 5) % poses.size()]);
    const Rigid3 back = LoadPose(Plus(x, Minus(y, x)).data());
    EXPECT_LT(LogSe3(LoadPose(y.data()).Inverse() * back).norm(), 1e-9);
  }
}

TEST(PoseManifold, MinusIgnoresTheSignOfTheQuaternion) {
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    Block flipped = x;
    for (std::size_t k = 3; k < 7; ++k) flipped[k] = -flipped[k];
    EXPECT_LT(Minus(flipped, x).norm(), 1e-15);
  }
}

TEST(PoseManifold, PlusKeepsTheQuaternionUnit) {
  std::mt19937 generator(2);
  Block x = ToBlock(Rigid3());
  for (int k = 0; k < 10000; ++k) x = Plus(x, RandomTangent(generator, 0.5));
  EXPECT_NEAR(LoadPose(x.data()).rotation.norm(), 1.0, 1e-14);
}

TEST(PoseManifold, PlusJacobianMatchesDifferences) {
  constexpr double kStep = 1e-6;
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    PlusMatrix J;
    ASSERT_TRUE(PoseManifold().PlusJacobian(x.data(), J.data()));
    for (int k = 0; k < 6; ++k) {
      const Vector6d d = kStep * Vector6d::Unit(k);
      const Eigen::Matrix<double, 7, 1> column = (AsVector(Plus(x, d)) - AsVector(Plus(x, -d))) / (2.0 * kStep);
      EXPECT_LT((J.col(k) - column).norm(), 1e-8);
    }
  }
}

TEST(PoseManifold, MinusJacobianMatchesDifferences) {
  constexpr double kStep = 1e-6;
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    PoseJacobianMap J;
    ASSERT_TRUE(PoseManifold().MinusJacobian(x.data(), J.data()));
    EXPECT_EQ(J, PoseMinusJacobian(x.data()));
    for (std::size_t k = 0; k < 7; ++k) {
      Block ahead = x, behind = x;
      ahead[k] += kStep;
      behind[k] -= kStep;
      const Vector6d column = (Minus(ahead, x) - Minus(behind, x)) / (2.0 * kStep);
      EXPECT_LT((J.col(static_cast<Eigen::Index>(k)) - column).norm(), 1e-8);
    }
  }
}

TEST(PoseManifold, MinusJacobianUndoesPlusJacobian) {
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    PlusMatrix plus;
    ASSERT_TRUE(PoseManifold().PlusJacobian(x.data(), plus.data()));
    EXPECT_LT((PoseMinusJacobian(x.data()) * plus - Matrix6d::Identity()).norm(), 1e-13);
  }
}

Block FloorPlus(const Block& x, const Eigen::Vector3d& d) {
  Block y(kPoseBlockSize);
  EXPECT_TRUE(FloorPoseManifold().Plus(x.data(), d.data(), y.data()));
  return y;
}

Eigen::Vector3d FloorMinus(const Block& y, const Block& x) {
  Eigen::Vector3d d;
  EXPECT_TRUE(FloorPoseManifold().Minus(y.data(), x.data(), d.data()));
  return d;
}

TEST(FloorPoseManifold, KeepsHeightAndTilt) {
  for (const Rigid3& T : NastyPoses()) {
    const Rigid3 moved = LoadPose(FloorPlus(ToBlock(T), {0.7, -2.0, 2.5}).data());
    EXPECT_EQ(moved.translation.z(), T.translation.z());
    EXPECT_LT((moved.R().row(2) - T.R().row(2)).norm(), 1e-14);
  }
}

TEST(FloorPoseManifold, IsTheGroupOfThePlaneOnTheFloor) {
  for (const double yaw : {0.0, 1.0, M_PI, -M_PI, -M_PI + 1e-9}) {
    const Rigid2 moved = ProjectToPlane(LoadPose(FloorPlus(ToBlock(FromYaw(yaw, 1.0, 2.0)), {0.3, -0.4, 0.5}).data()));
    EXPECT_LT((moved.translation - Eigen::Vector2d(1.3, 1.6)).norm(), 1e-12);
    EXPECT_NEAR(WrapAngle(moved.angle - yaw - 0.5), 0.0, 1e-12);
  }
}

TEST(FloorPoseManifold, MinusUndoesPlus) {
  std::mt19937 generator(1);
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    const Eigen::Vector3d d = RandomTangent(generator, 3.0).head<3>();
    EXPECT_LT((FloorMinus(FloorPlus(x, d), x) - d).norm(), 1e-12);
    EXPECT_LT(FloorMinus(x, x).norm(), 1e-15);
  }
}

TEST(FloorPoseManifold, JacobiansMatchDifferencesAndUndoEachOther) {
  constexpr double kStep = 1e-6;
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    Eigen::Matrix<double, 7, 3, Eigen::RowMajor> plus;
    Eigen::Matrix<double, 3, 7, Eigen::RowMajor> minus;
    ASSERT_TRUE(FloorPoseManifold().PlusJacobian(x.data(), plus.data()));
    ASSERT_TRUE(FloorPoseManifold().MinusJacobian(x.data(), minus.data()));
    EXPECT_LT((minus * plus - Eigen::Matrix3d::Identity()).norm(), 1e-13);
    const Eigen::Matrix<double, 6, 3> E = FloorTangent(T);
    EXPECT_LT((E.transpose() * E - Eigen::Matrix3d::Identity()).norm(), 1e-13);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(k);
      const Block ahead = FloorPlus(x, d), behind = FloorPlus(x, -d);
      EXPECT_LT((plus.col(k) - (AsVector(ahead) - AsVector(behind)) / (2.0 * kStep)).norm(), 1e-8);
      const Vector6d tangent = (Minus(ahead, x) - Minus(behind, x)) / (2.0 * kStep);
      EXPECT_LT((E.col(k) - tangent).norm(), 1e-8);
    }
  }
}

Block LevelPlus(const Block& x, const Eigen::Vector3d& d) {
  Block y(kPoseBlockSize);
  EXPECT_TRUE(LevelPoseManifold().Plus(x.data(), d.data(), y.data()));
  return y;
}

Eigen::Vector3d LevelMinus(const Block& y, const Block& x) {
  Eigen::Vector3d d;
  EXPECT_TRUE(LevelPoseManifold().Minus(y.data(), x.data(), d.data()));
  return d;
}

TEST(LevelPoseManifold, KeepsThePlaceAndTurnsAboutNoVertical) {
  for (const Rigid3& T : NastyPoses()) {
    const Rigid3 moved = LoadPose(LevelPlus(ToBlock(T), {0.7, -0.2, 0.1}).data());
    EXPECT_EQ(moved.translation.head<2>(), T.translation.head<2>());
    EXPECT_NEAR(LogSo3(moved.rotation * T.rotation.conjugate()).z(), 0.0, 1e-14);
  }
}

TEST(LevelPoseManifold, MinusUndoesPlus) {
  std::mt19937 generator(1);
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    const Eigen::Vector3d d = RandomTangent(generator, 1.5).head<3>();
    EXPECT_LT((LevelMinus(LevelPlus(x, d), x) - d).norm(), 1e-12);
    EXPECT_LT(LevelMinus(x, x).norm(), 1e-15);
  }
}

TEST(LevelPoseManifold, JacobiansMatchDifferencesAndUndoEachOther) {
  constexpr double kStep = 1e-6;
  for (const Rigid3& T : NastyPoses()) {
    const Block x = ToBlock(T);
    Eigen::Matrix<double, 7, 3, Eigen::RowMajor> plus;
    Eigen::Matrix<double, 3, 7, Eigen::RowMajor> minus;
    ASSERT_TRUE(LevelPoseManifold().PlusJacobian(x.data(), plus.data()));
    ASSERT_TRUE(LevelPoseManifold().MinusJacobian(x.data(), minus.data()));
    EXPECT_LT((minus * plus - Eigen::Matrix3d::Identity()).norm(), 1e-13);
    // With what moves it on the floor, it is the whole tangent.
    EXPECT_LT((LevelTangent(T).transpose() * FloorTangent(T)).norm(), 1e-13);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(k);
      const Block ahead = LevelPlus(x, d), behind = LevelPlus(x, -d);
      EXPECT_LT((plus.col(k) - (AsVector(ahead) - AsVector(behind)) / (2.0 * kStep)).norm(), 1e-8);
    }
  }
}

}  // namespace
}  // namespace planar_vslam::test
