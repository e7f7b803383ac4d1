// What goes wrong with the robot: slips, kidnapping, blackouts, late stamps, play in the neck.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "planar_vslam/sim/simulation.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

World QuietWorld() {
  World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  world.odometry = OdometrySpec();
  world.camera.shake = 0.0;
  world.drive.shuffle = 0.0;
  return world;
}

std::vector<SimulatedEvent> RunWithoutImages(const World& world, std::uint64_t seed = 1) {
  SimulationOptions options;
  options.render = false;
  options.seed = seed;
  Simulation simulation = Simulation::Create(world, options).value();
  std::vector<SimulatedEvent> events;
  while (auto event = simulation.Next()) events.push_back(std::move(*event));
  return events;
}

struct OdometryAndTruth {
  double time;
  Rigid2 T_odom_base;
  Rigid3 T_world_base;
};
std::vector<OdometryAndTruth> OdometryOf(const std::vector<SimulatedEvent>& events) {
  std::vector<OdometryAndTruth> readings;
  for (const SimulatedEvent& event : events) {
    if (const auto* reading = std::get_if<OdometryReading>(&event.measurement))
      readings.push_back({reading->stamp.Seconds(), reading->T_odom_base, event.T_world_base});
  }
  return readings;
}

TEST(Events, OdometryIntegratesToTruthWithoutErrors) {
  World world = QuietWorld();
  world.drive.shuffle = 0.2;
  const auto readings = OdometryOf(RunWithoutImages(world));
  for (const OdometryAndTruth& reading : readings) {
    const Rigid2 truth = world.drive.start.Inverse() * ProjectToPlane(reading.T_world_base);
    EXPECT_LT((truth.translation - reading.T_odom_base.translation).norm(), 1e-8);
    EXPECT_LT(std::abs(WrapAngle(truth.angle - reading.T_odom_base.angle)), 1e-8);
  }
}

TEST(Events, WheelsTurnByTheFactorDuringASlip) {
  World world = QuietWorld();
  world.events.slips = {{3.0, 1.0, 2.5}};
  const auto readings = OdometryOf(RunWithoutImages(world));
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const double wheels = (readings[i].T_odom_base.translation - readings[i - 1].T_odom_base.translation).norm();
    const double truth = (readings[i].T_world_base.translation - readings[i - 1].T_world_base.translation).norm();
    const bool slipping = readings[i].time > 3.01 && readings[i].time < 3.99;
    const bool rolling = readings[i].time < 2.99 || readings[i].time > 4.03;
    if (slipping || rolling) {
      EXPECT_NEAR(wheels, (slipping ? 2.5 : 1.0) * truth, 1e-5) << readings[i].time;
    }
  }
}

TEST(Events, RandomSlipsComeAtTheirRateAndFollowTheSeed) {
  RandomSlipSpec spec;
  EXPECT_TRUE(DrawSlips(spec, 1000.0, 1).empty());
  spec.rate = 3.0;
  const std::vector<SlipSpec> slips = DrawSlips(spec, 60000.0, 1), others = DrawSlips(spec, 60000.0, 2);
  const double expected = 60000.0 / (20.0 + 0.75);
  EXPECT_NEAR(static_cast<double>(slips.size()), expected, 4.0 * std::sqrt(expected));
  EXPECT_NE(slips[0].at, others[0].at);
  for (const SlipSpec& slip : slips) {
    EXPECT_TRUE(slip.duration >= 0.3 && slip.duration <= 1.2);
    EXPECT_TRUE(slip.factor <= 0.8 || (slip.factor >= 1.2 && slip.factor <= 2.5)) << slip.factor;
  }
}

TEST(Events, WheelsDoNotTurnWhileSomebodyCarriesTheRobot) {
  World world = QuietWorld();
  world.events.kidnaps = {{2.5, 2.0}};
  const auto readings = OdometryOf(RunWithoutImages(world));
  const double whole = PlanDrive(world)->duration();
  EXPECT_NEAR(readings.back().time, whole - 2.0, 0.03);
  double longest_truth = 0.0, longest_wheels = 0.0;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    longest_truth = std::max(longest_truth,
                             (readings[i].T_world_base.translation - readings[i - 1].T_world_base.translation).norm());
    longest_wheels = std::max(longest_wheels,
                              (readings[i].T_odom_base.translation - readings[i - 1].T_odom_base.translation).norm());
  }
  EXPECT_GT(longest_truth, 0.4) << "two seconds of the drive at once";
  EXPECT_LT(longest_wheels, 0.01);
}

// Images and where the camera truly was.
std::vector<SimulatedEvent> Images(const World& world, double until, bool render = true) {
  SimulationOptions options;
  options.until = until;
  options.render = render;
  Simulation simulation = Simulation::Create(world, options).value();
  std::vector<SimulatedEvent> images;
  while (auto event = simulation.Next()) {
    if (std::holds_alternative<CameraFrame>(event->measurement)) images.push_back(std::move(*event));
  }
  return images;
}
double Mean(const SimulatedEvent& event) {
  const auto& pixels = *std::get<CameraFrame>(event.measurement).image.image.pixels;
  return std::accumulate(pixels.begin(), pixels.end(), 0.0) / static_cast<double>(pixels.size());
}

TEST(Events, TheCameraSeesNothingInABlackout) {
  World world = QuietWorld();
  world.events.blackouts = {{0.25, 0.3}};
  const auto images = Images(world, 0.85);
  for (const SimulatedEvent& image : images) {
    const double time = StampOf(image).Seconds();
    const bool black = time >= 0.25 && time < 0.55;
    EXPECT_EQ(Mean(image) < 5.0, black) << time;
  }
}

