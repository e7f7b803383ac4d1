#include "planar_vslam/sim/variants.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>

#include "planar_vslam/sim/obstacles.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/solids.h"
#include "sim_fixtures.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

World Shipped(const std::string& name) {
  return LoadWorld(test::SourceFolder() / "config/worlds" / (name + ".yaml")).value();
}

TEST(Variants, EveryShippedWorldStandsThemAllOnBothDrives) {
  for (const char* name :
       {"sample_lab", "mechatronics_lab", "south_hall", "chemistry_hall", "corridor_loop", "office"}) {
    for (const char* drive : {"mapping", "repeat"}) {
      const World world = ChooseDrive(Shipped(name), drive).value();
      const std::vector<std::string> variants = {"light=daylight", "glossy",   "bump",   "slip",
                                                 "occlusion",      "blackout", "kidnap", "ramp"};
      const Expected<World> changed = ApplyVariants(world, variants, 3);
      ASSERT_TRUE(changed.ok()) << changed.error().message;
      EXPECT_TRUE(FindProblems(*changed).empty()) << FindProblems(*changed)[0].key;
      const Expected<Drive> planned = PlanDrive(*changed);
      EXPECT_TRUE(planned.ok()) << planned.error().message;
    }
  }
}

TEST(Variants, ReverseLeadsFromTheEndOfTheDriveToItsStart) {
  for (const char* name :
       {"sample_lab", "mechatronics_lab", "south_hall", "chemistry_hall", "corridor_loop", "office"}) {
    const Drive there = PlanDrive(Shipped(name)).value();
    const Expected<Drive> back = PlanDrive(ChooseDrive(Shipped(name), "reverse").value());
    ASSERT_TRUE(back.ok()) << back.error().message;
    const Rigid2 first = back->At(0.0), last = back->At(back->duration());
    EXPECT_LT((first.translation - there.At(there.duration()).translation).norm(), 0.1) << name;
    const double shuffle = Shipped(name).drive.shuffle;
    EXPECT_LT((last.translation - there.At(0.0) * Eigen::Vector2d(0.0, shuffle)).norm(), 0.1) << name;
    const double middle = 0.5 * back->duration();
    EXPECT_GT((back->At(middle).Inverse() * back->At(middle + 0.5)).translation.x(), -0.01) << "drives forward";
  }
}

// How high the base gets on its way, m, and how steep it stands, rad.
std::pair<double, double> HighestAndSteepest(const World& world) {
  const Drive drive = PlanDrive(world).value();
  const Floor floor(world);
  double highest = 0.0, steepest = 0.0;
  for (double time = 0.0; time < drive.duration(); time += 0.05) {
    const Rigid3 T_world_base = floor.Stand(drive.At(time));
    highest = std::max(highest, T_world_base.translation.z());
    steepest = std::max(steepest, std::acos(std::min(1.0, T_world_base.R()(2, 2))));
  }
  return {highest, steepest};
}

TEST(Variants, TheRampLeadsUpAtFiveDegreesInEveryWorld) {
  for (const char* name :
       {"sample_lab", "mechatronics_lab", "south_hall", "chemistry_hall", "corridor_loop", "office"}) {
    const double height = std::string(name) == "sample_lab" ? 0.0875 : 0.2625;  // 1 m or 3 m of it
    for (const char* drive : {"mapping", "repeat"}) {
      const World world = ChooseDrive(Shipped(name), drive).value();
      const auto [highest, steepest] = HighestAndSteepest(ApplyVariants(world, {"ramp"}, 1).value());
      EXPECT_NEAR(highest, height, 0.01) << name << ", " << drive;
      EXPECT_GT(steepest, DegreesToRadians(4.9)) << name << ", " << drive;
    }
  }
}

