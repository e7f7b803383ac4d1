#include "planar_vslam/sim/variants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/sim/drive.h"

namespace planar_vslam {
namespace {

// A number within [low, high], or the default where there is no value.
Expected<double> Number(const std::string& value, double none, double low, double high, const char* unit) {
  if (value.empty()) return none;
  std::size_t used = 0;
  double number = std::nan("");
  try {
    number = std::stod(value, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == value.size() && number >= low && number <= high) return number;
  return Error{fmt::format("expected a number from {} to {}{}, got '{}'", low, high, unit, value)};
}

struct Change {
  const std::string& value;
  std::uint64_t seed;
  World* world;
};
using Outcome = std::optional<std::string>;  // what is wrong, if anything

// Of the wall, to its outside.
double OutwardAzimuth(Wall wall) {
  switch (wall) {
    case Wall::kSouth:
      return -M_PI_2;
    case Wall::kEast:
      return 0.0;
    case Wall::kNorth:
      return M_PI_2;
    case Wall::kWest:
      break;
  }
  return M_PI;
}

// The sun shines in at an angle through the windows of the first wall that has any.
void LetTheSunIn(World* world) {
  constexpr double kAside = 25.0 * M_PI / 180.0, kElevation = 32.0 * M_PI / 180.0;  // rad
  LightSpec& light = world->light;
  light.lamps = 0.4, light.windows = 1.0;
  for (const PosterSpec& poster : world->posters) {
    if (poster.texture.style != "window" || !poster.inner_wall.empty()) continue;
    light.sun = 4.0;
    light.sun_azimuth = WrapAngle(OutwardAzimuth(poster.wall) + kAside);
    light.sun_elevation = kElevation;
    return;
  }
}

Outcome ChangeLight(const Change& change) {
  LightSpec& light = change.world->light;
  if (change.value == "lamps-off") {
    light.lamps = 0.05;  // what comes in through doors
    light.windows = 0.3;
    return {};
  }
  if (change.value == "daylight") {
    LetTheSunIn(change.world);
    return {};
  }
  const Expected<double> level = Number(change.value, std::nan(""), 0.01, 10.0, "");
  if (!level || std::isnan(*level)) {
    return fmt::format("expected lamps-off, daylight or a factor from 0.01 to 10, got '{}'", change.value);
  }
  light.level = *level;
  return {};
}

Outcome ChangeFurniture(const Change& change) {
  if (!change.value.empty()) return fmt::format("expected no value, got '{}'", change.value);
  if (MoveFurniture(change.world, change.seed) > 0) return {};
  return "expected chairs or boxes with space around them";
}

Outcome ChangeGloss(const Change& change) {
  const Expected<double> gloss = Number(change.value, 0.25, 0.0, 1.0, "");
  if (!gloss) return gloss.error().message;
  change.world->room.gloss = *gloss;
  change.world->room.roughness = 0.01;
  return {};
}

Outcome AddRamp(const Change& change) {
  World& world = *change.world;
  if (!change.value.empty()) return fmt::format("expected no value, got '{}'", change.value);
  if (world.ramp_objects.empty()) return "this world has no place for a ramp (ramp_objects)";
  world.objects.insert(world.objects.end(), world.ramp_objects.begin(), world.ramp_objects.end());
  world.ramp_objects.clear();
  return {};
}

Outcome AddSlips(const Change& change) {
  const Expected<double> rate = Number(change.value, 2.0, 0.0, 60.0, " per minute");
  if (!rate) return rate.error().message;
  change.world->events.random_slips.rate = *rate;
  return {};
}

// The rest happens at given shares of the drive.
Outcome AddSpans(const Change& change, std::vector<SpanSpec>* spans, std::initializer_list<double> shares,
                 double seconds) {
  const Expected<double> duration = Number(change.value, seconds, 0.1, 600.0, " s");
  if (!duration) return duration.error().message;
  const Expected<Drive> drive = PlanDrive(*change.world);
  if (!drive) return drive.error().message;
  for (const double share : shares) spans->push_back({share * drive->duration(), *duration});
  return {};
}
Outcome AddOcclusions(const Change& change) {
  return AddSpans(change, &change.world->events.occlusions, {0.25, 0.5, 0.75}, 4.0);
}
Outcome AddBlackout(const Change& change) { return AddSpans(change, &change.world->events.blackouts, {0.4}, 3.0); }

Outcome AddKidnap(const Change& change) {
  std::vector<SpanSpec> spans;
  const Outcome problem = AddSpans(change, &spans, {0.6}, 8.0);
  for (const SpanSpec& span : spans) change.world->events.kidnaps.push_back({span.at, span.duration});
  return problem;
}

// Cable ducts across the way.
Outcome AddBumps(const Change& change) {
  const Expected<double> height = Number(change.value, 0.015, 0.005, 0.05, " m");
  if (!height) return height.error().message;
  const Expected<Drive> drive = PlanDrive(*change.world);
  if (!drive) return drive.error().message;
  constexpr double kAhead = 0.5, kSlope = 0.03, kTop = 0.04, kWidth = 1.0;  // m
  for (const double share : {0.3, 0.65}) {
    const Rigid2 T_world_duct = drive->At(share * drive->duration()) * Rigid2(kAhead, 0.0, 0.0);
    ObjectSpec duct;
    duct.kind = ObjectKind::kRamp;
    duct.at = T_world_duct.translation;
    duct.yaw = T_world_duct.angle;
    duct.height = *height;
    duct.plateau = kTop;
    duct.size = {kTop + 2.0 * std::max(kSlope, *height), kWidth};
    duct.texture = {"plain", 60};
    change.world->objects.push_back(duct);
  }
  return {};
}

Outcome AddPeople(const Change& change) {
  const Expected<double> count = Number(change.value, 1.0, 1.0, 10.0, "");
  if (!count) return count.error().message;
  for (int i = 0; i < static_cast<int>(*count); ++i) {
    if (!AddPerson(change.world, change.seed + static_cast<std::uint64_t>(i))) return "expected room to walk in";
  }
  return {};
}

struct Variant {
  const char* name;
  const char* value;
  const char* help;
  Outcome (*apply)(const Change&);
};

constexpr Variant kVariants[] = {
    {"light", "=lamps-off|daylight|FACTOR", "lamps off, sun through the windows, or all light times a factor",
     ChangeLight},
    {"moved-furniture", "", "chairs and boxes stand elsewhere", ChangeFurniture},
    {"glossy", "[=SHARE]", "the floor mirrors this share of the light from above (0.25)", ChangeGloss},
    {"ramp", "", "the world's ramp is there", AddRamp},
    {"bump", "[=METRES]", "two cable ducts of this height lie across the way (0.015)", AddBumps},
    {"slip", "[=PER_MINUTE]", "wheels spin or skid so often (2)", AddSlips},
    {"occlusion", "[=SECONDS]", "somebody crosses close in front of the robot, three times (4)", AddOcclusions},
    {"blackout", "[=SECONDS]", "the camera sees nothing for so long (3)", AddBlackout},
    {"people", "[=COUNT]", "somebody walks to and fro across the drive (1)", AddPeople},
    {"kidnap", "[=SECONDS]", "the robot is carried on by so many seconds of its drive (8)", AddKidnap},
};

}  // namespace

std::string VariantHelp() {
  std::string help;
  for (const Variant& variant : kVariants) {
    help += fmt::format("{}{}{}: {}", help.empty() ? "" : "\n", variant.name, variant.value, variant.help);
  }
  return help;
}

Expected<World> ApplyVariants(World world, const std::vector<std::string>& variants, std::uint64_t seed) {
  for (const std::string& text : variants) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : text.substr(equals + 1);
    const Variant* const found =
        std::find_if(std::begin(kVariants), std::end(kVariants), [&name](const Variant& v) { return name == v.name; });
    if (found == std::end(kVariants)) {
      std::string names;
      for (const Variant& variant : kVariants) names += fmt::format("{}{}", names.empty() ? "" : ", ", variant.name);
      return Error{fmt::format("variant '{}': expected one of {}", text, names)};
    }
    const Outcome problem = found->apply({value, seed, &world});
    if (problem.has_value()) return Error{fmt::format("variant '{}': {}", text, *problem)};
  }
  return world;
}

Expected<World> ChooseDrive(World world, const std::string& name) {
  if (name == "mapping") return world;
  if (name == "reverse") {
    world.drive = Reversed(world.drive);
    return world;
  }
  if (name != "repeat") return Error{fmt::format("drive '{}': expected mapping, repeat or reverse", name)};
  if (!world.repeat_drive.has_value()) return Error{fmt::format("{}: repeat_drive: is missing", world.source)};
  world.drive = *world.repeat_drive;
  return world;
}

}  // namespace planar_vslam
