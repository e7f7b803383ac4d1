#pragma once
// Worlds by name: the one way command line and node choose what is simulated.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

struct WorldChoice {
  std::string world;              // a YAML file, the name of a shipped world, or "random"
  std::string drive = "mapping";  // as ChooseDrive knows it
  std::vector<std::string> variants;
  std::uint64_t seed = 1;  // of a random world, and of what is random in the variants
  std::string kind{};      // of a random world; empty: the seed's own
};

// The file itself, or the shipped world of that name.
Expected<std::filesystem::path> FindWorld(const std::string& world);

// Errors are one line that names the file, the kind, the drive or the variant.
Expected<World> OpenWorld(const WorldChoice& choice);

}  // namespace planar_vslam