TEST(Variants, MovedFurnitureStandsElsewhereAndOutOfTheWay) {
  for (const char* name : {"mechatronics_lab", "office"}) {
    const World before = Shipped(name);
    const World after = ApplyVariants(before, {"moved-furniture"}, 5).value();
    int moved = 0;
    for (std::size_t i = 0; i < before.objects.size(); ++i) {
      const bool same = before.objects[i].at == after.objects[i].at;
      moved += same ? 0 : 1;
      EXPECT_TRUE(same || before.objects[i].kind != ObjectKind::kTable);
    }
    EXPECT_GT(moved, 5) << name;
    EXPECT_TRUE(PlanDrive(after).ok());
    EXPECT_TRUE(PlanDrive(*ChooseDrive(after, "repeat")).ok());
    EXPECT_TRUE(FindProblems(after).empty());
    const World again = ApplyVariants(before, {"moved-furniture"}, 5).value();
    const World other = ApplyVariants(before, {"moved-furniture"}, 6).value();
    bool same_again = true, same_other = true;
    for (std::size_t i = 0; i < after.objects.size(); ++i) {
      same_again = same_again && again.objects[i].at == after.objects[i].at;
      same_other = same_other && other.objects[i].at == after.objects[i].at;
    }
    EXPECT_TRUE(same_again);
    EXPECT_FALSE(same_other);
  }
}

// Mean grey level of what the robot sees at the start.
double FirstImageMean(const World& world) {
  const Scene scene(world, 1);
  CameraShot shot;
  shot.T_world_camera = Embed3(world.drive.start) * world.camera.T_base_camera();
  const GrayImage image = CameraSensor(world.camera).Render(scene, shot);
  return std::accumulate(image.pixels->begin(), image.pixels->end(), 0.0) / static_cast<double>(image.pixels->size());
}

TEST(Variants, SomebodyCrossesTheDriveAndDoesNotMeetTheRobot) {
  for (const char* name : {"mechatronics_lab", "south_hall"}) {
    const World before = Shipped(name);
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const World after = ApplyVariants(before, {"moved-furniture", "people=2"}, seed).value();
      ASSERT_EQ(after.people.size(), before.people.size() + 2) << name;
      EXPECT_TRUE(FindProblems(after).empty());
      const Expected<Drive> drive = PlanDrive(after);
      ASSERT_TRUE(drive.ok()) << drive.error().message;
      World alone = after;
      alone.people.clear();
      const Obstacles obstacles(alone, 0.25);
      for (const PersonSpec& person : after.people) {
        double nearest = 10.0;
        for (double time = 0.0; time < 60.0; time += 0.1) {
          const Eigen::Vector2d at = WalkerAt(person, time).T_world_walker.translation;
          EXPECT_GT(obstacles.Clearance(at, time), 0.0) << name << ", " << seed;
          for (double t = 0.0; t < drive->duration(); t += 0.5)
            nearest = std::min(nearest, (at - drive->At(t).translation).norm());
        }
        EXPECT_LT(nearest, 0.3) << "the way crosses the drive";
      }
    }
  }
  const auto error = [](const char* variant) {
    return ApplyVariants(Shipped("sample_lab"), {variant}, 1).error().message;
  };
  EXPECT_NE(error("people").find("expected room to walk in"), std::string::npos) << "it is too small";
  EXPECT_NE(error("people=0").find("expected a number from 1 to 10"), std::string::npos);
}

TEST(Variants, LightGetsDarkerAndBrighter) {
  World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  world.posters.push_back({Wall::kWest, 2.0, 1.5, {1.2, 1.0}, {"window"}});
  const double usual = FirstImageMean(world);
  EXPECT_LT(FirstImageMean(*ApplyVariants(world, {"light=lamps-off"}, 1)), 0.75 * usual);
  EXPECT_LT(FirstImageMean(*ApplyVariants(world, {"light=0.4"}, 1)), 0.75 * usual);
  EXPECT_GT(FirstImageMean(*ApplyVariants(world, {"light=1.5"}, 1)), 1.1 * usual);
}

