#include "planar_vslam/sim/live_simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "planar_vslam/sim/simulation.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

LiveSimulation Small(const LiveOptions& options = {}) {
  return LiveSimulation::Create(*ParseWorld(test::SmallWorldYaml(), "small.yaml"), options).value();
}

LiveOptions Blind() {
  LiveOptions options;
  options.render = false;
  return options;
}

// Steps until `seconds`, commanding every 0.1 s what `command(time)` says; everything measured on the way.
template <class Command>
std::vector<SimulatedEvent> Drive(LiveSimulation& simulation, double seconds, const Command& command) {
  constexpr int kEvery = 20;  // steps
  std::vector<SimulatedEvent> events;
  for (int step = 0; simulation.now() < seconds - 1e-9; ++step) {
    if (step % kEvery == 0) {
      if (const std::optional<VelocityCommand> wanted = command(simulation.now())) simulation.Command(*wanted);
    }
    simulation.Step();
    while (auto event = simulation.Next()) events.push_back(std::move(*event));
  }
  return events;
}
std::optional<VelocityCommand> Ahead(double /*time*/) { return VelocityCommand{0.3, 0.0, 0.2}; }

// Everything in an event, as bytes would show it.
void ExpectSame(const SimulatedEvent& a, const SimulatedEvent& b) {
  ASSERT_EQ(a.measurement.index(), b.measurement.index());
  ASSERT_EQ(StampOf(a), StampOf(b));
  EXPECT_EQ(a.T_world_base.translation, b.T_world_base.translation);
  if (const auto* frame = std::get_if<CameraFrame>(&a.measurement)) {
    EXPECT_TRUE(*frame->image.image.pixels == *std::get<CameraFrame>(b.measurement).image.image.pixels);
  } else if (const auto* sweep = std::get_if<LaserFrame>(&a.measurement)) {
    EXPECT_TRUE(sweep->scan.ranges == std::get<LaserFrame>(b.measurement).scan.ranges);
  } else {
    EXPECT_EQ(std::get<OdometryReading>(a.measurement).T_odom_base.translation,
              std::get<OdometryReading>(b.measurement).T_odom_base.translation);
  }
}

TEST(LiveSimulation, EventsComeInOrderAtTheirRates) {
  LiveSimulation simulation = Small(Blind());
  std::map<std::size_t, int> counts;
  Timestamp last{-1};
  for (const SimulatedEvent& event : Drive(simulation, 1.05, Ahead)) {
    EXPECT_LE(last, StampOf(event));
    last = StampOf(event);
    ++counts[event.measurement.index()];
  }
  EXPECT_EQ(counts[0], 11);
  EXPECT_EQ(counts[1], 53) << "0, 0.02, ..., 1.04";
  EXPECT_EQ(counts[2], 6);
}

TEST(LiveSimulation, SameCommandsSameBytes) {
  LiveSimulation a = Small(), b = Small();
  const auto first = Drive(a, 0.6, Ahead), again = Drive(b, 0.6, Ahead);
  ASSERT_EQ(first.size(), again.size());
  for (std::size_t i = 0; i < first.size(); ++i) ExpectSame(first[i], again[i]);
  LiveOptions other_seed = Blind();
  other_seed.seed = 2;
  LiveSimulation c = Small(other_seed);
  const auto other = Drive(c, 0.6, Ahead);
  const auto& a_last = std::get<OdometryReading>(first[first.size() - 2].measurement);
  const auto& c_last = std::get<OdometryReading>(other[other.size() - 2].measurement);
  EXPECT_NE(a_last.T_odom_base.translation, c_last.T_odom_base.translation);
}

TEST(LiveSimulation, FollowingTheDriveIsTheRecordedSimulation) {
  const World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  LiveOptions options;
  options.follow_drive = true;
  LiveSimulation live = LiveSimulation::Create(world, options).value();
  Simulation recorded = Simulation::Create(world, {}).value();
  for (const SimulatedEvent& event : Drive(live, 0.5, Ahead)) {
    const std::optional<SimulatedEvent> expected = recorded.Next();
    ASSERT_TRUE(expected.has_value());
    ExpectSame(event, *expected);
  }
}

