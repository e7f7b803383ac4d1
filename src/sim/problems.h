#pragma once
// Collects what makes a world impossible.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "planar_vslam/sim/solids.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam::sim {

// Bounds against typing errors.
constexpr double kLargestRoom = 100.0;   // m
constexpr double kLargestRate = 1000.0;  // Hz
constexpr double kLongest = 1e5;         // s

class Problems {
 public:
  void Add(const std::string& key, const std::string& message) { list_.push_back({key, message}); }
  // Also refuses what is not a number.
  void Range(const std::string& key, double value, double low, double high, const char* unit = "") {
    if (value >= low && value <= high) return;
    const std::string space = *unit == '\0' ? "" : " ";
    Add(key, fmt::format("expected {} to {}{}{}, got {}", low, high, space, unit, value));
  }
  void Inside(const std::string& key, const Eigen::Vector2d& point, const RoomSpec& room) {
    const bool inside = point.x() >= 0 && point.y() >= 0 && point.x() <= room.size.x() && point.y() <= room.size.y();
    if (inside) return;
    Add(key, fmt::format("expected a point inside the room of {} x {} m, got [{}, {}]", room.size.x(), room.size.y(),
                         point.x(), point.y()));
  }
  void Texture(const std::string& key, const TextureSpec& texture) {
    const auto contains = [&texture](const std::vector<std::string>& styles) {
      return std::find(styles.begin(), styles.end(), texture.style) != styles.end();
    };
    const bool picture = contains(PictureStyles());
    if (!picture && !contains(SurfaceStyles())) {
      Add(key, fmt::format("expected one of {}, {}, got '{}'", fmt::join(SurfaceStyles(), ", "),
                           fmt::join(PictureStyles(), ", "), texture.style));
    }
    if (texture.shade == TextureSpec::kDefaultShade) return;
    if (picture) Add(key, fmt::format("expected no shade for the picture '{}'", texture.style));
    if (texture.shade < 0 || texture.shade > 255) {
      Add(key, fmt::format("expected a shade of 0 to 255, got {}", texture.shade));
    }
  }
  std::vector<WorldProblem> Take() { return std::move(list_); }

 private:
  std::vector<WorldProblem> list_;
};

void CheckRobot(const World& world, Problems& problems);
void CheckEvents(const World& world, Problems& problems);

}  // namespace planar_vslam::sim
