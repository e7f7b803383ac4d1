#include "surface_shader.h"

#include <algorithm>
#include <cstring>

namespace planar_vslam::sim {
namespace {

// Loops over lanes become vector instructions; whatever they call must be inlined into the function that is compiled
// for the instruction set.
#define PV_SIM_INLINE [[gnu::always_inline]] inline

struct Lanes {
  alignas(64) float at[kLanes];
};

PV_SIM_INLINE float Bounded(float value, float low, float high) {
  const float raised = value > low ? value : low;
  return raised < high ? raised : high;
}

// Distance along the rays and texture coordinates, 0 to 1, there.
PV_SIM_INLINE void MeetPlane(const SurfaceView& view, const LaneRays& rays, Lanes* slant, Lanes* distance, Lanes* u,
                             Lanes* v) {
  for (int i = 0; i < kLanes; ++i) {
    const float x = rays.x[i], y = rays.y[i], z = rays.z[i];
    const float facing = view.normal[0] * x + view.normal[1] * y + view.normal[2] * z;
    const float t = view.distance / facing;
    slant->at[i] = facing < 0.0f ? -facing : facing;
    distance->at[i] = t;
    u->at[i] = view.u0 + t * (view.u[0] * x + view.u[1] * y + view.u[2] * z);
    v->at[i] = view.v0 + t * (view.v[0] * x + view.v[1] * y + view.v[2] * z);
  }
}

// By the number's own exponent and mantissa (IEEE 754); the mantissa makes it at most 0.09 too small, unnoticeable
// here.
PV_SIM_INLINE float Log2(float value) {
  constexpr float kMantissa = 1.0f / static_cast<float>(1 << 23), kExponentBias = 127.0f;
  std::int32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return static_cast<float>(bits) * kMantissa - kExponentBias;
}

// log2 of the footprint in texels, at least 0.
PV_SIM_INLINE void FindDetail(const Surface& surface, const RayWidth& width, const Lanes& slant, const Lanes& distance,
                              Lanes* detail) {
  constexpr float kSteepest = 0.05f;  // of the cosine: no footprint is wider than this makes it
  const auto last = static_cast<float>(surface.texture->levels().size() - 1);
  const float texels_per_metre = surface.texels_per_metre;
  for (int i = 0; i < kLanes; ++i) {
    const float across = distance.at[i] * width.pixel_angle + width.roughness * (distance.at[i] - width.mirrored_at[i]);
    // Between the short and the long side of the footprint on a slanted face: long = short / slant.
    const float lod = Log2(across * texels_per_metre) - 0.5f * Log2(Bounded(slant.at[i], kSteepest, 1.0f));
    detail->at[i] = Bounded(lod, 0.0f, last);
  }
}

// Bilinear interpolation in one level, added up with the weight of a tent over the level's number.
PV_SIM_INLINE void AddLevel(const Texture::Level& level, const std::uint32_t* quads, float number, const Lanes& x,
                            const Lanes& y, const Lanes& detail, Lanes* sum) {
  constexpr float kUnit = 1.0f / (Texture::kOne * Texture::kOne);
  const Texture::Level l = level;
  for (int i = 0; i < kLanes; ++i) {
    int px = static_cast<int>(x.at[i] * l.scale_x) - Texture::kOne / 2;
    int py = static_cast<int>(y.at[i] * l.scale_y) - Texture::kOne / 2;
    px = px > l.low ? px : l.low, px = px < l.high_x ? px : l.high_x;
    py = py > l.low ? py : l.low, py = py < l.high_y ? py : l.high_y;
    const int ax = px & (Texture::kOne - 1), ay = py & (Texture::kOne - 1);
    const int column = px >> Texture::kFractionBits & l.mask_x, row = py >> Texture::kFractionBits & l.mask_y;
    const auto quad = static_cast<std::int32_t>(quads[(row << l.stride) + column]);
    const int a = quad & 255, b = quad >> 8 & 255, c = quad >> 16 & 255, d = quad >> 24 & 255;
    const int top = (a << Texture::kFractionBits) + ax * (b - a);
    const int bottom = (c << Texture::kFractionBits) + ax * (d - c);
    const auto value = static_cast<float>((top << Texture::kFractionBits) + ay * (bottom - top));
    const float off = detail.at[i] - number;
    sum->at[i] += kUnit * value * Bounded(1.0f - (off < 0.0f ? -off : off), 0.0f, 1.0f);
  }
}

PV_SIM_INLINE void SampleTexture(const Surface& surface, const Lanes& u, const Lanes& v, const Lanes& detail,
                                 Lanes* sum) {
  constexpr float kFarthest = 1 << 20;  // px; keeps conversions defined, whatever a grazing ray makes of u
  const float offset_x = surface.texel_offset[0], offset_y = surface.texel_offset[1];
  const float texels_x = surface.texels[0], texels_y = surface.texels[1];
  Lanes x, y;
  for (int i = 0; i < kLanes; ++i) {
    x.at[i] = Bounded(offset_x + u.at[i] * texels_x, -kFarthest, kFarthest);
    y.at[i] = Bounded(offset_y + v.at[i] * texels_y, -kFarthest, kFarthest);
    sum->at[i] = 0.0f;
  }
  constexpr float kNearlyOne = 1.0f - 1e-6f;  // rounds up when truncated
  const Texture& texture = *surface.texture;
  int finest = static_cast<int>(texture.levels().size()), coarsest = 0;
  for (int i = 0; i < kLanes; ++i) {
    const int lower = static_cast<int>(detail.at[i]), upper = static_cast<int>(detail.at[i] + kNearlyOne);
    finest = finest < lower ? finest : lower;
    coarsest = coarsest > upper ? coarsest : upper;
  }
  for (int number = finest; number <= coarsest; ++number) {
    const Texture::Level& level = texture.levels()[static_cast<std::size_t>(number)];
    AddLevel(level, texture.quads(level), static_cast<float>(number), x, y, detail, sum);
  }
}

// Multiplies by the light map.
PV_SIM_INLINE void Light(const Surface& surface, const float* light, const Lanes& u, const Lanes& v, Lanes* grey) {
  const int last_column = surface.light_columns - 1, last_row = surface.light_rows - 1;
  const float* nodes = light + surface.light_offset;
  for (int i = 0; i < kLanes; ++i) {
    const float column = Bounded(u.at[i], 0.0f, 1.0f) * static_cast<float>(last_column);
    const float row = Bounded(v.at[i], 0.0f, 1.0f) * static_cast<float>(last_row);
    int c = static_cast<int>(column), r = static_cast<int>(row);
    c = c < last_column ? c : last_column - 1, r = r < last_row ? r : last_row - 1;
    const float ac = column - static_cast<float>(c), ar = row - static_cast<float>(r);
    const int node = r * surface.light_columns + c, below = node + surface.light_columns;
    const float upper = nodes[node] + ac * (nodes[node + 1] - nodes[node]);
    const float lower = nodes[below] + ac * (nodes[below + 1] - nodes[below]);
    grey->at[i] *= upper + ar * (lower - upper);
  }
}

PV_SIM_INLINE void ShadeLanes(const SurfaceView& view, const float* light, const LaneRays& rays, const RayWidth& width,
                              LaneGreys* result) {
  Lanes slant, distance, u, v, detail, grey;
  MeetPlane(view, rays, &slant, &distance, &u, &v);
  FindDetail(*view.surface, width, slant, distance, &detail);
  SampleTexture(*view.surface, u, v, detail, &grey);
  Light(*view.surface, light, u, v, &grey);
  std::copy_n(grey.at, kLanes, result->grey);
  std::copy_n(distance.at, kLanes, result->distance);
}

#if defined(__x86_64__)
// Without fused multiplication, so that the result does not depend on the processor.
[[gnu::target("avx2")]] void ShadeAvx2(const SurfaceView& view, const float* light, const LaneRays& rays,
                                       const RayWidth& width, LaneGreys* result) {
  ShadeLanes(view, light, rays, width, result);
}
#endif

void ShadeAnywhere(const SurfaceView& view, const float* light, const LaneRays& rays, const RayWidth& width,
                   LaneGreys* result) {
  ShadeLanes(view, light, rays, width, result);
}

}  // namespace

SurfaceView View(const Surface& surface, const Eigen::Matrix3f& R_world_viewer, const Eigen::Vector3f& origin) {
  SurfaceView view;
  view.surface = &surface;
  const Eigen::Vector3f to_corner = surface.corner - origin;
  view.distance = surface.normal.dot(to_corner);
  view.u0 = -surface.per_u.dot(to_corner);
  view.v0 = -surface.per_v.dot(to_corner);
  Eigen::Map<Eigen::Vector3f>(view.normal) = R_world_viewer.transpose() * surface.normal;
  Eigen::Map<Eigen::Vector3f>(view.u) = R_world_viewer.transpose() * surface.per_u;
  Eigen::Map<Eigen::Vector3f>(view.v) = R_world_viewer.transpose() * surface.per_v;
  return view;
}

void Shade(const SurfaceView& view, const float* light, const LaneRays& rays, const RayWidth& width,
           LaneGreys* result) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return ShadeAvx2(view, light, rays, width, result);
#endif
  ShadeAnywhere(view, light, rays, width, result);
}

}  // namespace planar_vslam::sim