TEST(LiveSimulation, ObeysCommandsAfterItsDrive) {
  World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  world.odometry = {};  // measures exactly
  LiveOptions options = Blind();
  options.follow_drive = true;
  const Rigid2 end = PlanDrive(world)->At(1e9);
  LiveSimulation robot = LiveSimulation::Create(world, options).value();
  Drive(robot, PlanDrive(world)->duration() + 1.0, Ahead);
  EXPECT_FALSE(robot.drive_is_over()) << "sensors still look back";
  EXPECT_EQ(robot.base().T_world_base.translation, end.translation);
  while (!robot.drive_is_over()) Drive(robot, robot.now() + 0.1, [](double) { return std::nullopt; });
  EXPECT_NEAR((robot.base().T_world_base.translation - end.translation).norm(), 0.0, 1e-6);
  const double over = robot.now();
  Rigid2 last = end;
  double stamp = 0.0;
  for (const SimulatedEvent& event : Drive(robot, over + 2.0, Ahead)) {
    EXPECT_GE(StampOf(event).Seconds(), stamp);
    stamp = StampOf(event).Seconds();
    const Rigid2 now = ProjectToPlane(event.T_world_base);
    EXPECT_LT((now.translation - last.translation).norm(), 0.02) << "no jump";
    last = now;
  }
  EXPECT_GT((robot.base().T_world_base.translation - end.translation).norm(), 0.3);
}

TEST(LiveSimulation, OdometryGoesOnWhereTheDriveEnded) {
  World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  LiveOptions options = Blind();
  options.follow_drive = true;
  LiveSimulation robot = LiveSimulation::Create(world, options).value();
  std::optional<Rigid2> last;
  for (const SimulatedEvent& event : Drive(robot, PlanDrive(world)->duration() + 5.0, Ahead)) {
    const auto* reading = std::get_if<OdometryReading>(&event.measurement);
    if (reading == nullptr) continue;
    if (last.has_value()) {
      EXPECT_LT((reading->T_odom_base.translation - last->translation).norm(), 0.02);
    }
    last = reading->T_odom_base;
  }
  EXPECT_TRUE(robot.drive_is_over());
}

TEST(LiveSimulation, WheelsDoNotTurnWhileTheRobotIsCarried) {
  LiveSimulation robot = Small(Blind());
  std::vector<SimulatedEvent> events = Drive(robot, 1.0, Ahead);
  const Rigid2 there(2.0, 2.0, 2.5);
  EXPECT_NE(robot.Carry(Rigid2(0.1, 2.0, 0.0)).value().message.find("touch a wall"), std::string::npos);
  EXPECT_NE(robot.Carry(Rigid2(std::nan(""), 2.0, 0.0)).value().message.find("finite"), std::string::npos);
  ASSERT_FALSE(robot.Carry(there).has_value());
  EXPECT_EQ(robot.base().T_world_base.translation, there.translation);
  for (SimulatedEvent& event : Drive(robot, 2.0, Ahead)) events.push_back(std::move(event));
  std::optional<Rigid2> odometry, truth;
  double carried = 0.0;
  for (const SimulatedEvent& event : events) {
    const Rigid2 now = ProjectToPlane(event.T_world_base);
    if (truth.has_value()) carried = std::max(carried, (now.translation - truth->translation).norm());
    truth = now;
    const auto* reading = std::get_if<OdometryReading>(&event.measurement);
    if (reading == nullptr) continue;
    if (odometry.has_value()) {
      EXPECT_LT((reading->T_odom_base.translation - odometry->translation).norm(), 0.02);
    }
    odometry = reading->T_odom_base;
  }
  EXPECT_GT(carried, 0.3) << "the truth jumps";
  EXPECT_LT((truth->translation - there.translation).norm(), 0.4) << "and goes on from there";
}

TEST(LiveSimulation, IsNotCarriedWhileItFollowsADrive) {
  LiveOptions options = Blind();
  options.follow_drive = true;
  LiveSimulation robot = Small(options);
  EXPECT_NE(robot.Carry(Rigid2(2.0, 2.0, 0.0)).value().message.find("follows its drive"), std::string::npos);
}

