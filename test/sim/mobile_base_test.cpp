// The base under velocity commands: limits, contacts, kinds.
#include "planar_vslam/sim/mobile_base.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

constexpr double kStep = 0.005;   // s
constexpr double kRadius = 0.25;  // m

// Somewhere in a bare room of 6 x 5 m, with a box in its middle.
class MobileBase : public ::testing::Test {
 protected:
  MobileBase() {
    ObjectSpec box;
    box.at = {3.0, 2.5};
    box.size = {0.8, 0.8};
    world_.objects.push_back(box);
  }
  // The command held for so long.
  void Drive(const VelocityCommand& command, double seconds) {
    const Obstacles obstacles(world_, kRadius);
    for (const double end = time_ + seconds; time_ < end - 1e-9;) {
      time_ += kStep;
      const BaseState last = state_;
      state_ = StepBase(world_.limits, kind_, obstacles, state_, command, time_, kStep);
      const Eigen::Vector3d change = state_.velocity - last.velocity;
      if (!state_.touching)
        fastest_change_ =
            fastest_change_.cwiseMax(Eigen::Vector2d(change.head<2>().norm(), std::abs(change.z())) / kStep);
      fastest_ = fastest_.cwiseMax(state_.velocity.cwiseAbs());
      least_clearance_ = std::min(least_clearance_, obstacles.Clearance(state_.T_world_base.translation, time_));
    }
  }
  const Eigen::Vector2d& at() const { return state_.T_world_base.translation; }

  World world_ = test::BareRoom();
  BaseKind kind_ = BaseKind::kOmnidirectional;
  BaseState state_;
  double time_ = 0.0;
  Eigen::Vector2d fastest_change_ = Eigen::Vector2d::Zero();  // m/s^2 and rad/s^2, of free motion
  Eigen::Vector3d fastest_ = Eigen::Vector3d::Zero();
  double least_clearance_ = std::numeric_limits<double>::infinity();
};

TEST_F(MobileBase, NeitherSpeedsNorAccelerationsPassTheirLimits) {
  state_.T_world_base = Rigid2(1.0, 1.0, 0.3);
  const LimitsSpec& limits = world_.limits;
  for (const VelocityCommand& command : {VelocityCommand{9.0, 0.0, 9.0}, VelocityCommand{-9.0, 3.0, -9.0},
                                         VelocityCommand{0.0, -9.0, 0.0}, VelocityCommand{0.2, 0.1, 0.4}}) {
    Drive(command, 0.9);
  }
  EXPECT_NEAR(fastest_change_[0], limits.acceleration, 1e-6) << "reached and not passed";
  EXPECT_NEAR(fastest_change_[1], limits.turn_acceleration, 1e-6);
  EXPECT_LE(fastest_.x(), limits.speed + 1e-12);
  EXPECT_LE(fastest_.y(), limits.sideways_speed + 1e-12);
  EXPECT_LE(fastest_.z(), limits.turn_rate + 1e-12);
  Drive({0.2, 0.1, 0.4}, 2.0);
  EXPECT_LT((state_.velocity - Eigen::Vector3d(0.2, 0.1, 0.4)).norm(), 1e-12) << "settles at the command";
}

TEST_F(MobileBase, LimitedCommandsKeepTheirDirection) {
  const Eigen::Vector3d within = WithinLimits(world_.limits, BaseKind::kOmnidirectional, {3.0, 1.5, 0.0});
  EXPECT_NEAR(within.y() / within.x(), 0.5, 1e-12);
  EXPECT_LE(within.y(), world_.limits.sideways_speed);
}

TEST_F(MobileBase, StopsClearOfAWallAndCanBackOut) {
  state_.T_world_base = Rigid2(4.5, 1.0, 0.0);
  Drive({0.5, 0.0, 0.0}, 6.0);
  EXPECT_GT(least_clearance_, 0.0);
  EXPECT_LT(least_clearance_, 0.006) << "it got as far as the wall";
  EXPECT_TRUE(state_.touching);
  EXPECT_EQ(state_.collisions, 1) << "one contact, however long it pushes";
  EXPECT_EQ(state_.velocity.x(), 0.0);
  Drive({0.0, 0.0, 1.0}, 2.0);
  EXPECT_GT(state_.T_world_base.angle, 1.0) << "it can turn where it is";
  Drive({0.0, 0.0, -1.0}, 3.0);
  const double before = at().x();
  Drive({-0.3, 0.0, 0.0}, 2.0);
  EXPECT_LT(at().x(), before - 0.3);
  EXPECT_FALSE(state_.touching);
  EXPECT_EQ(state_.collisions, 1);
  Drive({0.5, 0.0, 0.0}, 4.0);
  EXPECT_EQ(state_.collisions, 2) << "another visit";
}

