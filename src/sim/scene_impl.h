#pragma once
// What a Scene is made of. Private to this module: the camera and the laser cast their rays here.
#include <Eigen/Core>
#include <array>
#include <deque>
#include <vector>

#include "planar_vslam/sim/scene.h"
#include "ray_queries.h"
#include "texture.h"

namespace planar_vslam {

// One flat textured face. A point p on it has coordinates u = (p - corner) . per_u and v likewise, 0 to 1 over the
// face, u to the right and v down as seen from the lit side.
struct Surface {
  std::array<Eigen::Vector3f, 4> corners;  // world, m
  Eigen::Vector3f corner, per_u, per_v, normal;
  Eigen::Vector2f size;  // m, along u and v
  const sim::Texture* texture = nullptr;
  Eigen::Vector2f texel_offset, texels;  // texture coordinates: offset + (u, v) * texels
  float texels_per_metre = 1.0f;
  float glow = 0.0f;                      // where positive: factor on its grey level, whatever the light
  float gloss = 0.0f;                     // share of the light from straight above that it mirrors
  float roughness = 0.0f;                 // rad, how far mirror images are blurred
  int light_columns = 0, light_rows = 0;  // nodes of its light map, at least 2 by 2
  std::size_t light_offset = 0;           // of its first node
};

// A face of a walker, in its own frame: x ahead, on the floor.
struct WalkerFace {
  std::size_t walker = 0;
  double step = 0.0;  // 1 on the leg that is ahead when the stride is positive, -1 on the other, 0 elsewhere
  Surface surface;
};

struct SceneImpl {
  SceneImpl(const World& world, std::uint64_t seed);
  ~SceneImpl();
  SceneImpl(const SceneImpl&) = delete;
  SceneImpl& operator=(const SceneImpl&) = delete;

  // Moves the walkers' faces.
  void Place(const std::vector<Walker>& walkers);

  std::deque<sim::Texture> textures;  // a deque: surfaces point into it
  std::vector<Surface> surfaces;      // solids first, then pictures, then walkers
  std::size_t solid_count = 0;        // a ray's primitive is twice the index of the surface, or one more
  std::size_t still_count = 0;        // solids and pictures
  std::vector<float> light;           // factors on the grey level at the nodes of all light maps
  RTCDevice device = nullptr;
  RTCScene solids = nullptr;      // what the laser meets and what casts shadows
  RTCScene everything = nullptr;  // with the pictures on the walls
  RTCScene moving = nullptr;      // the walkers; its primitives count from still_count; null where nobody walks
  RTCGeometry moving_faces = nullptr;
  std::vector<WalkerFace> walker_faces;  // of each surface from still_count on
};

namespace sim {

// The faces of a world with their textures: walls, objects, then pictures, then walkers.
void BuildSurfaces(const World& world, std::uint64_t seed, SceneImpl* scene);

// Fills the light maps of what stands still; needs `solids` ready for rays.
void BakeLight(const World& world, SceneImpl* scene);

}  // namespace sim
}  // namespace planar_vslam
