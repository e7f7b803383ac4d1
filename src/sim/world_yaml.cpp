// Worlds from YAML. The keys here are the file format; ranges and geometry are FindProblems' business.
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <sstream>

#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/sim/world.h"
#include "yaml_fields.h"

namespace planar_vslam {
namespace {

using sim::YamlErrors;
using sim::YamlFields;

void ReadDegrees(YamlFields& fields, const std::string& key, double* radians) {
  double degrees = RadiansToDegrees(*radians);
  fields.Read(key, &degrees);
  if (fields.Has(key)) *radians = DegreesToRadians(degrees);
}

// "wood", or {style: plain, shade: 220}.
void ReadTexture(YamlFields& fields, const std::string& key, TextureSpec* texture) {
  const YAML::Node node = fields.Child(key);
  if (!node.IsDefined()) return;
  if (node.IsScalar()) {
    *texture = TextureSpec{node.Scalar()};
    return;
  }
  YamlFields own(node, fields.PathOf(key), fields.errors());
  own.Require("style");
  own.Read("style", &texture->style);
  own.Read("shade", &texture->shade);
  own.Finish();
}

void ReadRoom(YamlFields fields, RoomSpec* room) {
  fields.Require("size");
  fields.Read("size", &room->size);
  ReadTexture(fields, "floor", &room->floor);
  ReadTexture(fields, "walls", &room->walls);
  ReadTexture(fields, "ceiling", &room->ceiling);
  fields.Read("skirting", &room->skirting);
  fields.Read("ambient", &room->ambient);
  fields.Finish();
}

LampSpec ReadLamp(YamlFields fields) {
  LampSpec lamp;
  fields.Require("at");
  fields.Read("at", &lamp.at);
  fields.Read("size", &lamp.size);
  fields.Read("power", &lamp.power);
  fields.Finish();
  return lamp;
}

// What an object of the kind is like where the file does not say.
ObjectSpec DefaultObject(ObjectKind kind) {
  ObjectSpec object;
  object.kind = kind;
  switch (kind) {
    case ObjectKind::kBox:
      break;
    case ObjectKind::kTable:
      object.size = {1.4, 0.7};
      object.height = 0.74;
      break;
    case ObjectKind::kChair:
      object.size = {0.44, 0.44};
      object.height = 0.90;
      object.texture.style = "fabric";
      break;
    case ObjectKind::kShelf:
      object.size = {0.9, 0.35};
      object.height = 1.9;
      break;
    case ObjectKind::kPillar:
      object.height = 0.0;  // up to the ceiling
      object.texture.style = "plaster";
      break;
  }
  return object;
}

ObjectSpec ReadObject(YamlFields fields, const RoomSpec& room) {
  ObjectKind kind = ObjectKind::kBox;
  fields.Require("kind");
  fields.ReadEnum("kind", {"box", "table", "chair", "shelf", "pillar"}, &kind);
  ObjectSpec object = DefaultObject(kind);
  fields.Require("at");
  fields.Read("at", &object.at);
  ReadTexture(fields, "texture", &object.texture);
  if (kind == ObjectKind::kPillar) {
    double radius = 0.5 * object.size.x();
    fields.Require("radius");
    fields.Read("radius", &radius);
    object.size = {2.0 * radius, 2.0 * radius};
    object.height = room.size.z();
  } else {
    fields.Read("size", &object.size);
    ReadDegrees(fields, "yaw_deg", &object.yaw);
  }
  if (kind == ObjectKind::kBox) {
    fields.Require("size");
    fields.Require("height");
    fields.Read("bottom", &object.bottom);
  }
  if (kind == ObjectKind::kShelf) fields.Read("boards", &object.boards);
  fields.Read("height", &object.height);
  fields.Finish();
  return object;
}

PosterSpec ReadPoster(YamlFields fields) {
  PosterSpec poster;
  for (const char* key : {"wall", "along", "size"}) fields.Require(key);
  fields.ReadEnum("wall", {"south", "east", "north", "west"}, &poster.wall);
  fields.Read("along", &poster.along);
  fields.Read("height", &poster.height);
  fields.Read("size", &poster.size);
  ReadTexture(fields, "texture", &poster.texture);
  fields.Finish();
  return poster;
}

void ReadDrive(YamlFields fields, DriveSpec* drive) {
  Eigen::Vector3d start(0, 0, 0);  // m, m, deg
  fields.Require("start");
  fields.Read("start", &start);
  drive->start = Rigid2(start.x(), start.y(), DegreesToRadians(start.z()));
  const std::vector<YAML::Node> items = fields.Items("waypoints");
  for (std::size_t i = 0; i < items.size(); ++i) {
    std::vector<double> point;
    const bool pair = items[i].IsSequence() && items[i].size() == 2 &&
                      YAML::convert<std::vector<double>>::decode(items[i], point) && std::isfinite(point[0]) &&
                      std::isfinite(point[1]);
    if (pair) drive->waypoints.emplace_back(point[0], point[1]);
    if (!pair)
      fields.errors()->Report(items[i].Mark(), fmt::format("drive.waypoints[{}]", i), "expected [x, y] in metres");
  }
  fields.Read("shuffle", &drive->shuffle);
  fields.Read("laps", &drive->laps);
  fields.Read("speed", &drive->speed);
  fields.Read("sideways_speed", &drive->sideways_speed);
  fields.Read("acceleration", &drive->acceleration);
  ReadDegrees(fields, "turn_rate_deg", &drive->turn_rate);
  ReadDegrees(fields, "turn_acceleration_deg", &drive->turn_acceleration);
  fields.Read("robot_radius", &drive->robot_radius);
  fields.Finish();
}

void ReadCamera(YamlFields fields, CameraSpec* camera) {
  CameraModel& model = camera->model;
  Eigen::Vector2d focal(model.fx, model.fy), center(model.cx, model.cy), size(model.width, model.height);
  Eigen::Vector4d distortion(model.k1, model.k2, model.p1, model.p2);
  fields.Read("size", &size);
  fields.Read("focal", &focal);
  fields.Read("center", &center);
  fields.Read("distortion", &distortion);
  const bool whole = size.x() == std::floor(size.x()) && size.y() == std::floor(size.y()) && size.norm() < 1e6;
  if (!whole) fields.errors()->Report(fields.Child("size").Mark(), "camera.size", "expected whole numbers of pixels");
  if (whole)
    model = {static_cast<int>(size.x()),
             static_cast<int>(size.y()),
             focal.x(),
             focal.y(),
             center.x(),
             center.y(),
             distortion[0],
             distortion[1],
             distortion[2],
             distortion[3],
             0.0};
  fields.Read("rate", &camera->rate);
  fields.Read("position", &camera->position);
  ReadDegrees(fields, "tilt_down_deg", &camera->tilt_down);
  ReadDegrees(fields, "shake_deg", &camera->shake);
  fields.Read("noise", &camera->noise);
  fields.Read("exposure", &camera->exposure);
  fields.Finish();
}

void ReadLaser(YamlFields fields, LaserSpec* laser) {
  fields.Read("rate", &laser->rate);
  fields.Read("height", &laser->height);
  ReadDegrees(fields, "field_of_view_deg", &laser->field_of_view);
  fields.Read("beams", &laser->beams);
  fields.Read("range_max", &laser->range_max);
  fields.Read("noise", &laser->noise);
  fields.Finish();
}

void ReadOdometry(YamlFields fields, OdometrySpec* odometry) {
  fields.Read("rate", &odometry->rate);
  fields.Read("scale", &odometry->scale);
  fields.Read("yaw_scale", &odometry->yaw_scale);
  fields.Read("translation_noise", &odometry->translation_noise);
  ReadDegrees(fields, "rotation_noise_deg", &odometry->rotation_noise);
  fields.Finish();
}

World ReadWorld(const YAML::Node& root, YamlErrors* errors) {
  World world;
  YamlFields fields(root, "", errors);
  const auto section = [&fields, errors](const std::string& key) { return YamlFields(fields.Child(key), key, errors); };
  const auto item = [errors](const YAML::Node& node, const char* list, std::size_t i) {
    return YamlFields(node, fmt::format("{}[{}]", list, i), errors);
  };
  fields.Require("room");
  fields.Require("drive");
  if (fields.Has("room")) ReadRoom(section("room"), &world.room);
  const std::vector<YAML::Node> lamps = fields.Items("lamps");
  for (std::size_t i = 0; i < lamps.size(); ++i) world.lamps.push_back(ReadLamp(item(lamps[i], "lamps", i)));
  const std::vector<YAML::Node> objects = fields.Items("objects");
  for (std::size_t i = 0; i < objects.size(); ++i) {
    world.objects.push_back(ReadObject(item(objects[i], "objects", i), world.room));
  }
  const std::vector<YAML::Node> posters = fields.Items("posters");
  for (std::size_t i = 0; i < posters.size(); ++i) world.posters.push_back(ReadPoster(item(posters[i], "posters", i)));
  if (fields.Has("drive")) ReadDrive(section("drive"), &world.drive);
  if (fields.Child("camera").IsDefined()) ReadCamera(section("camera"), &world.camera);
  if (fields.Child("laser").IsDefined()) ReadLaser(section("laser"), &world.laser);
  if (fields.Child("odometry").IsDefined()) ReadOdometry(section("odometry"), &world.odometry);
  fields.Finish();
  return world;
}

// Where "objects[2].size" stands in the file, as deep as the file goes.
YAML::Mark MarkOf(const YAML::Node& root, const std::string& key) {
  YAML::Node node = root;
  std::string path = key;
  for (char& c : path) c = c == '[' || c == ']' ? '.' : c;
  std::istringstream steps(path);
  std::string step;
  while (std::getline(steps, step, '.')) {
    if (step.empty()) continue;
    const YAML::Node here = node;
    const YAML::Node next = here.IsSequence() ? here[std::stoul(step)] : here.IsMap() ? here[step] : YAML::Node();
    if (!next.IsDefined() || next.IsNull()) break;
    node.reset(next);
  }
  return node.Mark();
}

}  // namespace

Expected<World> ParseWorld(const std::string& yaml_text, const std::string& source) {
  YamlErrors errors(source);
  YAML::Node root;
  try {
    root = YAML::Load(yaml_text);
  } catch (const YAML::Exception& exception) {
    errors.Report(exception.mark, "", "expected YAML: " + exception.msg);
    return Error{*errors.first()};
  }
  World world = ReadWorld(root, &errors);
  if (!errors.first().has_value()) {
    for (const WorldProblem& problem : FindProblems(world)) {
      errors.Report(MarkOf(root, problem.key), problem.key, problem.message);
    }
  }
  if (errors.first().has_value()) return Error{*errors.first()};
  world.source = source;
  return world;
}

Expected<World> LoadWorld(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  if (std::filesystem::is_regular_file(path)) text << file.rdbuf();
  if (!file || text.str().empty()) return Error{path.string() + ": expected a readable world file (YAML)"};
  return ParseWorld(text.str(), path.string());
}

}  // namespace planar_vslam