TEST(LiveSimulation, ACoveredCameraSeesNothing) {
  LiveSimulation robot = Small();
  const auto brightest = [&robot](double until) {
    int most = 0;
    for (const SimulatedEvent& event : Drive(robot, until, Ahead)) {
      const auto* frame = std::get_if<CameraFrame>(&event.measurement);
      if (frame == nullptr) continue;
      for (const std::uint8_t pixel : *frame->image.image.pixels) most = std::max(most, int{pixel});
    }
    return most;
  };
  EXPECT_GT(brightest(0.25), 100);
  robot.CoverCamera(0.5);
  EXPECT_LT(brightest(0.7), 60) << "noise";
  EXPECT_GT(brightest(1.2), 100);
}

TEST(LiveSimulation, SilenceStopsTheRobotWithinItsLimits) {
  LiveSimulation simulation = Small(Blind());
  constexpr double kCommanded = 2.0;  // s; the last command comes at 1.9
  const auto until_silence = [](double time) -> std::optional<VelocityCommand> {
    if (time > kCommanded - 0.05) return std::nullopt;
    return VelocityCommand{0.4, 0.0, 0.0};
  };
  Drive(simulation, kCommanded, until_silence);
  EXPECT_NEAR(simulation.base().velocity.x(), 0.4, 1e-9);
  Drive(simulation, 2.39, until_silence);
  EXPECT_NEAR(simulation.base().velocity.x(), 0.4, 1e-9) << "0.5 s have not passed";
  double last = 0.4;
  for (double time = 2.41; time < 3.6; time += 0.1) {
    Drive(simulation, time, until_silence);
    const double speed = simulation.base().velocity.x();
    EXPECT_LE(last - speed, simulation.world().limits.acceleration * 0.1 + 1e-9);
    last = speed;
  }
  EXPECT_EQ(last, 0.0);
}

TEST(LiveSimulation, ACommandThatIsNoNumberStopsTheRobot) {
  LiveSimulation simulation = Small(Blind());
  Drive(simulation, 1.0, Ahead);
  const Rigid2 before = simulation.base().T_world_base;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Drive(simulation, 2.5, [nan](double) { return VelocityCommand{0.3, nan, 0.0}; });
  EXPECT_EQ(simulation.base().velocity, Eigen::Vector3d::Zero());
  EXPECT_LT((simulation.base().T_world_base.translation - before.translation).norm(), 0.2);
}

TEST(LiveSimulation, TruthIsWhereTheBaseWas) {
  LiveSimulation simulation = Small(Blind());
  std::map<std::int64_t, Rigid2> poses = {{0, simulation.base().T_world_base}};
  for (int step = 0; step < 200; ++step) {
    simulation.Command({0.3, 0.1, 0.4});
    simulation.Step();
    poses[Timestamp::FromSeconds(simulation.now()).nanoseconds] = simulation.base().T_world_base;
    while (const auto event = simulation.Next()) {
      const Rigid2& expected = poses.at(StampOf(*event).nanoseconds);
      EXPECT_LT((event->T_world_base.translation.head<2>() - expected.translation).norm(), 1e-9);
    }
  }
}

TEST(LiveSimulation, StartsWhereItIsToldAndOnlyOnFreeFloor) {
  const World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  LiveOptions options = Blind();
  options.start = Rigid2(2.0, 2.0, 1.0);
  EXPECT_EQ(LiveSimulation::Create(world, options)->base().T_world_base.translation, Eigen::Vector2d(2.0, 2.0));
  options.start = Rigid2(4.2, 3.0, 0.0);
  EXPECT_NE(LiveSimulation::Create(world, options).error().message.find("touches objects[0], a box"),
            std::string::npos);
  options.start = Rigid2(0.1, 2.0, 0.0);
  EXPECT_NE(LiveSimulation::Create(world, options).error().message.find("touches a wall"), std::string::npos);
  options.follow_drive = true;
  EXPECT_FALSE(LiveSimulation::Create(world, options).ok());
}

TEST(LiveSimulation, RefusesKidnapsWithoutADriveToFollow) {
  World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  world.events.kidnaps = {{1.0, 1.0}};
  EXPECT_NE(LiveSimulation::Create(world, Blind()).error().message.find("events.kidnaps"), std::string::npos);
  LiveOptions following = Blind();
  following.follow_drive = true;
  EXPECT_TRUE(LiveSimulation::Create(world, following).ok());
}

}  // namespace
}  // namespace planar_vslam