TEST_F(MobileBase, StopsClearOfABoxFromEverySide) {
  for (int i = 0; i < 12; ++i) {
    const double angle = i * M_PI / 6.0;
    state_ = {};
    state_.T_world_base = Rigid2(3.0 + 1.6 * std::cos(angle), 2.5 + 1.6 * std::sin(angle), angle + M_PI);
    least_clearance_ = std::numeric_limits<double>::infinity();
    Drive({0.5, 0.0, 0.0}, 5.0);
    EXPECT_EQ(state_.collisions, 1) << angle;
    EXPECT_GT(least_clearance_, 0.0) << angle;
    EXPECT_LT(least_clearance_, 0.006) << angle;
  }
}

TEST_F(MobileBase, ADifferentialBaseCannotMoveSideways) {
  kind_ = BaseKind::kDifferential;
  state_.T_world_base = Rigid2(1.0, 1.0, 0.7);
  Drive({0.0, 0.3, 0.0}, 2.0);
  EXPECT_EQ(at(), Eigen::Vector2d(1.0, 1.0));
  EXPECT_EQ(state_.velocity, Eigen::Vector3d::Zero());
  Drive({0.2, 0.3, 0.5}, 1.0);
  EXPECT_EQ(state_.velocity.y(), 0.0);
  EXPECT_GT((at() - Eigen::Vector2d(1.0, 1.0)).norm(), 0.05);
}

TEST_F(MobileBase, SomebodyWalksIntoItAndItCanLeave) {
  world_.people.push_back({{{1.0, 1.0}, {5.0, 1.0}}, 0.8, 0.0, 1.75});
  state_.T_world_base = Rigid2(3.0, 1.0, M_PI_2);
  Drive({}, 2.4);
  EXPECT_EQ(state_.bumps, 1);
  EXPECT_EQ(state_.collisions, 0) << "it stood";
  EXPECT_LT(least_clearance_, 0.0);
  Drive({0.0, -0.35, 0.0}, 4.0);
  EXPECT_GT(at().x(), 3.2) << "away from those it touched";
}

TEST_F(MobileBase, SomebodyWalksIntoItFromBehindWhileItMoves) {
  world_.people.push_back({{{1.0, 1.0}, {5.0, 1.0}}, 0.8, 0.0, 1.75});
  state_.T_world_base = Rigid2(2.5, 1.0, 0.0);
  Drive({0.2, 0.0, 0.0}, 4.0);
  EXPECT_EQ(state_.caught, 1) << "once, though they walk through it";
  EXPECT_EQ(state_.collisions, 0) << "it drove away from them";
  EXPECT_EQ(state_.bumps, 0);
}

TEST_F(MobileBase, WhoStoppedJustNowIsCaught) {
  world_.people.push_back({{{1.0, 1.0}, {5.0, 1.0}}, 0.8, 0.0, 1.75});
  state_.T_world_base = Rigid2(3.0, 0.6, M_PI_2);
  Drive({0.1, 0.0, 0.0}, 1.3);
  Drive({}, 2.0);
  EXPECT_EQ(state_.caught, 1);
  EXPECT_EQ(state_.bumps + state_.collisions, 0);
}

TEST_F(MobileBase, DoesNotFallOffTheSideOfARamp) {
  ObjectSpec ramp;
  ramp.kind = ObjectKind::kRamp;
  ramp.at = {3.0, 1.0};
  ramp.size = {4.0, 1.2};
  ramp.height = 0.15;
  ramp.plateau = 1.0;
  world_.objects.push_back(ramp);
  state_.T_world_base = Rigid2(3.0, 1.0, M_PI_2);
  Drive({0.3, 0.0, 0.0}, 4.0);
  EXPECT_TRUE(state_.touching);
  EXPECT_LT(at().y(), 1.6);
  EXPECT_FALSE(Obstacles(world_, kRadius).Falls(state_.T_world_base));
  Drive({-0.3, 0.0, 0.0}, 1.0);
  EXPECT_LT(at().y(), 1.4);
}

}  // namespace
}  // namespace planar_vslam
