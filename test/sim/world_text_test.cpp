#include "planar_vslam/sim/world_text.h"

#include <gtest/gtest.h>

#include "planar_vslam/sim/world_files.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

TEST(WorldText, IsReadBackAsItWasWritten) {
  for (const std::string name :
       {"mechatronics_lab", "south_hall", "chemistry_hall", "corridor_loop", "office", "sample_lab"}) {
    const Expected<World> shipped = OpenWorld({name, "mapping", {}, 1, ""});
    ASSERT_TRUE(shipped.ok()) << shipped.error().message;
    const std::string text = WriteWorld(*shipped);
    const Expected<World> again = ParseWorld(text, "again.yaml");
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(WriteWorld(*again), text);
    EXPECT_EQ(again->objects.size(), shipped->objects.size());
    EXPECT_EQ(again->posters.size(), shipped->posters.size());
    EXPECT_NEAR(again->drive.start.angle, shipped->drive.start.angle, 1e-6);
    EXPECT_EQ(again->repeat_drive.has_value(), shipped->repeat_drive.has_value());
  }
}

TEST(WorldText, KeepsWhatGoesWrongAndMoves) {
  World world = test::BareRoom();
  world.events.slips = {{1.5, 0.4, 2.0}};
  world.events.kidnaps = {{3.0, 2.0}};
  world.events.blackouts = {{4.0, 1.0}};
  world.events.occlusions = {{5.0, 1.5}};
  world.events.random_slips.rate = 3.0;
  world.head.motion = {{0.0, 0.1, 0.0}, {2.0, -0.1, 0.2}};
  world.head.period = 4.0;
  world.people.push_back({{{1.0, 4.0}, {5.0, 4.0}}, 0.6, 0.5, 1.7});
  world.camera.rolling_shutter = 0.012;
  world.camera.time_offset = -0.02;
  world.laser.kind = LaserKind::kNone;
  world.drive.base = BaseKind::kDifferential;
  const Expected<World> again = ParseWorld(WriteWorld(world), "again.yaml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->events.slips.at(0).factor, 2.0);
  EXPECT_EQ(again->events.kidnaps.at(0).skip, 2.0);
  EXPECT_EQ(again->events.blackouts.at(0).at, 4.0);
  EXPECT_EQ(again->events.occlusions.at(0).duration, 1.5);
  EXPECT_EQ(again->events.random_slips.rate, 3.0);
  EXPECT_NEAR(again->head.motion.at(1).tilt, 0.2, 1e-6);
  EXPECT_EQ(again->people.at(0).path.at(1).x(), 5.0);
  EXPECT_NEAR(again->camera.rolling_shutter, 0.012, 1e-9);
  EXPECT_NEAR(again->camera.time_offset, -0.02, 1e-9);
  EXPECT_FALSE(again->laser.present());
  EXPECT_EQ(again->drive.base, BaseKind::kDifferential);
}

}  // namespace
}  // namespace planar_vslam
