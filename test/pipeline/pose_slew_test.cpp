#include "planar_vslam/pipeline/pose_slew.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"

namespace planar_vslam {
namespace {

constexpr double kPeriod = 0.1;       // s
const Rigid2 kStep(0.04, 0.0, 0.02);  // of odometry, in a period

Timestamp At(int frame) { return Timestamp{frame * 100'000'000LL}; }

PoseSlew::Pose Estimate(const Rigid2& T_map_base) { return {Embed3(T_map_base), 1e-6 * Matrix6d::Identity()}; }

// Frames of a drive whose estimate is corrected by `correction` before the fifth.
std::vector<PoseSlew::Published> Drive(const Rigid2& correction, int frames) {
  PoseSlew slew;
  std::vector<PoseSlew::Published> published;
  Rigid2 T_map_base;
  for (int frame = 0; frame < frames; ++frame) {
    if (frame > 0) T_map_base = T_map_base * kStep;
    if (frame == 5) T_map_base = T_map_base * correction;
    published.push_back(slew.Publish(Estimate(T_map_base), kStep, At(frame)));
  }
  return published;
}

Rigid2 CorrectionAt(const std::vector<PoseSlew::Published>& poses, std::size_t frame) {
  return (ProjectToPlane(poses[frame - 1].T_map_base) * kStep).Inverse() * ProjectToPlane(poses[frame].T_map_base);
}

TEST(PoseSlew, ACorrectionIsPaidInSmallSteps) {
  const std::vector<PoseSlew::Published> poses = Drive(Rigid2(0.05, -0.12, DegreesToRadians(4.0)), 20);
  for (std::size_t frame = 1; frame < poses.size(); ++frame) {
    EXPECT_FALSE(poses[frame].jumped);
    const Rigid2 step = CorrectionAt(poses, frame);
    EXPECT_LE(step.translation.norm(), 0.02 * kPeriod / 0.05);
    EXPECT_LE(std::abs(step.angle), DegreesToRadians(1.0) * kPeriod / 0.05);
  }
  EXPECT_GT(CorrectionAt(poses, 5).translation.norm(), 0.0);
  EXPECT_LT(CorrectionAt(poses, 15).translation.norm(), 1e-9) << "paid by then";
}

TEST(PoseSlew, TheCovarianceAdmitsWhatIsOwed) {
  const Rigid2 correction(0.05, -0.12, DegreesToRadians(4.0));
  const std::vector<PoseSlew::Published> poses = Drive(correction, 20);
  Rigid2 T_map_base;
  for (int frame = 1; frame <= 5; ++frame) T_map_base = T_map_base * kStep;
  T_map_base = T_map_base * correction;
  const Eigen::Vector3d owed = LogSe2(ProjectToPlane(poses[5].T_map_base).Inverse() * T_map_base);
  ASSERT_GT(owed.norm(), 0.05);
  const Eigen::Matrix3d covariance = poses[5].covariance(kPlanarRows, kPlanarRows);
  EXPECT_LE(owed.dot(covariance.ldlt().solve(owed)), 1.0 + 1e-6);
  EXPECT_NEAR(poses[19].covariance.trace(), 6e-6, 1e-12);
}

TEST(PoseSlew, ALargeCorrectionIsOneJump) {
  for (const Rigid2& correction : {Rigid2(0.5, 0.0, 0.0), Rigid2(0.0, 0.0, DegreesToRadians(15.0))}) {
    const std::vector<PoseSlew::Published> poses = Drive(correction, 8);
    EXPECT_TRUE(poses[5].jumped);
    EXPECT_LT((CorrectionAt(poses, 5).Inverse() * correction).translation.norm(), 1e-9);
    EXPECT_FALSE(poses[6].jumped);
  }
}

TEST(PoseSlew, AFirstPoseIsNoJump) {
  PoseSlew slew;
  EXPECT_FALSE(slew.Publish(Estimate(Rigid2(3.0, 0.0, 1.0)), kStep, At(0)).jumped);
  slew.Forget();
  const PoseSlew::Published after = slew.Publish(Estimate(Rigid2(-3.0, 0.0, 2.0)), kStep, At(1));
  EXPECT_FALSE(after.jumped);
  EXPECT_NEAR(after.T_map_base.translation.x(), -3.0, 1e-12);
}

TEST(PoseSlew, HeightAndTiltAreTheEstimates) {
  PoseSlew slew;
  PoseSlew::Pose estimate = Estimate(Rigid2());
  (void)slew.Publish(estimate, kStep, At(0));
  estimate.T_map_base = Embed3(Rigid2(0.1, 0.05, 0.05));
  estimate.T_map_base.translation.z() = 0.07;
  const PoseSlew::Published published = slew.Publish(estimate, kStep, At(1));
  EXPECT_NEAR(published.T_map_base.translation.z(), 0.07, 1e-12);
  EXPECT_LT(published.T_map_base.translation.x(), 0.1);
}

}  // namespace
}  // namespace planar_vslam
