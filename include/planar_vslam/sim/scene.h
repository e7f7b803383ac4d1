#pragma once
// A world ready for rays: textured, lit quadrilaterals in a ray-tracing acceleration structure.
#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "planar_vslam/sim/world.h"

namespace planar_vslam {

struct SceneImpl;

// Where somebody walks.
struct Walker {
  Rigid2 T_world_walker;  // x ahead
  double stride = 0.0;    // m, how far one foot is ahead of the other
  double floor = 0.0;     // m, height of what they stand on
  bool present = true;
};
// The person's place at `time` seconds.
Walker WalkerAt(const PersonSpec& person, double time);

class Scene {
 public:
  // Draws the textures from `seed` and bakes the light. Needs FindProblems(world).empty().
  Scene(const World& world, std::uint64_t seed);
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  // The world's people in their order, then whoever occludes the camera. At first nobody is present.
  void Place(const std::vector<Walker>& walkers);

  // Distance from `origin` along the unit `direction` to the nearest solid (walls, objects and people, not posters);
  // infinity beyond `max_range`. Metres, world frame.
  double Range(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_range) const;

  const SceneImpl& impl() const { return *impl_; }

 private:
  std::unique_ptr<SceneImpl> impl_;
};

}  // namespace planar_vslam
