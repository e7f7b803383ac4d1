#include "eye.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam::sim {
namespace {

constexpr float kJustAfter = 1.0005f;  // of the distance of a mirror, where the mirrored world begins
constexpr float kFadeLength = 3.0f;    // m from the mirror, where half of an image is left
constexpr float kGrazing = 0.5f;       // of what Fresnel's law gives at grazing angles: floors are not polished

}  // namespace

Eye::Eye(const SceneImpl& scene, const Viewpoint& viewpoint, float pixel_angle)
    : scene_(scene), viewpoint_(viewpoint), pixel_angle_(pixel_angle) {
  std::fill_n(query_.ray.org_x, kLanes, viewpoint.origin.x());
  std::fill_n(query_.ray.org_y, kLanes, viewpoint.origin.y());
  std::fill_n(query_.ray.org_z, kLanes, viewpoint.origin.z());
  std::fill_n(query_.ray.mask, kLanes, ~0u);
}

Eye::Eye(const SceneImpl& scene, const Viewpoint& viewpoint, float pixel_angle, float roughness)
    : Eye(scene, viewpoint, pixel_angle) {
  mirrored_ = true;
  roughness_ = roughness;
}

void Eye::Look(const RayBatch& rays, Sight* sight) {
  for (int first = 0; first < rays.count; first += kLanes) {
    Trace(rays, first, std::min(kLanes, rays.count - first), sight);
  }
}

void Eye::Trace(const RayBatch& rays, int first, int count, Sight* sight) {
  const Eigen::Matrix3f& R = viewpoint_.R_world_viewer;
  for (int i = 0; i < kLanes; ++i) {
    const int ray = first + std::min(i, count - 1);
    const float x = rays.x[ray], y = rays.y[ray], z = rays.z[ray];
    query_.ray.dir_x[i] = R(0, 0) * x + R(0, 1) * y + R(0, 2) * z;
    query_.ray.dir_y[i] = R(1, 0) * x + R(1, 1) * y + R(1, 2) * z;
    query_.ray.dir_z[i] = R(2, 0) * x + R(2, 1) * y + R(2, 2) * z;
    query_.ray.tnear[i] = mirrored_at_[ray] * kJustAfter;
    query_.ray.tfar[i] = std::numeric_limits<float>::infinity();
    query_.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    valid_[i] = i < count ? -1 : 0;
  }
  IntersectNeighbours(valid_, scene_.everything, &query_);
  for (int i = 0; i < count; ++i) {
    sight->surface[first + i] = query_.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID ? kNothing : query_.hit.primID[i] / 2;
    query_.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
  if (scene_.moving == nullptr) return;
  IntersectNeighbours(valid_, scene_.moving, &query_);  // only finds what is nearer
  const auto still = static_cast<std::uint32_t>(scene_.still_count);
  for (int i = 0; i < count; ++i) {
    if (query_.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) sight->surface[first + i] = still + query_.hit.primID[i] / 2;
  }
}

// One surface after the other, all rays that meet it together.
void Eye::See(const RayBatch& rays, Sight* sight) {
  int numbers[RayBatch::kMost];
  const std::uint64_t all = rays.count == RayBatch::kMost ? ~0ULL : (1ULL << rays.count) - 1;
  for (std::uint64_t left = all; left != 0;) {
    const std::uint32_t surface = sight->surface[__builtin_ctzll(left)];
    int members = 0;
    for (int i = __builtin_ctzll(left); i < rays.count; ++i) {
      const bool member = (left >> i & 1) != 0 && sight->surface[i] == surface;
      numbers[members] = i;
      members += member ? 1 : 0;
      left &= ~(static_cast<std::uint64_t>(member) << i);
    }
    for (int first = 0; first < members; first += kLanes) {
      SeeSurface(rays, numbers + first, std::min(kLanes, members - first), sight);
    }
  }
}

void Eye::SeeSurface(const RayBatch& rays, const int* numbers, int count, Sight* sight) {
  const std::uint32_t surface = sight->surface[numbers[0]];
  if (surface == kNothing) {
    for (int i = 0; i < count; ++i) {
      sight->grey[numbers[i]] = 0.0f;
      sight->distance[numbers[i]] = std::numeric_limits<float>::infinity();
    }
    return;
  }
  if (surface != view_of_) {
    view_ = View(scene_.surfaces[surface], viewpoint_.R_world_viewer, viewpoint_.origin);
    view_of_ = surface;
  }
  LaneRays own;
  for (int i = 0; i < kLanes; ++i) {
    const int ray = numbers[i < count ? i : 0];
    own.x[i] = rays.x[ray], own.y[i] = rays.y[ray], own.z[i] = rays.z[ray];
  }
  RayWidth width;
  width.pixel_angle = pixel_angle_;
  width.roughness = roughness_;
  for (int i = 0; i < kLanes; ++i) width.mirrored_at[i] = mirrored_at_[numbers[i < count ? i : 0]];
  LaneGreys greys;
  Shade(view_, scene_.light.data(), own, width, &greys);
  for (int i = 0; i < count; ++i) {
    sight->grey[numbers[i]] = greys.grey[i];
    sight->distance[numbers[i]] = greys.distance[i];
  }
  if (view_.surface->gloss > 0.0f && !mirrored_) SeeMirrored(rays, numbers, count, sight);
}

// The mirror image of the world is the world seen by the mirror image of the eye.
void Eye::SeeMirrored(const RayBatch& rays, const int* numbers, int count, Sight* sight) {
  const Surface& surface = *view_.surface;
  const Eigen::Vector3f& n = surface.normal;
  if (mirror_of_ != view_of_) {
    const Viewpoint behind{(Eigen::Matrix3f::Identity() - 2.0f * n * n.transpose()) * viewpoint_.R_world_viewer,
                           viewpoint_.origin - 2.0f * n.dot(viewpoint_.origin - surface.corner) * n};
    mirror_.reset(new Eye(scene_, behind, pixel_angle_, surface.roughness));
    mirror_of_ = view_of_;
  }
  RayBatch own;
  Sight mirrored;
  float facing[kLanes];
  for (int i = 0; i < count; ++i) {
    const int ray = numbers[i];
    mirror_->mirrored_at_[i] = sight->distance[ray];
    facing[i] = std::abs(view_.normal[0] * rays.x[ray] + view_.normal[1] * rays.y[ray] + view_.normal[2] * rays.z[ray]);
    own.Add({rays.x[ray], rays.y[ray], rays.z[ray]});
  }
  mirror_->Look(own, &mirrored);
  mirror_->See(own, &mirrored);
  for (int i = 0; i < count; ++i) {
    // C. Schlick, "An inexpensive BRDF model for physically-based rendering", 1994. What is far from the floor fades.
    const float grazing = 1.0f - facing[i], steep = grazing * grazing * grazing * grazing * grazing;
    const float behind = mirrored.distance[i] - sight->distance[numbers[i]];
    const float share = (surface.gloss + (1.0f - surface.gloss) * steep * kGrazing) / (1.0f + behind / kFadeLength);
    // Light adds up, grey levels are about its square root.
    const float grey = sight->grey[numbers[i]], image = mirrored.grey[i];
    sight->grey[numbers[i]] = std::sqrt(grey * grey + share * image * image);
  }
}

}  // namespace planar_vslam::sim
