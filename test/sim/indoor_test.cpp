// Inner walls, doorways, people.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/scene.h"
#include "planar_vslam/sim/sensors.h"
#include "planar_vslam/sim/solids.h"
#include "planar_vslam/sim/truth_grid.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

const std::string kTwoRooms =
    "room: {size: [6, 5, 2.7]}\n"
    "lamps: [{at: [3, 2.5]}]\n"
    "objects:\n"
    "  - {kind: wall, name: divider, from: [3, 0], to: [3, 5], thickness: 0.2, doorways: [{along: 2.0, width: 1.0}]}\n"
    "posters: [{wall: divider, side: left, along: 4.0, size: [0.6, 0.8]}]\n"
    "drive: {start: [1, 2, 0], waypoints: [[5, 2]]}\n";

std::string ErrorOf(const std::string& yaml) {
  const Expected<World> world = ParseWorld(yaml, "w.yaml");
  return world.ok() ? "" : world.error().message;
}

TEST(InnerWall, LetsLaserAndRobotThroughItsDoorwayOnly) {
  const World world = *ParseWorld(kTwoRooms, "w.yaml");
  const Scene scene(world, 1);
  EXPECT_NEAR(scene.Range({1.0, 2.0, 0.3}, {1, 0, 0}, 10.0), 5.0, 1e-3);
  EXPECT_NEAR(scene.Range({1.0, 4.0, 0.3}, {1, 0, 0}, 10.0), 1.9, 1e-3);
  EXPECT_NEAR(scene.Range({1.0, 2.0, 2.3}, {1, 0, 0}, 10.0), 1.9, 1e-3) << "the lintel";
  EXPECT_TRUE(PlanDrive(world).ok());
  World shut = world;
  shut.drive.waypoints = {{1.2, 4.2}, {5.0, 4.2}};
  EXPECT_NE(PlanDrive(shut).error().message.find("objects[0], a wall"), std::string::npos);
  const TruthGrid grid = MakeTruthGrid(world, kBodyLow, kBodyHigh);
  const auto occupied = [&grid](double x, double y) {
    return grid.Occupied(static_cast<int>((x - grid.origin.x()) / grid.resolution),
                         static_cast<int>((y - grid.origin.y()) / grid.resolution));
  };
  EXPECT_TRUE(occupied(3.0, 1.0));
  EXPECT_FALSE(occupied(3.0, 2.0));
}

TEST(InnerWall, ShowsItsPosterOnTheSideItHangsOn) {
  World world = *ParseWorld(kTwoRooms, "w.yaml");
  world.room.walls = {"plain", 200};
  world.objects[0].texture = {"plain", 200};
  world.posters[0].texture = {"plain", 20};
  const Scene scene(world, 1);
  const auto darkest = [&](double x, double yaw) {
    const Rigid3 T_world_camera = Embed3(Rigid2(x, 4.0, yaw)) * world.camera.T_base_camera();
    CameraShot shot;
    shot.T_world_camera = T_world_camera;
    const GrayImage image = CameraSensor(world.camera).Render(scene, shot);
    const Eigen::Vector2d px = world.camera.model.Project(T_world_camera.Inverse() * Eigen::Vector3d(3.0, 4.0, 1.4));
    return int{(*image.pixels)[static_cast<std::size_t>(std::lround(px.y()) * 640 + std::lround(px.x()))]};
  };
  EXPECT_LT(darkest(1.5, 0.0), 40) << "from the west, the left side of a wall that runs north";
  EXPECT_GT(darkest(4.5, M_PI), 90);
}

TEST(InnerWall, RefusesDoorwaysThatDoNotFit) {
  const auto with = [](const std::string& doorways) {
    return "room: {size: [6, 5, 2.7]}\ndrive: {start: [1, 1, 0], waypoints: [[2, 1]]}\nobjects:\n  - {kind: wall, "
           "from: "
           "[3, 0], to: [3, 5], doorways: [" +
           doorways + "]}\n";
  };
  EXPECT_EQ(ErrorOf(with("{along: 2}")), "");
  EXPECT_NE(ErrorOf(with("{along: 4.8}")).find("w.yaml:4: objects[0].doorways[0].along: expected 0.45 to 4.55 m"),
            std::string::npos)
      << ErrorOf(with("{along: 4.8}"));
  EXPECT_NE(ErrorOf(with("{along: 2}, {along: 2.5}")).find("doorways[1].along"), std::string::npos);
  EXPECT_NE(ErrorOf(with("{along: 2, width: wide}")).find("doorways[0].width: expected a finite number"),
            std::string::npos);
  EXPECT_NE(ErrorOf(kTwoRooms + "people: [{path: [[1, 1]]}]\n").find("people[0].path: expected at least 2 points"),
            std::string::npos);
}

TEST(People, WalkToAndFro) {
  PersonSpec person;
  person.path = {{1, 1}, {3, 1}, {3, 2}};
  person.speed = 1.0;
  EXPECT_LT((WalkerAt(person, 2.5).T_world_walker.translation - Eigen::Vector2d(3.0, 1.5)).norm(), 1e-9);
  EXPECT_NEAR(WalkerAt(person, 2.5).T_world_walker.angle, M_PI_2, 1e-9);
  EXPECT_LT((WalkerAt(person, 4.0).T_world_walker.translation - Eigen::Vector2d(2.0, 1.0)).norm() - 1.0, 1e-9);
  EXPECT_LT((WalkerAt(person, 6.0).T_world_walker.translation - Eigen::Vector2d(1.0, 1.0)).norm(), 1e-9);
}

TEST(People, AreMetByTheLaserWhereTheyAre) {
  World world = test::BareRoom();
  PersonSpec person;
  person.path = {{4.0, 1.0}, {4.0, 4.0}};
  world.people.push_back(person);
  Scene scene(world, 1);
  const Eigen::Vector3d from(1.0, 2.5, 1.1), ahead(1, 0, 0);
  EXPECT_NEAR(scene.Range(from, ahead, 10.0), 5.0, 1e-3) << "nobody is there yet";
  Walker walker;
  walker.T_world_walker = Rigid2(4.0, 2.5, 0.0);
  scene.Place({walker, Walker{{}, 0.0, 0.0, false}});
  EXPECT_NEAR(scene.Range(from, ahead, 10.0), 3.0 - 0.12, 1e-3) << "half a body's depth before the middle";
  walker.T_world_walker = Rigid2(4.0, 1.0, 0.0);
  scene.Place({walker, Walker{{}, 0.0, 0.0, false}});
  EXPECT_NEAR(scene.Range(from, ahead, 10.0), 5.0, 1e-3);
}

TEST(People, AreNotRunInto) {
  World world = test::BareRoom();
  PersonSpec person;
  person.path = {{3.0, 1.4}, {3.2, 1.4}};
  world.people.push_back(person);
  EXPECT_NE(PlanDrive(world).error().message.find("people[0]"), std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
