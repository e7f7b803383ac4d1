// Worlds from YAML. The keys here are the file format; ranges and geometry are FindProblems' business.
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "planar_vslam/sim/world.h"
#include "robot_yaml.h"
#include "yaml_fields.h"

namespace planar_vslam {
namespace {

using sim::ReadDegrees;
using sim::YamlErrors;
using sim::YamlFields;

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
  fields.Read("gloss", &room->gloss);
  ReadDegrees(fields, "roughness_deg", &room->roughness);
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
    case ObjectKind::kSwivelChair:
      object.size = {0.48, 0.48};
      object.height = 0.95;
      object.texture.style = "fabric";
      break;
    case ObjectKind::kWall:
      object.height = 0.0;  // up to the ceiling
      object.texture.style = "plaster";
      break;
    case ObjectKind::kRamp:
      object.texture.style = "planks";
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

DoorwaySpec ReadDoorway(YamlFields fields) {
  DoorwaySpec doorway;
  fields.Require("along");
  fields.Read("along", &doorway.along);
  fields.Read("width", &doorway.width);
  fields.Read("height", &doorway.height);
  fields.Finish();
  return doorway;
}

// From one end to the other.
void ReadInnerWall(YamlFields& fields, const RoomSpec& room, ObjectSpec* wall) {
  Eigen::Vector2d from(0, 0), to(1, 0);
  double thickness = 0.1;  // m
  fields.Require("from");
  fields.Require("to");
  fields.Read("from", &from);
  fields.Read("to", &to);
  fields.Read("thickness", &thickness);
  fields.Read("name", &wall->name);
  wall->at = 0.5 * (from + to);
  wall->yaw = std::atan2(to.y() - from.y(), to.x() - from.x());
  wall->size = {(to - from).norm(), thickness};
  wall->height = room.size.z();
  const std::vector<YAML::Node> doorways = fields.Items("doorways");
  for (std::size_t i = 0; i < doorways.size(); ++i) {
    const std::string path = fields.PathOf(fmt::format("doorways[{}]", i));
    wall->doorways.push_back(ReadDoorway(YamlFields(doorways[i], path, fields.errors())));
  }
}

// What one kind has and others have not.
void ReadKind(YamlFields& fields, const RoomSpec& room, ObjectSpec* object) {
  switch (object->kind) {
    case ObjectKind::kPillar: {
      double radius = 0.5 * object->size.x();
      fields.Require("radius");
      fields.Read("radius", &radius);
      object->size = {2.0 * radius, 2.0 * radius};
      object->height = room.size.z();
      return;
    }
    case ObjectKind::kWall:
      return ReadInnerWall(fields, room, object);
    case ObjectKind::kBox:
      fields.Require("size");
      fields.Require("height");
      fields.Read("bottom", &object->bottom);
      break;
    case ObjectKind::kRamp:
      fields.Require("size");
      fields.Require("height");
      fields.Read("plateau", &object->plateau);
      fields.Read("both_ways", &object->both_ways);
      break;
    case ObjectKind::kShelf:
      fields.Read("boards", &object->boards);
      break;
    case ObjectKind::kTable:
    case ObjectKind::kChair:
    case ObjectKind::kSwivelChair:
      break;
  }
  fields.Read("size", &object->size);
  ReadDegrees(fields, "yaw_deg", &object->yaw);
}

ObjectSpec ReadObject(YamlFields fields, const RoomSpec& room) {
  ObjectKind kind = ObjectKind::kBox;
  fields.Require("kind");
  fields.ReadEnum("kind", {"box", "table", "chair", "swivel_chair", "shelf", "pillar", "wall", "ramp"}, &kind);
  ObjectSpec object = DefaultObject(kind);
  if (kind != ObjectKind::kWall) {
    fields.Require("at");
    fields.Read("at", &object.at);
  }
  ReadTexture(fields, "texture", &object.texture);
  ReadKind(fields, room, &object);
  fields.Read("height", &object.height);
  fields.Finish();
  return object;
}

// On a wall of the room, or on a side of the inner wall of that name.
PosterSpec ReadPoster(YamlFields fields, const std::vector<ObjectSpec>& objects) {
  PosterSpec poster;
  for (const char* key : {"wall", "along", "size"}) fields.Require(key);
  std::string wall;
  fields.Read("wall", &wall);
  const bool inner = std::any_of(objects.begin(), objects.end(),
                                 [&wall](const ObjectSpec& object) { return !wall.empty() && object.name == wall; });
  if (inner) {
    int side = 0;
    fields.Require("side");
    fields.ReadEnum("side", {"left", "right"}, &side);
    poster.inner_wall = wall;
    poster.left = side == 0;
  } else {
    fields.ReadEnum("wall", {"south", "east", "north", "west"}, &poster.wall);
  }
  fields.Read("along", &poster.along);
  fields.Read("height", &poster.height);
  fields.Read("size", &poster.size);
  ReadTexture(fields, "texture", &poster.texture);
  fields.Finish();
  return poster;
}

PersonSpec ReadPerson(YamlFields fields) {
  PersonSpec person;
  fields.Require("path");
  person.path = sim::ReadPoints(fields, "path");
  fields.Read("speed", &person.speed);
  fields.Read("start", &person.start);
  fields.Read("height", &person.height);
  fields.Finish();
  return person;
}

void ReadLight(YamlFields fields, LightSpec* light) {
  fields.Read("level", &light->level);
  fields.Read("lamps", &light->lamps);
  fields.Read("windows", &light->windows);
  fields.Read("sun", &light->sun);
  ReadDegrees(fields, "sun_azimuth_deg", &light->sun_azimuth);
  ReadDegrees(fields, "sun_elevation_deg", &light->sun_elevation);
  fields.Finish();
}

World ReadWorld(const YAML::Node& root, YamlErrors* errors) {
  World world;
  YamlFields fields(root, "", errors);
  const auto section = [&fields, errors](const std::string& key) { return YamlFields(fields.Child(key), key, errors); };
  // Calls read(item) for every item of a list.
  const auto each = [&fields, errors](const char* list, const auto& read) {
    const std::vector<YAML::Node> items = fields.Items(list);
    for (std::size_t i = 0; i < items.size(); ++i) read(YamlFields(items[i], fmt::format("{}[{}]", list, i), errors));
  };
  fields.Require("room");
  fields.Require("drive");
  if (fields.Has("room")) ReadRoom(section("room"), &world.room);
  each("lamps", [&world](const YamlFields& item) { world.lamps.push_back(ReadLamp(item)); });
  each("objects", [&world](const YamlFields& item) { world.objects.push_back(ReadObject(item, world.room)); });
  each("ramp_objects",
       [&world](const YamlFields& item) { world.ramp_objects.push_back(ReadObject(item, world.room)); });
  each("posters", [&world](const YamlFields& item) { world.posters.push_back(ReadPoster(item, world.objects)); });
  each("people", [&world](const YamlFields& item) { world.people.push_back(ReadPerson(item)); });
  if (fields.Child("light").IsDefined()) ReadLight(section("light"), &world.light);
  if (fields.Has("drive")) sim::ReadDrive(section("drive"), &world.drive);
  if (fields.Child("repeat_drive").IsDefined()) {
    world.repeat_drive.emplace();
    sim::ReadDrive(section("repeat_drive"), &*world.repeat_drive);
  }
  if (fields.Child("limits").IsDefined()) sim::ReadLimits(section("limits"), &world.limits);
  if (fields.Child("camera").IsDefined()) sim::ReadCamera(section("camera"), &world.camera);
  if (fields.Child("head").IsDefined()) sim::ReadHead(section("head"), &world.head);
  if (fields.Child("laser").IsDefined()) sim::ReadLaser(section("laser"), &world.laser);
  if (fields.Child("odometry").IsDefined()) sim::ReadOdometry(section("odometry"), &world.odometry);
  if (fields.Child("events").IsDefined()) sim::ReadEvents(section("events"), &world.events);
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
