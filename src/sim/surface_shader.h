#pragma once
// Grey levels of one surface along many rays at once: the inner loop of the camera.
#include <Eigen/Core>

#include "scene_impl.h"

namespace planar_vslam::sim {

constexpr int kLanes = 16;  // rays at once

// A surface seen from one place: with a ray d of unit length in the axes of the viewer, the distance to its plane is
// distance / (normal . d), and the texture coordinates there are u0 + distance * (u . d), v likewise.
struct SurfaceView {
  const Surface* surface = nullptr;
  float normal[3], u[3], v[3];
  float distance, u0, v0;
};
// `R_world_viewer` may mirror.
SurfaceView View(const Surface& surface, const Eigen::Matrix3f& R_world_viewer, const Eigen::Vector3f& origin);

// Rays in the viewer's axes. All of them must meet the surface; unused ones repeat a used one.
struct LaneRays {
  alignas(64) float x[kLanes], y[kLanes], z[kLanes];
};
// How wide a ray is at distance t: t * pixel_angle, plus `roughness` * (t - mirrored_at) behind a mirror.
struct RayWidth {
  float pixel_angle = 0.0f;                    // rad
  float roughness = 0.0f;                      // rad
  alignas(64) float mirrored_at[kLanes] = {};  // m
};
struct LaneGreys {
  alignas(64) float grey[kLanes];      // levels, may pass 255
  alignas(64) float distance[kLanes];  // m
};

void Shade(const SurfaceView& view, const float* light, const LaneRays& rays, const RayWidth& width, LaneGreys* result);

}  // namespace planar_vslam::sim
