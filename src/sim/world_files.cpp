#include "planar_vslam/sim/world_files.h"

#include <fmt/format.h>

#include "planar_vslam/sim/random_world.h"
#include "planar_vslam/sim/variants.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

// Where the shipped worlds may be: installed beside the executable (lib/planar_vslam -> share/planar_vslam), else in
// the source tree it was built from.
std::vector<fs::path> WorldFolders() {
  std::error_code no_executable_path;
  const fs::path executable = fs::read_symlink("/proc/self/exe", no_executable_path);
  const fs::path installed = executable.parent_path() / "../../share/planar_vslam/config/worlds";
  return {installed.lexically_normal(), fs::path(PV_SOURCE_DIR) / "config/worlds"};
}

constexpr const char* kRandom = "random";

Expected<World> FindOrDraw(const WorldChoice& choice) {
  if (choice.world != kRandom) {
    if (!choice.kind.empty()) {
      return Error{fmt::format("kind '{}': expected none, {} is no random world", choice.kind, choice.world)};
    }
    const Expected<fs::path> path = FindWorld(choice.world);
    return path ? LoadWorld(*path) : path.error();
  }
  if (choice.kind.empty()) return DrawWorld(choice.seed, KindOfSeed(choice.seed));
  const Expected<WorldKind> kind = ParseWorldKind(choice.kind);
  return kind ? DrawWorld(choice.seed, *kind) : kind.error();
}

}  // namespace

Expected<fs::path> FindWorld(const std::string& world) {
  if (fs::is_regular_file(world)) return fs::path(world);
  const std::vector<fs::path> folders = WorldFolders();
  if (!world.empty() && fs::path(world).filename() == world) {
    for (const fs::path& folder : folders) {
      const fs::path path = folder / (world + ".yaml");
      if (fs::is_regular_file(path)) return path;
    }
  }
  return Error{fmt::format("{}: expected a world file, random, or the name of a world in {}",
                           world.empty() ? "''" : world, folders.back().string())};
}

Expected<World> OpenWorld(const WorldChoice& choice) {
  Expected<World> world = FindOrDraw(choice);
  if (world) world = ChooseDrive(*world, choice.drive);
  if (world) world = ApplyVariants(*world, choice.variants, choice.seed);
  return world;
}

}  // namespace planar_vslam