TEST(Events, SomebodyInFrontOfTheRobotIsSeenByCameraAndLaser) {
  World world = QuietWorld();
  world.drive.start = Rigid2(2.0, 2.0, 0.0);
  world.drive.waypoints = {{2.5, 2.0}};
  const auto nearest_ahead = [](const World& w) {
    double nearest = 10.0;
    for (const SimulatedEvent& event : RunWithoutImages(w)) {
      const auto* frame = std::get_if<LaserFrame>(&event.measurement);
      if (frame == nullptr || frame->scan.stamp.Seconds() > 0.9) continue;
      for (std::size_t i = 240; i <= 300; ++i) nearest = std::min(nearest, double{frame->scan.ranges[i]});
    }
    return nearest;
  };
  const auto free_view = Images(world, 0.55);
  EXPECT_GT(nearest_ahead(world), 1.5);
  world.events.occlusions = {{0.0, 1.0}};
  EXPECT_NEAR(nearest_ahead(world), 0.7, 0.15);
  const auto occluded = Images(world, 0.55);
  const auto& a = *std::get<CameraFrame>(free_view.back().measurement).image.image.pixels;
  const auto& b = *std::get<CameraFrame>(occluded.back().measurement).image.image.pixels;
  int changed = 0;
  for (std::size_t i = 0; i < a.size(); ++i) changed += std::abs(a[i] - b[i]) > 25 ? 1 : 0;
  EXPECT_GT(changed, static_cast<int>(a.size()) / 10);
}

TEST(Events, LateStampsShowAnEarlierWorld) {
  World world = QuietWorld();
  const auto timely = Images(world, 5.0, false);
  world.camera.time_offset = 0.1;
  const auto late = Images(world, 5.0, false);
  for (std::size_t i = 1; i < late.size(); ++i) {
    EXPECT_EQ(StampOf(late[i]).nanoseconds, StampOf(timely[i]).nanoseconds);
    EXPECT_LT((late[i].T_world_camera.translation - timely[i - 1].T_world_camera.translation).norm(), 1e-9);
    EXPECT_LT((late[i].T_world_base.translation - timely[i].T_world_base.translation).norm(), 1e-9);
  }
}

TEST(Head, TurnsTheCameraAboutTheNeck) {
  HeadSpec head;
  head.motion = {{0.0, 0.0, 0.0}, {2.0, 0.5, 0.0}, {4.0, 0.5, 0.3}};
  const CameraSpec camera;
  const Head moving(head, camera);
  const auto axis = [&](double time) { return moving.TrueCamera(time).rotation * Eigen::Vector3d::UnitZ(); };
  EXPECT_NEAR(std::atan2(axis(2.0).y(), axis(2.0).x()), 0.5, 1e-9) << "to the left";
  EXPECT_NEAR(std::asin(-axis(9.0).z()), camera.tilt_down + 0.3, 1e-9) << "down";
  const Eigen::Vector3d arm = camera.position - head.neck;
  EXPECT_NEAR((moving.TrueCamera(3.0).translation - head.neck).norm(), arm.norm(), 1e-9);
  EXPECT_EQ(moving.TrueCamera(1.3).translation, moving.ReportedCamera(1.3).translation) << "no play";
}

TEST(Head, PlayKeepsTheCameraBehindWhatIsReported) {
  HeadSpec head;
  head.motion = {{0.0, 0.0, 0.0}, {2.0, 0.5, 0.0}, {4.0, 0.0, 0.0}};
  head.backlash = 0.02;
  const Head moving(head, CameraSpec());
  const auto behind = [&](double time) {
    return LogSo3(moving.ReportedCamera(time).rotation * moving.TrueCamera(time).rotation.conjugate()).z();
  };
  EXPECT_NEAR(behind(1.0), 0.01, 1e-6) << "on the way out";
  EXPECT_NEAR(behind(3.0), -0.01, 1e-6) << "on the way back";
  EXPECT_NEAR(behind(0.0), 0.0, 1e-9);
}

TEST(LaserSensor, PeppersSectorsLeaveGaps) {
  World world = *ParseWorld(test::SmallWorldYaml() + "events: {}\n", "small.yaml");
  world.laser = ParseWorld(
                    "room: {size: [6, 5, 2.7]}\ndrive: {start: [1, 1, 0], waypoints: [[2, 1]]}\nlaser: {kind: "
                    "pepper, range_max: 10}\n",
                    "w.yaml")
                    ->laser;
  ASSERT_EQ(world.laser.beams, 61);
  const Scene scene(world, 1);
  const PlanarScan scan =
      LaserSensor(world.laser, 1).Scan(scene, {}, Embed3(Rigid2(2.0, 2.0, 0.0)) * world.laser.T_base_laser());
  int seen = 0;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double degrees = RadiansToDegrees(scan.angle_min) + 4.0 * static_cast<double>(i);
    const double off = std::min({std::abs(degrees), std::abs(degrees - 90.0), std::abs(degrees + 90.0)});
    EXPECT_EQ(std::isfinite(scan.ranges[i]), off < 30.5) << degrees;
    seen += std::isfinite(scan.ranges[i]) ? 1 : 0;
  }
  EXPECT_EQ(seen, 47);
}

}  // namespace
}  // namespace planar_vslam
