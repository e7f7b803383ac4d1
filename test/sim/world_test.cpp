#include "planar_vslam/sim/world.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "planar_vslam/sim/drive.h"
#include "sim_fixtures.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

const std::string kRoom = "room: {size: [6, 5, 2.7]}\n";
const std::string kDrive = "drive: {start: [1, 1, 0], waypoints: [[2, 1]]}\n";

std::string ErrorOf(const std::string& yaml) {
  const Expected<World> world = ParseWorld(yaml, "w.yaml");
  return world.ok() ? "" : world.error().message;
}

TEST(World, ShippedWorldsLoadAndCanBeDriven) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::SourceFolder() / "config/worlds")) {
    const Expected<World> world = LoadWorld(entry.path());
    ASSERT_TRUE(world.ok()) << world.error().message;
    const Expected<Drive> drive = PlanDrive(*world);
    EXPECT_TRUE(drive.ok()) << drive.error().message;
    ++count;
  }
  EXPECT_GE(count, 1);
}

TEST(World, ReadsWhatTheFileSays) {
  const Expected<World> read = ParseWorld(test::SmallWorldYaml(), "small.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  const World& world = *read;
  EXPECT_EQ(world.room.size, Eigen::Vector3d(5, 4, 2.5));
  EXPECT_EQ(world.room.floor.shade, 120);
  ASSERT_EQ(world.objects.size(), 2u);
  EXPECT_EQ(world.objects[1].kind, ObjectKind::kTable);
  EXPECT_EQ(world.objects[1].height, 0.74) << "a table's own default";
  ASSERT_EQ(world.posters.size(), 1u);
  EXPECT_EQ(world.posters[0].wall, Wall::kEast);
  EXPECT_EQ(world.camera.model.width, 160);
  EXPECT_NEAR(world.camera.shake, DegreesToRadians(0.15), 1e-12);
  EXPECT_EQ(world.odometry.yaw_scale, 1.02);
}

TEST(World, CameraLooksForwardAndALittleDown) {
  const CameraSpec camera;
  const Eigen::Matrix3d R = camera.T_base_camera().R();
  EXPECT_NEAR(R(0, 2), std::cos(0.06), 1e-12) << "optical axis forward";
  EXPECT_NEAR(R(2, 2), -std::sin(0.06), 1e-12) << "and down";
  EXPECT_NEAR(R(1, 0), -1.0, 1e-12) << "x to the robot's right";
}

TEST(World, ErrorsNameFileLineAndKey) {
  EXPECT_EQ(ErrorOf(kRoom + kDrive), "");
  EXPECT_EQ(
      ErrorOf(kRoom + kDrive + "lamp: 3\n").rfind("w.yaml:3: lamp: unknown key; expected one of camera, drive", 0), 0u);
  EXPECT_EQ(ErrorOf("room: {size: [0, 5, 2.7]}\n" + kDrive), "w.yaml:1: room.size: expected 1 to 100 m along x, got 0");
  EXPECT_EQ(ErrorOf(kRoom + kDrive + "objects:\n  - {kind: box, at: [2, 1], size: [0.5, 0.5], height: 1}\n"),
            "w.yaml:2: drive.waypoints[0]: expected free floor, but [2, 1] lies inside objects[0], a box");
  EXPECT_EQ(ErrorOf(kRoom + "drive:\n  start: [1, 1, 0]\n  waypoints:\n    - [2, 1]\n    - [9, 1]\n"),
            "w.yaml:6: drive.waypoints[1]: expected a point inside the room of 6 x 5 m, got [9, 1]");
}

TEST(World, RefusesWrongTypesAndValues) {
  const auto expect_error = [](const std::string& yaml, const std::string& part) {
    EXPECT_NE(ErrorOf(yaml).find(part), std::string::npos) << "'" << ErrorOf(yaml) << "' should say '" << part << "'";
    EXPECT_EQ(ErrorOf(yaml).find('\n'), std::string::npos) << "one line";
  };
  expect_error("", "expected a map");
  expect_error(": : :", "w.yaml");
  expect_error("- 1\n", "w.yaml:1: expected a map of keys");
  expect_error(kDrive, "room: is missing");
  expect_error(kRoom, "drive: is missing");
  expect_error("room: {size: [6, 5]}\n" + kDrive, "room.size: expected a list of 3 numbers");
  expect_error("room: {size: [6, .nan, 2]}\n" + kDrive, "room.size: expected a finite number");
  expect_error("room: {size: [6, 5, 2.7], floor: lava}\n" + kDrive, "room.floor: expected one of plain, plaster");
  expect_error("room: {size: [6, 5, 2.7], size: [1, 1, 1]}\n" + kDrive, "room.size: is given twice");
  expect_error(kRoom + kDrive + "objects: [{kind: sofa, at: [1, 1]}]\n", "objects[0].kind: expected one of box, table");
  expect_error(kRoom + kDrive + "objects: [{kind: box, at: [3, 3]}]\n", "objects[0].size: is missing");
  expect_error(kRoom + kDrive + "objects: [{kind: table, at: [3, 3], radius: 1}]\n", "objects[0].radius: unknown key");
  expect_error(kRoom + kDrive + "objects: [{kind: table, at: [3, 3], height: 3}]\n",
               "objects[0].height: expected 0.005 to 2.7 m, got 3");
  expect_error(kRoom + kDrive + "posters: [{wall: top, along: 1, size: [1, 1]}]\n",
               "posters[0].wall: expected one of south");
  expect_error(kRoom + kDrive + "posters: [{wall: east, along: 0.1, size: [1, 1]}]\n",
               "posters[0].along: expected 0.5 to 4.5 m");
  expect_error(kRoom + kDrive + "posters: [{wall: east, along: 1, size: [9, 1]}]\n",
               "posters[0].size: expected to fit the east wall");
  expect_error(kRoom + kDrive + "camera: {rate: 0}\n", "camera.rate: expected 0.01 to 1000 Hz, got 0");
  expect_error(kRoom + kDrive + "camera: {size: [64.5, 48]}\n", "camera.size: expected whole numbers");
  expect_error(kRoom + kDrive + "laser: {beams: 1}\n", "laser.beams: expected 2 to 100000, got 1");
  expect_error(kRoom + kDrive + "laser: {beams: many}\n", "laser.beams: expected a whole number");
  expect_error(kRoom + "drive: {start: [1, 1, 0], waypoints: [[2]]}\n", "drive.waypoints[0]: expected [x, y]");
  expect_error(kRoom + "drive: {start: [1, 1, 0], waypoints: [[2, 1]], laps: 1}\n",
               "drive.waypoints: expected at least 3");
  expect_error(kRoom + "drive: {start: [1, 1, 0]}\n", "drive: expected waypoints or a shuffle");
  expect_error(kRoom + kDrive + "lamps: 3\n", "lamps: expected a list");
}

TEST(World, NamesAFileItCannotRead) {
  EXPECT_EQ(LoadWorld("/nowhere/lab.yaml").error().message, "/nowhere/lab.yaml: expected a readable world file (YAML)");
  EXPECT_FALSE(LoadWorld("/").ok());
}

}  // namespace
}  // namespace planar_vslam
