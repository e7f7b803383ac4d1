#pragma once
// A simulated world as a value: a rectangular room with lamps, furniture and pictures, the robot's drive and its
// sensors. Read from YAML; every unknown key, wrong type and impossible value is an error that names file, line and
// key.
//
// World frame: origin in a corner of the room on the floor, x along the south wall, y along the west wall, z up.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/robot_spec.h"

namespace planar_vslam {

// A procedural texture: one of SurfaceStyles() (repeats over the surface) or PictureStyles() (stretched over it once).
struct TextureSpec {
  std::string style = "plain";
  int shade = kDefaultShade;  // mean grey level of a surface style, 0-255; pictures have none

  static constexpr int kDefaultShade = -1;  // the style's own
};
const std::vector<std::string>& SurfaceStyles();
const std::vector<std::string>& PictureStyles();

struct RoomSpec {
  Eigen::Vector3d size{6.0, 5.0, 2.7};  // m, along x, y, z
  TextureSpec floor{"tiles"};
  TextureSpec walls{"plaster"};
  TextureSpec ceiling{"panels"};
  double skirting = 0.08;   // m, height of the dark board along the walls' foot; 0 for none
  double ambient = 0.35;    // share of the light that comes from everywhere, 0-1; the lamps give the rest
  double gloss = 0.0;       // share of the light from straight above that the floor mirrors, 0-1
  double roughness = 0.03;  // rad, how far the floor's mirror images are blurred
};

// What the light is like today. Everything else equal, the picture of a room does not depend on how many lamps it has;
// these factors are on the light (not on grey levels).
struct LightSpec {
  double level = 1.0;          // of everything
  double lamps = 1.0;          // of the lamps
  double windows = 0.0;        // what all windows give, in lamps' worth
  double sun = 0.0;            // of direct sunlight through windows, in times the mean light; 0: none
  double sun_azimuth = 0.0;    // rad, where the sun stands, from the x axis to the left
  double sun_elevation = 0.6;  // rad above the horizon
};

// A rectangular panel in the ceiling, shining down.
struct LampSpec {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  // m, centre
  Eigen::Vector2d size{0.6, 0.6};                // m
  double power = 1.0;                            // relative to the other lamps
};

enum class ObjectKind { kBox, kTable, kChair, kSwivelChair, kShelf, kPillar, kWall, kRamp };
const char* Name(ObjectKind kind);

// An opening in an inner wall.
struct DoorwaySpec {
  double along = 0.0;    // m, centre, from the wall's first end
  double width = 0.9;    // m
  double height = 2.05;  // m
};

struct ObjectSpec {
  ObjectKind kind = ObjectKind::kBox;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  // m, centre of the footprint
  double yaw = 0.0;                              // rad; a shelf's and a chair's front look along their -y axis
  Eigen::Vector2d size{0.4, 0.4};                // m, footprint along the object's own x and y; a pillar's diameters
  double bottom = 0.0;                           // m above the floor
  double height = 1.0;                           // m, from bottom to top
  int boards = 5;                                // of a shelf, top and bottom included
  double plateau = 0.0;                          // m, of a ramp: length of its level top
  bool both_ways = true;                         // of a ramp: falls again behind the top
  std::vector<DoorwaySpec> doorways;             // of a wall
  std::string name;                              // of a wall, for posters
  TextureSpec texture{"wood"};
};

enum class Wall { kSouth, kEast, kNorth, kWest };
const char* Name(Wall wall);

// Something flat on a wall: a poster, a window, a door. Too thin for the laser and the grid.
struct PosterSpec {
  Wall wall = Wall::kNorth;
  double along = 0.0;              // m, centre: x on the south and north wall, y on the east and west wall
  double height = 1.4;             // m, centre above the floor
  Eigen::Vector2d size{0.6, 0.8};  // m, width and height
  TextureSpec texture{"text"};
  std::string inner_wall{};  // name of the inner wall it hangs on instead: `along` is then from that wall's first end
  bool left = true;          // of an inner wall: on the side to the left on the way from its first end
};

// Somebody who walks to and fro along a line, seen by camera and laser.
struct PersonSpec {
  std::vector<Eigen::Vector2d> path;  // m, at least two points
  double speed = 0.8;                 // m/s
  double start = 0.0;                 // m along the path at time 0
  double height = 1.75;               // m
};

struct World {
  std::string source = "world";  // file name, for messages
  RoomSpec room;
  std::vector<LampSpec> lamps;
  std::vector<ObjectSpec> objects;
  std::vector<ObjectSpec> ramp_objects;  // there only when a ramp is asked for
  std::vector<PosterSpec> posters;
  std::vector<PersonSpec> people;
  LightSpec light;
  DriveSpec drive;
  std::optional<DriveSpec> repeat_drive;  // another way through the same world
  LimitsSpec limits;
  CameraSpec camera;
  HeadSpec head;
  LaserSpec laser;
  OdometrySpec odometry;
  EventsSpec events;
};

// What makes a world impossible: the key as in the file ("objects[2].size") and what was expected instead.
struct WorldProblem {
  std::string key;
  std::string message;
};
std::vector<WorldProblem> FindProblems(const World& world);

// Errors are one line, "FILE:LINE: key: what was expected".
Expected<World> ParseWorld(const std::string& yaml_text, const std::string& source);
Expected<World> LoadWorld(const std::filesystem::path& path);

}  // namespace planar_vslam
