// Light baked into maps: lamps with soft shadows, plus light from everywhere that corners get less of.
#include <algorithm>
#include <cmath>

#include "planar_vslam/sim/random.h"
#include "scene_impl.h"

namespace planar_vslam::sim {
namespace {

using Eigen::Vector3f;

constexpr int kLampSamples = 3;  // per side of a lamp
constexpr int kAmbientRays = 24;
constexpr float kAmbientReach = 1.2f;  // m; what is farther does not darken
constexpr float kInset = 0.004f;       // share of a face: outermost nodes lie a little inside it
constexpr float kLift = 0.006f;        // m, rays start off the face (pictures stand off up to this much)
// The mean light makes a surface show this share of its grey level, as an exposure control would settle.
constexpr double kMeanFactor = 0.80;
constexpr double kDisplayGamma = 2.2;
constexpr float kLargestFactor = 1.25f;  // brighter would only saturate

bool Occluded(const SceneImpl& scene, const Vector3f& from, const Vector3f& direction, float length) {
  RTCRay ray{};
  ray.org_x = from.x(), ray.org_y = from.y(), ray.org_z = from.z();
  ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
  ray.tfar = length;
  ray.mask = ~0u;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene.solids, &context, &ray);
  return ray.tfar < 0.0f;  // Embree's sign of a hit
}

// Lambert's law between the face and points spread over the lamp.
float LightFromLamp(const SceneImpl& scene, const LampSpec& lamp, float ceiling, const Vector3f& point,
                    const Vector3f& normal) {
  float light = 0.0f;
  for (int i = 0; i < kLampSamples * kLampSamples; ++i) {
    const int column = i % kLampSamples, row = i / kLampSamples;
    const double a = (column + 0.5) / kLampSamples - 0.5, b = (row + 0.5) / kLampSamples - 0.5;
    const Eigen::Vector2d at = lamp.at + Eigen::Vector2d(a, b).cwiseProduct(lamp.size);
    const Vector3f to_lamp = Vector3f(static_cast<float>(at.x()), static_cast<float>(at.y()), ceiling - kLift) - point;
    if (to_lamp.z() <= 0.0f || to_lamp.dot(normal) <= 0.0f) continue;  // behind the lamp or the face
    const float distance = to_lamp.norm();
    const Vector3f direction = to_lamp / distance;
    if (Occluded(scene, point, direction, distance)) continue;
    const float leaving = direction.z(), arriving = direction.dot(normal);
    // Close to a lamp its size counts: the point-light formula would blow up.
    light += leaving * arriving / std::max(distance * distance, 0.25f);
  }
  return static_cast<float>(lamp.power) * light / (kLampSamples * kLampSamples);
}

// Share of the half space over the face from which nothing near keeps the light.
float Openness(const SceneImpl& scene, const Vector3f& point, const Vector3f& normal) {
  const Vector3f side = normal.unitOrthogonal(), other = normal.cross(side);
  constexpr double kGoldenAngle = 2.399963229728653;  // rad, spreads the directions evenly
  int open = 0;
  for (int i = 0; i < kAmbientRays; ++i) {
    const double radius = std::sqrt((i + 0.5) / kAmbientRays), angle = kGoldenAngle * i;
    const auto x = static_cast<float>(radius * std::cos(angle)), y = static_cast<float>(radius * std::sin(angle));
    const auto z = static_cast<float>(std::sqrt(1.0 - radius * radius));
    const Vector3f direction = x * side + y * other + z * normal;
    if (!Occluded(scene, point, direction, kAmbientReach)) ++open;
  }
  return static_cast<float>(open) / kAmbientRays;
}

// Linear light of the lamps, then of the surroundings, at all nodes of a face.
struct NodeLight {
  float lamps, open;
};

NodeLight LightAt(const World& world, const SceneImpl& scene, const Surface& surface, int column, int row) {
  const auto place = [](int index, int count) {
    return std::clamp(static_cast<float>(index) / static_cast<float>(count - 1), kInset, 1.0f - kInset);
  };
  const Vector3f right = surface.per_u / surface.per_u.squaredNorm(),
                 down = surface.per_v / surface.per_v.squaredNorm();
  const Vector3f point = surface.corner + place(column, surface.light_columns) * right +
                         place(row, surface.light_rows) * down + kLift * surface.normal;
  NodeLight light{0.0f, Openness(scene, point, surface.normal)};
  const auto ceiling = static_cast<float>(world.room.size.z());
  for (const LampSpec& lamp : world.lamps) light.lamps += LightFromLamp(scene, lamp, ceiling, point, surface.normal);
  return light;
}

// Mean over the walls, floor and ceiling, the first faces of every scene.
NodeLight MeanOverRoom(const SceneImpl& scene, const std::vector<NodeLight>& nodes) {
  constexpr std::size_t kRoomFaces = 6;
  const std::size_t count = scene.surfaces[kRoomFaces - 1].light_offset +
                            static_cast<std::size_t>(scene.surfaces[kRoomFaces - 1].light_columns *
                                                     scene.surfaces[kRoomFaces - 1].light_rows);
  double lamps = 0.0, open = 0.0;
  for (std::size_t i = 0; i < count; ++i) lamps += nodes[i].lamps, open += nodes[i].open;
  const auto n = static_cast<double>(count);
  return {static_cast<float>(lamps / n), static_cast<float>(open / n)};
}

}  // namespace

void BakeLight(const World& world, SceneImpl* scene) {
  std::vector<NodeLight> nodes(scene->light.size(), NodeLight{0.0f, 0.0f});
  for (const Surface& surface : scene->surfaces) {
    if (surface.glowing) continue;
    std::size_t node = surface.light_offset;
    for (int row = 0; row < surface.light_rows; ++row) {
      for (int column = 0; column < surface.light_columns; ++column)
        nodes[node++] = LightAt(world, *scene, surface, column, row);
    }
  }
  const NodeLight mean = MeanOverRoom(*scene, nodes);
  // A room without lamps has only the light from everywhere.
  const double ambient = mean.lamps > 0.0f ? world.room.ambient : 1.0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double from_lamps =
        mean.lamps > 0.0f ? (1.0 - ambient) * static_cast<double>(nodes[i].lamps / mean.lamps) : 0.0;
    const double from_around = mean.open > 0.0f ? ambient * static_cast<double>(nodes[i].open / mean.open) : ambient;
    // Grey levels are light to the power 1 / gamma, so the factor is too: (albedo * light)^(1/g) = albedo^(1/g)
    // light^(1/g).
    const double factor = kMeanFactor * std::pow(from_lamps + from_around, 1.0 / kDisplayGamma);
    scene->light[i] = std::min(kLargestFactor, static_cast<float>(factor));
  }
}

}  // namespace planar_vslam::sim
