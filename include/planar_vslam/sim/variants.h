#pragma once
// Another day in the same world: other light, moved furniture, mishaps.
#include <cstdint>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

// The names with their values and what they do, a line each.
std::string VariantHelp();

// "NAME" or "NAME=VALUE", in order. What is random depends on the seed alone. Errors say which variant and what was
// expected.
Expected<World> ApplyVariants(World world, const std::vector<std::string>& variants, std::uint64_t seed);

// "mapping" keeps the world's drive, "repeat" takes its repeat_drive, "reverse" leads its drive from the end to the
// start.
Expected<World> ChooseDrive(World world, const std::string& name);

// Shifts and turns chairs and boxes, as far as the drives, the room and the other things leave space. Returns how many.
int MoveFurniture(World* world, std::uint64_t seed);

// Somebody walks to and fro across the world's drive, straight, where the floor is free, and never meets a robot that
// keeps to its times. False where no such way was found.
bool AddPerson(World* world, std::uint64_t seed);

}  // namespace planar_vslam
