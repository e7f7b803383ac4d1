#pragma once
// Worlds that nobody designed: building, furniture, robot, drive and mishaps drawn from a seed. The distributions are
// in docs/random_worlds.md.
#include <cstdint>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

enum class WorldKind { kLab, kOffice, kHall, kCorridor, kWarehouse, kMixed };
const std::vector<std::string>& WorldKindNames();  // in the order above

Expected<WorldKind> ParseWorldKind(const std::string& name);
// Of a seed for which no kind is asked: six seeds in a row have each once.
WorldKind KindOfSeed(std::uint64_t seed);

// The same seed and kind give the same world, which equals what its own world file (WriteWorld) is read as. Its drive
// keeps clear of everything: PlanDrive succeeds. An error names the kind and the seed.
Expected<World> DrawWorld(std::uint64_t seed, WorldKind kind);

}  // namespace planar_vslam
