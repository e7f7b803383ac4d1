#pragma once
// A simulated world as a value: a rectangular room with lamps, furniture and pictures, the robot's drive and its
// sensors. Read from YAML; every unknown key, wrong type and impossible value is an error that names file, line and
// key.
//
// World frame: origin in a corner of the room on the floor, x along the south wall, y along the west wall, z up.
#include <Eigen/Core>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/camera_model.h"

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
  double skirting = 0.08;  // m, height of the dark board along the walls' foot; 0 for none
  double ambient = 0.35;   // share of the light that comes from everywhere, 0-1; the lamps give the rest
};

// A rectangular panel in the ceiling, shining down.
struct LampSpec {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  // m, centre
  Eigen::Vector2d size{0.6, 0.6};                // m
  double power = 1.0;                            // relative to the other lamps
};

enum class ObjectKind { kBox, kTable, kChair, kShelf, kPillar };
const char* Name(ObjectKind kind);

struct ObjectSpec {
  ObjectKind kind = ObjectKind::kBox;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  // m, centre of the footprint
  double yaw = 0.0;                              // rad; a shelf's and a chair's front look along their -y axis
  Eigen::Vector2d size{0.4, 0.4};                // m, footprint along the object's own x and y; a pillar's diameters
  double bottom = 0.0;                           // m above the floor
  double height = 1.0;                           // m, from bottom to top
  int boards = 5;                                // of a shelf, top and bottom included
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
};

struct DriveSpec {
  Rigid2 start;                            // T_world_base at t = 0
  double shuffle = 0.0;                    // m sideways (left positive) before driving forward
  std::vector<Eigen::Vector2d> waypoints;  // m
  double laps = 0.0;                       // times round the closed polygon of waypoints; 0: once along the open line
  double speed = 0.35;                     // m/s
  double sideways_speed = 0.2;             // m/s, peak of the shuffle
  double acceleration = 0.3;               // m/s^2
  double turn_rate = 0.6;                  // rad/s
  double turn_acceleration = 1.2;          // rad/s^2
  double robot_radius = 0.25;              // m, kept clear of everything
};

struct CameraSpec {
  CameraModel model{640, 480, 610.0, 610.0, 322.3, 238.6, 0.03, -0.09, 0.0, 0.0, 0.0};
  double rate = 10.0;                          // Hz
  Eigen::Vector3d position{0.06, 0.0, 1.118};  // m, of the optical centre in the base
  double tilt_down = 0.06;                     // rad, optical axis below the horizon
  double shake = 0.0;                          // rad, standard deviation of the mount about each axis
  double noise = 0.0;                          // grey levels, standard deviation at mid grey
  double exposure = 1.0;                       // factor on the grey levels, of the first image if it adjusts itself
  bool auto_exposure = false;                  // follows the light
  double exposure_target = 115.0;              // mean grey level the automatic looks for
  double exposure_response = 0.4;              // s, after which the automatic is down to 1 / e of what it was off
  double exposure_time = 0.0;                  // s the shutter is open at factor 1; 0: nothing blurs
  double longest_exposure = 0.033;             // s, beyond which darkness is amplified instead
  double rolling_shutter = 0.0;                // s from the first row to the last; 0: all at once
  double time_offset = 0.0;                    // s its stamps are ahead of the odometry's clock

  Rigid3 T_base_camera() const;
};

struct LaserSpec {
  double rate = 5.0;                  // Hz
  double height = 0.25;               // m above the floor, over the base's origin
  double field_of_view = 1.5 * M_PI;  // rad, centred on forward
  int beams = 541;
  double range_max = 8.0;  // m
  double noise = 0.0;      // m, standard deviation

  Rigid3 T_base_laser() const;
  double angle_min() const { return -0.5 * field_of_view; }
  double angle_increment() const { return field_of_view / (beams - 1); }
};

struct OdometrySpec {
  double rate = 50.0;              // Hz
  double scale = 1.0;              // measured / true distance
  double yaw_scale = 1.0;          // measured / true rotation
  double translation_noise = 0.0;  // m per sqrt(m), each axis
  double rotation_noise = 0.0;     // rad per sqrt(m) and per sqrt(rad)
};

struct World {
  std::string source = "world";  // file name, for messages
  RoomSpec room;
  std::vector<LampSpec> lamps;
  std::vector<ObjectSpec> objects;
  std::vector<PosterSpec> posters;
  DriveSpec drive;
  CameraSpec camera;
  LaserSpec laser;
  OdometrySpec odometry;
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
