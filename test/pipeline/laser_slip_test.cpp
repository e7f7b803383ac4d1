#include "planar_vslam/pipeline/laser_slip.h"

#include <gtest/gtest.h>

#include <cmath>

#include "localize/floor_plan.h"

namespace planar_vslam {
namespace {

using test::FloorPlan;
using test::Office;

FloorPlan Corridor() { return FloorPlan().Wall(-50, 1, 50, 1).Wall(-50, 3, 50, 3); }

class LaserSlipTest : public ::testing::Test {
 protected:
  // `before`: when the frame before was.
  FramePacket PacketAt(double before, double t, const FloorPlan& plan, const Rigid2& T_world_base) {
    FramePacket packet;
    packet.image.stamp = Timestamp::FromSeconds(t);
    packet.odometry = {{Timestamp::FromSeconds(before), Rigid2()}, {packet.image.stamp, Rigid2()}};
    PlanarScan scan = plan.Sweep(T_world_base, ++sweeps_);
    scan.stamp = packet.image.stamp;
    packet.scans.push_back({std::move(scan), FloorPlan::T_base_laser(), Rigid2()});
    return packet;
  }
  static PlanarMotion StepOf(const Rigid2& T_i_j) {
    PlanarMotion step;
    step.T_i_j = T_i_j;
    step.covariance = Eigen::Vector3d(0.003, 0.003, 0.003).cwiseAbs2().asDiagonal();
    step.distance = T_i_j.translation.norm();
    step.turn = std::abs(T_i_j.angle);
    return step;
  }
  // The step that is made of what the wheels say, where the base truly moved by `truth`.
  std::optional<PlanarMotion> Step(const FloorPlan& plan, const Rigid2& truth, const Rigid2& wheels,
                                   bool blind = true) {
    LaserSlip slip({});
    EXPECT_FALSE(slip.Check(PacketAt(-0.1, 0.0, plan, start_), PlanarMotion{}, blind).has_value()) << "nothing before";
    return slip.Check(PacketAt(0.0, 0.1, plan, start_ * truth), StepOf(wheels), blind);
  }

  const Rigid2 start_{2.2, 1.7, 0.4};
  unsigned sweeps_ = 0;
};

TEST_F(LaserSlipTest, TurnThatTheWheelsMissedIsTheLasers) {
  const Rigid2 truth(0.02, 0.0, 0.07);
  const auto step = Step(Office(), truth, Rigid2(0.02, 0.0, 0.015));
  ASSERT_TRUE(step.has_value());
  EXPECT_NEAR(step->T_i_j.angle, truth.angle, 0.005);
  EXPECT_LT((step->T_i_j.translation - truth.translation).norm(), 0.015);
  EXPECT_LT(std::sqrt(step->covariance(2, 2)), 0.01);
  EXPECT_GE(step->turn, 0.065);
}

TEST_F(LaserSlipTest, WheelsThatSpinOnTheSpotAreStopped) {
  const auto step = Step(Office(), Rigid2(), Rigid2(0.08, 0.0, 0.0));
  ASSERT_TRUE(step.has_value());
  EXPECT_LT(step->T_i_j.translation.norm(), 0.015);
}

TEST_F(LaserSlipTest, WheelsThatAgreeStayAsTheyAre) {
  for (int k = 0; k < 20; ++k) {
    const Rigid2 truth(0.03, 0.001 * k, 0.01 * (k - 10));
    EXPECT_FALSE(Step(Office(), truth, truth * Rigid2(0.003, 0.0, 0.003)).has_value()) << k;
  }
}

TEST_F(LaserSlipTest, AlongACorridorTheWheelsTell) {
  const auto step = Step(Corridor(), Rigid2(0.03, 0.0, 0.06), Rigid2(0.03, 0.0, 0.0));
  ASSERT_TRUE(step.has_value());
  EXPECT_NEAR(step->T_i_j.angle, 0.06, 0.005) << "the walls show the turn";
  const double way = (start_ * step->T_i_j).translation.x() - start_.translation.x();
  EXPECT_NEAR(way, 0.03 * std::cos(start_.angle), 0.01);
}

TEST_F(LaserSlipTest, CameraThatSeesNeedsNoLaser) {
  EXPECT_FALSE(Step(Office(), Rigid2(0.02, 0.0, 0.07), Rigid2(0.02, 0.0, 0.015), false).has_value());
}

TEST_F(LaserSlipTest, OldOrMissingSweepsTellNothing) {
  LaserSlip slip({});
  const Rigid2 truth(0.0, 0.0, 0.07);
  (void)slip.Check(PacketAt(-0.1, 0.0, Office(), start_), PlanarMotion{}, true);
  FramePacket without = PacketAt(0.0, 0.1, Office(), start_);
  without.scans.clear();
  EXPECT_FALSE(slip.Check(without, StepOf({}), true).has_value());
  EXPECT_FALSE(slip.Check(PacketAt(0.1, 0.2, Office(), start_ * truth), StepOf({}), true).has_value());
  FramePacket old = PacketAt(0.2, 0.3, Office(), start_);
  old.scans.back().scan.stamp = Timestamp::FromSeconds(0.1);
  EXPECT_FALSE(slip.Check(old, StepOf({}), true).has_value());
}

TEST_F(LaserSlipTest, SweepsFromBeforeAGapTellNothing) {
  LaserSlip slip({});
  (void)slip.Check(PacketAt(-0.1, 0.0, Office(), start_), PlanarMotion{}, true);
  // Frames in between were not shown to it: the map did not grow, or odometry was missing.
  const FramePacket later = PacketAt(4.9, 5.0, Office(), start_ * Rigid2(0.05, 0.0, 0.1));
  EXPECT_FALSE(slip.Check(later, StepOf({}), true).has_value());
}

TEST_F(LaserSlipTest, LaserThatOnlyDrawsTheMapTellsNothing) {
  ScanMatchOptions options;
  options.enabled = false;
  LaserSlip slip(options);
  (void)slip.Check(PacketAt(-0.1, 0.0, Office(), start_), PlanarMotion{}, true);
  EXPECT_FALSE(slip.Check(PacketAt(0.0, 0.1, Office(), start_ * Rigid2(0.0, 0.0, 0.07)), StepOf({}), true).has_value());
}

}  // namespace
}  // namespace planar_vslam
