#pragma once
// A world ready for rays: textured, lit quadrilaterals in a ray-tracing acceleration structure.
#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "planar_vslam/sim/world.h"

namespace planar_vslam {

struct SceneImpl;

class Scene {
 public:
  // Draws the textures from `seed` and bakes the light. Needs FindProblems(world).empty().
  Scene(const World& world, std::uint64_t seed);
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  // Distance from `origin` along the unit `direction` to the nearest solid (walls and objects, not posters); infinity
  // beyond `max_range`. Metres, world frame.
  double Range(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_range) const;

  const SceneImpl& impl() const { return *impl_; }

 private:
  std::unique_ptr<SceneImpl> impl_;
};

}  // namespace planar_vslam
