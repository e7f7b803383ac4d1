#include "planar_vslam/sim/random_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/obstacles.h"
#include "planar_vslam/sim/world_files.h"
#include "planar_vslam/sim/world_text.h"

namespace planar_vslam {
namespace {

constexpr std::uint64_t kFirst = 2000;  // far from the seeds that anything is measured with
constexpr int kWorlds = 150;            // 25 of each kind

// Drawn once for all tests.
const std::vector<World>& Worlds() {
  static const std::vector<World> worlds = [] {
    std::vector<World> drawn;
    for (std::uint64_t seed = kFirst; seed < kFirst + kWorlds; ++seed) {
      const Expected<World> world = DrawWorld(seed, KindOfSeed(seed));
      if (world)
        drawn.push_back(*world);
      else
        ADD_FAILURE() << world.error().message;
    }
    return drawn;
  }();
  return worlds;
}

double LengthOf(const Drive& drive) {
  double length = 0.0;
  for (double t = 0.1; t <= drive.duration(); t += 0.1)
    length += (drive.At(t).translation - drive.At(t - 0.1).translation).norm();
  return length;
}

void ExpectWithin(double value, double low, double high, const char* what, const World& world) {
  constexpr double kRounding = 1e-4;
  EXPECT_GE(value, low - kRounding) << what << " of the " << world.source;
  EXPECT_LE(value, high + kRounding) << what << " of the " << world.source;
}

void ExpectCameraWithinBounds(const World& world) {
  const CameraSpec& camera = world.camera;
  ExpectWithin(camera.model.fx, 250, 900, "focal length", world);
  ExpectWithin(camera.model.width, 320, 1280, "width", world);
  ExpectWithin(camera.model.height, 240, 720, "height", world);
  ExpectWithin(camera.rate, 5, 30, "image rate", world);
  ExpectWithin(camera.position.z(), 0.2, 1.5, "camera's height", world);
  ExpectWithin(RadiansToDegrees(camera.tilt_down), -20, 20, "tilt", world);
  ExpectWithin(camera.time_offset, -0.03, 0.03, "time offset", world);
  ExpectWithin(camera.rolling_shutter, 0, 0.8 / camera.rate, "rolling shutter", world);
  ExpectWithin(RadiansToDegrees(camera.shake), 0, 0.3, "shake", world);
  ExpectWithin(camera.noise, 1, 6, "noise", world);
}

void ExpectRobotWithinBounds(const World& world) {
  ExpectWithin(world.drive.speed, 0.1, 1.2, "speed", world);
  ExpectWithin(world.odometry.scale, 0.97, 1.03, "scale", world);
  ExpectWithin(world.odometry.yaw_scale, 0.95, 1.05, "yaw scale", world);
  ExpectWithin(world.odometry.translation_noise, 0.01 / 3, 0.05, "noise of the way", world);
  ExpectWithin(RadiansToDegrees(world.odometry.rotation_noise), 0.25 / 3, 1.25, "noise of turns", world);
  if (!world.laser.present()) return;
  ExpectWithin(world.laser.height, 0.1, 0.5, "laser's height", world);
  const std::set<double> ranges = {1.5, 4.0, 10.0};
  EXPECT_EQ(ranges.count(world.laser.range_max), 1u) << world.laser.range_max << " of the " << world.source;
}

TEST(RandomWorld, KeepsToItsBoundsAndDrivesFreely) {
  for (const World& world : Worlds()) {
    EXPECT_TRUE(FindProblems(world).empty()) << world.source;
    ExpectCameraWithinBounds(world);
    ExpectRobotWithinBounds(world);
    const Expected<Drive> drive = PlanDrive(world);
    ASSERT_TRUE(drive.ok()) << drive.error().message;
    ExpectWithin(LengthOf(*drive), 39, 201, "length of the drive", world);
    const Obstacles obstacles(world, world.drive.robot_radius);
    for (double t = 0.0; t < drive->duration(); t += 1.0)
      ASSERT_FALSE(obstacles.Touched(drive->At(t), t).has_value()) << world.source << " at " << t << " s";
  }
}

// What a set of worlds has to have somewhere.
TEST(RandomWorld, ShowsTheWholeBreadth) {
  int differential = 0, without_laser = 0, without_slips = 0, many_slips = 0, people = 0, ramps = 0, glossy = 0,
      windows = 0, rolling = 0, bare = 0, rich = 0;
  for (const World& world : Worlds()) {
    differential += world.drive.base == BaseKind::kDifferential ? 1 : 0;
    without_laser += world.laser.present() ? 0 : 1;
    without_slips += world.events.slips.empty() ? 1 : 0;
    many_slips += world.events.slips.size() > 10 ? 1 : 0;
    people += world.people.empty() ? 0 : 1;
    glossy += world.room.gloss > 0.05 ? 1 : 0;
    rolling += world.camera.rolling_shutter > 0.0 ? 1 : 0;
    bool ramp = false, window = false;
    for (const ObjectSpec& object : world.objects) ramp = ramp || object.kind == ObjectKind::kRamp;
    for (const PosterSpec& poster : world.posters) window = window || poster.texture.style == "window";
    ramps += ramp ? 1 : 0, windows += window ? 1 : 0;
    const double walls = 2.0 * (world.room.size.x() + world.room.size.y());  // m
    bare += static_cast<double>(world.posters.size()) < 0.15 * walls ? 1 : 0;
    rich += static_cast<double>(world.posters.size()) > 0.5 * walls ? 1 : 0;
  }
  for (const int share :
       {differential, without_laser, without_slips, many_slips, people, ramps, glossy, windows, rolling, bare, rich}) {
    EXPECT_GT(share, kWorlds / 40);
    EXPECT_LT(share, kWorlds * 9 / 10);
  }
}

TEST(RandomWorld, IsTheSameForTheSameSeedAndEqualsItsFile) {
  for (const WorldKind kind : {WorldKind::kLab, WorldKind::kOffice, WorldKind::kMixed}) {
    const World world = *DrawWorld(kFirst, kind);
    const std::string text = WriteWorld(world);
    EXPECT_EQ(WriteWorld(*DrawWorld(kFirst, kind)), text);
    EXPECT_NE(WriteWorld(*DrawWorld(kFirst + 1, kind)), text);
    const Expected<World> read = ParseWorld(text, "written.yaml");
    ASSERT_TRUE(read.ok()) << read.error().message;
    const Drive drawn = *PlanDrive(world), written = *PlanDrive(*read);
    ASSERT_EQ(drawn.duration(), written.duration());
    EXPECT_EQ(drawn.At(drawn.duration()).translation, written.At(drawn.duration()).translation);
  }
}

TEST(RandomWorld, KindsTakeTurns) {
  std::set<WorldKind> kinds;
  for (std::uint64_t seed = kFirst; seed < kFirst + WorldKindNames().size(); ++seed) kinds.insert(KindOfSeed(seed));
  EXPECT_EQ(kinds.size(), WorldKindNames().size());
}

TEST(RandomWorld, NamesWhatItDoesNotKnow) {
  EXPECT_EQ(OpenWorld({"random", "mapping", {}, 1, "castle"}).error().message,
            "kind 'castle': expected one of lab, office, hall, corridor, warehouse, mixed");
  EXPECT_EQ(OpenWorld({"sample_lab", "mapping", {}, 1, "lab"}).error().message,
            "kind 'lab': expected none, sample_lab is no random world");
}

TEST(RandomWorld, TakesVariants) {
  const Expected<World> world = OpenWorld({"random", "mapping", {"light=0.5", "slip=3"}, kFirst, "hall"});
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_EQ(world->light.level, 0.5);
  EXPECT_EQ(world->events.random_slips.rate, 3.0);
}

}  // namespace
}  // namespace planar_vslam
