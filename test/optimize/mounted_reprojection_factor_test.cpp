#include "planar_vslam/optimize/mounted_reprojection_factor.h"

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "planar_vslam/planar/pose_manifold.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

const CameraModel kCamera{640, 480, 500.0, 510.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0, 0.0};
const Rigid3 kT_base_camera(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.1, 0.02, 1.1));

struct Scene {
  Rigid3 T_map_base;
  Vector6d mount;
  Eigen::Vector3d p_map;
  Eigen::Vector2d pixel;  // where the mounted camera sees the point
};

Scene RandomScene(std::mt19937& generator, double yaw) {
  Scene scene;
  const Rigid3 random = RandomRigid3(generator, 2.0);
  scene.T_map_base = {Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::Quaterniond::Identity(),
                      random.translation};
  scene.mount = LogSe3(RandomRigid3(generator, 0.1)) * 0.05;
  const Eigen::Vector3d p_camera = Eigen::Vector3d(0.3, -0.2, 3.0) + 0.3 * RandomRigid3(generator, 1.0).translation;
  scene.p_map = scene.T_map_base * Mounted(scene.mount, kT_base_camera) * p_camera;
  scene.pixel = kCamera.ProjectUndistorted(p_camera);
  return scene;
}

TEST(MountedReprojectionFactor, ZeroAtTruthAndGradientsRight) {
  std::mt19937 generator(2);
  const PoseManifold pose;
  const ceres::EuclideanManifold<3> point;
  const ceres::EuclideanManifold<6> mount;
  const std::vector<const ceres::Manifold*> manifolds{&pose, &point, &mount};
  for (const double yaw : {0.0, 1.0, M_PI, -M_PI, M_PI - 1e-9, -2.0}) {
    for (int round = 0; round < 5; ++round) {
      Scene scene = RandomScene(generator, yaw);
      const MountedReprojectionFactor factor(scene.pixel, kT_base_camera, kCamera, 1.3);
      std::array<double, kPoseBlockSize> block{};
      StorePose(scene.T_map_base, block.data());
      const double* parameters[] = {block.data(), scene.p_map.data(), scene.mount.data()};
      Eigen::Vector2d residual;
      ASSERT_TRUE(factor.Evaluate(parameters, residual.data(), nullptr));
      EXPECT_LT(residual.norm(), 1e-9);
      scene.p_map += Eigen::Vector3d(0.05, -0.03, 0.1);
      ceres::NumericDiffOptions numeric;
      numeric.ridders_relative_initial_step_size = 1e-3;
      ceres::GradientChecker::ProbeResults results;
      ceres::GradientChecker(&factor, &manifolds, numeric).Probe(parameters, 1.0, &results);
      for (std::size_t k = 0; k < 3; ++k) {
        const double error = (results.local_jacobians[k] - results.local_numeric_jacobians[k]).norm();
        EXPECT_LT(error, 1e-7 * results.local_numeric_jacobians[k].norm()) << "block " << k << " yaw " << yaw;
      }
    }
  }
}

TEST(MountedReprojectionFactor, PointsBehindTheCameraSayNothing) {
  const MountedReprojectionFactor factor({320.0, 240.0}, kT_base_camera, kCamera, 1.0);
  std::array<double, kPoseBlockSize> block{};
  StorePose(Rigid3(), block.data());
  const Eigen::Vector3d behind(-2.0, 0.0, 1.0);
  const Vector6d mount = Vector6d::Zero();
  const double* parameters[] = {block.data(), behind.data(), mount.data()};
  Eigen::Vector2d residual(1.0, 1.0);
  ASSERT_TRUE(factor.Evaluate(parameters, residual.data(), nullptr));
  EXPECT_EQ(residual, Eigen::Vector2d::Zero());
}

}  // namespace
}  // namespace planar_vslam::test
