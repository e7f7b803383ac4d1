#pragma once
// A point that looks into a scene: sixteen rays at a time, first what they meet, then how bright that is.
#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "scene_impl.h"
#include "surface_shader.h"

namespace planar_vslam::sim {

constexpr std::uint32_t kNothing = ~0u;  // surface of a ray that left the world

struct Viewpoint {
  Eigen::Matrix3f R_world_viewer = Eigen::Matrix3f::Identity();
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();  // world, m
};

// Rays in the viewer's axes, unit length.
struct RayBatch {
  static constexpr int kMost = 64;
  int count = 0;
  float x[kMost], y[kMost], z[kMost];

  void Add(const Eigen::Vector3f& ray) { x[count] = ray.x(), y[count] = ray.y(), z[count] = ray.z(), ++count; }
  bool full() const { return count == kMost; }
};
// What each ray of a batch met.
struct Sight {
  std::uint32_t surface[RayBatch::kMost];
  float grey[RayBatch::kMost];      // levels, may pass 255
  float distance[RayBatch::kMost];  // m
};

class Eye {
 public:
  Eye(const SceneImpl& scene, const Viewpoint& viewpoint, float pixel_angle);

  // Finds the surfaces that the rays meet.
  void Look(const RayBatch& rays, Sight* sight);
  // Finds grey levels and distances where the rays meet sight->surface.
  void See(const RayBatch& rays, Sight* sight);

 private:
  // The rays [first, first + count).
  void Trace(const RayBatch& rays, int first, int count, Sight* sight);
  // The rays of the given numbers, which meet the same surface.
  void SeeSurface(const RayBatch& rays, const int* numbers, int count, Sight* sight);
  // Adds what a glossy surface mirrors.
  void SeeMirrored(const RayBatch& rays, const int* numbers, int count, Sight* sight);

  // An eye behind a mirror.
  Eye(const SceneImpl& scene, const Viewpoint& viewpoint, float pixel_angle, float roughness);

  const SceneImpl& scene_;
  Viewpoint viewpoint_;
  float pixel_angle_;  // rad
  std::uint32_t view_of_ = kNothing;
  SurfaceView view_{};  // of surface view_of_
  std::uint32_t mirror_of_ = kNothing;
  std::unique_ptr<Eye> mirror_;              // behind surface mirror_of_
  bool mirrored_ = false;                    // this eye looks out of a mirror ...
  float roughness_ = 0.0f;                   // ... that blurs by so many rad ...
  float mirrored_at_[RayBatch::kMost] = {};  // ... and that its rays come out of after so many metres
  alignas(64) int valid_[kLanes] = {};
  alignas(64) RTCRayHit16 query_{};
};

}  // namespace planar_vslam::sim