TEST(Variants, TheSunShinesThroughTheWindowOntoTheFloor) {
  World world = test::BareRoom();
  world.room.floor = {"plain", 100};
  world.posters.push_back({Wall::kWest, 2.5, 1.5, {1.6, 1.4}, {"window"}});
  world = *ApplyVariants(world, {"light=daylight"}, 1);
  const Scene scene(world, 1);
  // Straight down from under the ceiling; the sun comes from the west, 25 degrees to the left of the window's normal.
  CameraShot shot;
  const auto grey_at = [&](double x, double y) {
    Eigen::Matrix3d R;
    R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
    shot.T_world_camera = Rigid3(R, Eigen::Vector3d(x, y, 2.0));
    const GrayImage image = CameraSensor(world.camera).Render(scene, shot);
    return int{(*image.pixels)[240 * 640 + 320]};
  };
  const double reach = 1.5 / std::tan(world.light.sun_elevation);  // where the window's middle is cast
  const double x = -reach * std::cos(world.light.sun_azimuth), y = 2.5 - reach * std::sin(world.light.sun_azimuth);
  EXPECT_GT(grey_at(x, y), grey_at(5.0, 1.0) + 40);
}

TEST(Variants, AGlossyFloorMirrorsWhatStandsOnIt) {
  World world = test::BareRoom();
  world.room.floor = {"plain", 60};
  world.room.walls = {"plain", 90};
  world.posters.push_back({Wall::kEast, 2.5, 0.6, {1.0, 1.0}, {"plain", 250}});
  const auto render = [](const World& w) {
    const Scene scene(w, 1);
    CameraShot shot;
    shot.T_world_camera = Embed3(Rigid2(1.5, 2.5, 0.0)) * w.camera.T_base_camera();
    return CameraSensor(w.camera).Render(scene, shot);
  };
  const GrayImage dull = render(world), glossy = render(*ApplyVariants(world, {"glossy=0.3"}, 1));
  // The mirror image of the poster's middle: as far below the floor.
  const Rigid3 T_camera_world = (Embed3(Rigid2(1.5, 2.5, 0.0)) * world.camera.T_base_camera()).Inverse();
  const auto at = [&](const GrayImage& image, const Eigen::Vector3d& point) {
    const Eigen::Vector2d px = world.camera.model.Project(T_camera_world * point);
    return int{(*image.pixels)[static_cast<std::size_t>(std::lround(px.y()) * 640 + std::lround(px.x()))]};
  };
  const Eigen::Vector3d image_of_poster(6.0, 2.5, -0.5), image_of_wall(6.0, 3.4, -0.5);
  EXPECT_GT(at(glossy, image_of_poster), at(dull, image_of_poster) + 20);
  EXPECT_GT(at(glossy, image_of_poster), at(glossy, image_of_wall) + 15);
  const Eigen::Vector3d poster(6.0, 2.5, 0.8);
  EXPECT_NEAR(at(glossy, poster), at(dull, poster), 1) << "walls are as they were";
}

TEST(Variants, RefusesWhatItDoesNotKnow) {
  const World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  const auto error = [&world](const std::string& variant) {
    const Expected<World> changed = ApplyVariants(world, {variant}, 1);
    return changed.ok() ? std::string() : changed.error().message;
  };
  EXPECT_EQ(error("fog").rfind("variant 'fog': expected one of light, moved-furniture, glossy", 0), 0u) << error("fog");
  EXPECT_NE(error("light").find("expected lamps-off, daylight or a factor"), std::string::npos);
  EXPECT_NE(error("light=dim").find("got 'dim'"), std::string::npos);
  EXPECT_NE(error("glossy=2").find("expected a number from 0 to 1, got '2'"), std::string::npos);
  EXPECT_NE(error("blackout=1x").find("got '1x'"), std::string::npos);
  EXPECT_NE(error("ramp").find("this world has no place for a ramp"), std::string::npos);
  EXPECT_NE(ChooseDrive(world, "repeat").error().message.find("repeat_drive: is missing"), std::string::npos);
  EXPECT_NE(ChooseDrive(world, "detour").error().message.find("expected mapping, repeat or reverse"),
            std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
