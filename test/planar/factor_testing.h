#pragma once
// What the factor tests share: poses at the nasty places, and two independent opinions on a factor's Jacobians.
#include <ceres/ceres.h>
#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "planar_vslam/planar/pose_manifold.h"
#include "support/support.h"

namespace planar_vslam::test {

inline Rigid3 FromYaw(double yaw, double x, double y, double z = 0.0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(x, y, z)};
}

inline Vector6d RandomTangent(std::mt19937& generator, double extent) {
  std::uniform_real_distribution<double> uniform(-extent, extent);
  Vector6d xi;
  for (int k = 0; k < 6; ++k) xi[k] = uniform(generator);
  return xi;
}

// Random poses all over SE(3), then headings at and on either side of the +-pi seam.
inline std::vector<Rigid3> NastyPoses() {
  std::mt19937 generator(7);
  std::vector<Rigid3> poses = {Rigid3()};
  for (int k = 0; k < 20; ++k) poses.push_back(RandomRigid3(generator, 5.0));
  for (const double yaw : {M_PI, -M_PI, M_PI - 1e-9, -M_PI + 1e-9, M_PI - 1e-3, -M_PI + 1e-3}) {
    poses.push_back(FromYaw(yaw, 1.0, -2.0));
    poses.push_back(FromYaw(yaw, 0.3, 0.2, 0.1) * ExpSe3(RandomTangent(generator, 0.05)));
  }
  return poses;
}

using Block = std::vector<double>;

inline Block ToBlock(const Rigid3& T) {
  Block block(kPoseBlockSize);
  StorePose(T, block.data());
  return block;
}

struct Evaluation {
  Eigen::VectorXd residuals;
  std::vector<Eigen::MatrixXd> local_jacobians;  // one a pose, residuals x 6
};

// Residuals and Jacobians on the tangent space of a cost function whose blocks are all poses.
inline Evaluation EvaluateLocal(const ceres::CostFunction& cost, const std::vector<Block>& blocks) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, kPoseBlockSize, Eigen::RowMajor>;
  std::vector<RowMajor> ambient(blocks.size(), RowMajor(cost.num_residuals(), kPoseBlockSize));
  std::vector<const double*> parameters;
  std::vector<double*> jacobians;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    parameters.push_back(blocks[k].data());
    jacobians.push_back(ambient[k].data());
  }
  Evaluation result;
  result.residuals.resize(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(parameters.data(), result.residuals.data(), jacobians.data()));
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Eigen::Matrix<double, kPoseBlockSize, 6, Eigen::RowMajor> plus;
    PoseManifold().PlusJacobian(blocks[k].data(), plus.data());
    result.local_jacobians.push_back(ambient[k] * plus);
  }
  return result;
}

inline void ExpectGradientsRight(const ceres::CostFunction& cost, const std::vector<Block>& blocks) {
  const PoseManifold manifold;
  const std::vector<const ceres::Manifold*> manifolds(blocks.size(), &manifold);
  ceres::NumericDiffOptions numeric;
  numeric.ridders_relative_initial_step_size = 1e-3;  // from the default 1e-2 it at times settles 1e-5 off
  const ceres::GradientChecker checker(&cost, &manifolds, numeric);
  std::vector<const double*> parameters;
  for (const Block& block : blocks) parameters.push_back(block.data());
  ceres::GradientChecker::ProbeResults results;
  // Probe's own verdict compares entry by entry, where a zero against a rounding error counts as wrong: whole matrices.
  checker.Probe(parameters.data(), 1.0, &results);
  ASSERT_TRUE(results.return_value);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const double error = (results.local_jacobians[k] - results.local_numeric_jacobians[k]).norm();
    EXPECT_LT(error, 1e-8 * results.local_numeric_jacobians[k].norm()) << "block " << k << "\n" << results.error_log;
  }
}

inline void ExpectTwins(const ceres::CostFunction& analytic, const ceres::CostFunction& automatic,
                        const std::vector<Block>& blocks) {
  const Evaluation a = EvaluateLocal(analytic, blocks);
  const Evaluation b = EvaluateLocal(automatic, blocks);
  EXPECT_LT((a.residuals - b.residuals).norm(), 1e-9 * (1.0 + b.residuals.norm()));
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    EXPECT_LT((a.local_jacobians[k] - b.local_jacobians[k]).norm(), 1e-9 * (1.0 + b.local_jacobians[k].norm()))
        << "block " << k << "\n"
        << a.local_jacobians[k] << "\nautomatic\n"
        << b.local_jacobians[k];
  }
}

}  // namespace planar_vslam::test
