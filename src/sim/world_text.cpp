#include "planar_vslam/sim/world_text.h"

#include <cmath>

#include "robot_text.h"
#include "text_fields.h"

namespace planar_vslam {
namespace sim {
namespace {

// "wood", or {style: plain, shade: 220}.
std::string TextOf(const TextureSpec& texture) {
  if (texture.shade == TextureSpec::kDefaultShade) return texture.style;
  return FlowMap().Add("style", texture.style).Add("shade", texture.shade).text();
}

FlowMap TextOfRoom(const RoomSpec& room) {
  FlowMap map;
  map.Add("size", room.size).Add("floor", TextOf(room.floor)).Add("walls", TextOf(room.walls));
  map.Add("ceiling", TextOf(room.ceiling)).Add("skirting", room.skirting).Add("ambient", room.ambient);
  return map.Add("gloss", room.gloss).AddDegrees("roughness_deg", room.roughness);
}

FlowMap TextOfLight(const LightSpec& light) {
  FlowMap map;
  map.Add("level", light.level).Add("lamps", light.lamps).Add("windows", light.windows).Add("sun", light.sun);
  return map.AddDegrees("sun_azimuth_deg", light.sun_azimuth).AddDegrees("sun_elevation_deg", light.sun_elevation);
}

void AddInnerWall(const ObjectSpec& wall, FlowMap* map) {
  const Eigen::Vector2d half = 0.5 * wall.size.x() * Eigen::Vector2d(std::cos(wall.yaw), std::sin(wall.yaw));
  map->Add("from", Eigen::Vector2d(wall.at - half)).Add("to", Eigen::Vector2d(wall.at + half));
  map->Add("thickness", wall.size.y());
  if (!wall.name.empty()) map->Add("name", wall.name);
  std::vector<FlowMap> doorways;
  for (const DoorwaySpec& doorway : wall.doorways) {
    FlowMap one;
    doorways.push_back(one.Add("along", doorway.along).Add("width", doorway.width).Add("height", doorway.height));
  }
  if (!doorways.empty()) map->Add("doorways", doorways);
}

FlowMap TextOfObject(const ObjectSpec& object) {
  FlowMap map;
  map.Add("kind", Name(object.kind));
  if (object.kind == ObjectKind::kWall) {
    AddInnerWall(object, &map);
  } else {
    map.Add("at", object.at);
  }
  if (object.kind == ObjectKind::kPillar) map.Add("radius", 0.5 * object.size.x());
  if (object.kind != ObjectKind::kWall && object.kind != ObjectKind::kPillar)
    map.Add("size", object.size).AddDegrees("yaw_deg", object.yaw);
  if (object.kind == ObjectKind::kBox) map.Add("bottom", object.bottom);
  map.Add("height", object.height);
  if (object.kind == ObjectKind::kShelf) map.Add("boards", object.boards);
  if (object.kind == ObjectKind::kRamp) map.Add("plateau", object.plateau).Add("both_ways", object.both_ways);
  return map.Add("texture", TextOf(object.texture));
}

FlowMap TextOfPoster(const PosterSpec& poster) {
  FlowMap map;
  map.Add("wall", poster.inner_wall.empty() ? Name(poster.wall) : poster.inner_wall);
  if (!poster.inner_wall.empty()) map.Add("side", poster.left ? "left" : "right");
  map.Add("along", poster.along).Add("height", poster.height).Add("size", poster.size);
  return map.Add("texture", TextOf(poster.texture));
}

template <class Item>
std::vector<FlowMap> Each(const std::vector<Item>& items, FlowMap (*text_of)(const Item&)) {
  std::vector<FlowMap> maps;
  for (const Item& item : items) maps.push_back(text_of(item));
  return maps;
}

FlowMap TextOfLamp(const LampSpec& lamp) {
  return FlowMap().Add("at", lamp.at).Add("size", lamp.size).Add("power", lamp.power);
}

FlowMap TextOfPerson(const PersonSpec& person) {
  FlowMap map;
  map.Add("path", person.path).Add("speed", person.speed).Add("start", person.start);
  return map.Add("height", person.height);
}

}  // namespace
}  // namespace sim

std::string WriteWorld(const World& world) {
  std::string text = fmt::format("room: {}\n", sim::TextOfRoom(world.room).text());
  text += fmt::format("light: {}\n", sim::TextOfLight(world.light).text());
  text += sim::TextOfList("lamps", sim::Each(world.lamps, sim::TextOfLamp));
  text += sim::TextOfList("objects", sim::Each(world.objects, sim::TextOfObject));
  text += sim::TextOfList("ramp_objects", sim::Each(world.ramp_objects, sim::TextOfObject));
  text += sim::TextOfList("posters", sim::Each(world.posters, sim::TextOfPoster));
  text += sim::TextOfList("people", sim::Each(world.people, sim::TextOfPerson));
  text += sim::TextOfDrive("drive", world.drive);
  if (world.repeat_drive.has_value()) text += sim::TextOfDrive("repeat_drive", *world.repeat_drive);
  return text + sim::TextOfRobot(world);
}

}  // namespace planar_vslam
