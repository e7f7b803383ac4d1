// Light baked into maps: lamps with soft shadows, plus light from everywhere that corners get less of.
#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_vslam/sim/random.h"
#include "scene_impl.h"

namespace planar_vslam::sim {
namespace {

using Eigen::Vector3f;

constexpr int kSourceSamples = 3;  // per side of a lamp or window
constexpr int kAmbientRays = 24;
constexpr float kAmbientReach = 1.2f;  // m; what is farther does not darken
constexpr float kInset = 0.004f;       // share of a face: outermost nodes lie a little inside it
constexpr float kLift = 0.006f;        // m, rays start off the face (pictures stand off up to this much)
// The mean light makes a surface show this share of its grey level, as an exposure control would settle.
constexpr double kMeanFactor = 0.80;
constexpr double kDisplayGamma = 2.2;
constexpr float kLargestFactor = 2.5f;  // what is in the sun; brighter would only saturate more

bool Occluded(const SceneImpl& scene, const Vector3f& from, const Vector3f& direction, float length) {
  RTCRay ray{};
  ray.org_x = from.x(), ray.org_y = from.y(), ray.org_z = from.z();
  ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
  ray.tfar = length;
  ray.mask = ~0u;
  return Occludes(scene.solids, &ray);
}

// A flat source of light: `normal` is the way it shines.
struct Source {
  Vector3f corner, right, down, normal;
  float power;
};

Source SourceOf(const LampSpec& lamp, const RoomSpec& room) {
  const Eigen::Vector2d corner = lamp.at - 0.5 * lamp.size;
  return {Eigen::Vector3d(corner.x(), corner.y(), room.size.z() - static_cast<double>(kLift)).cast<float>(),
          {static_cast<float>(lamp.size.x()), 0.0f, 0.0f},
          {0.0f, static_cast<float>(lamp.size.y()), 0.0f},
          {0.0f, 0.0f, -1.0f},
          static_cast<float>(lamp.power)};
}

// Windows are known by their pictures: those that glow with a texture.
Source SourceOf(const Surface& window) {
  const Vector3f right = window.per_u / window.per_u.squaredNorm(), down = window.per_v / window.per_v.squaredNorm();
  return {window.corner + kLift * window.normal, right, down, window.normal, right.norm() * down.norm()};
}

// Lambert's law between the face and points spread over the source.
float LightFrom(const SceneImpl& scene, const Source& source, const Vector3f& point, const Vector3f& normal) {
  float light = 0.0f;
  for (int i = 0; i < kSourceSamples * kSourceSamples; ++i) {
    const float a = (static_cast<float>(i % kSourceSamples) + 0.5f) / kSourceSamples;
    const float b = (static_cast<float>(i / kSourceSamples) + 0.5f) / kSourceSamples;
    const Vector3f to_source = source.corner + a * source.right + b * source.down - point;
    if (to_source.dot(source.normal) >= 0.0f || to_source.dot(normal) <= 0.0f) continue;  // behind it or the face
    const float distance = to_source.norm();
    const Vector3f direction = to_source / distance;
    if (Occluded(scene, point, direction, distance)) continue;
    const float leaving = -direction.dot(source.normal), arriving = direction.dot(normal);
    // Close to a lamp its size counts: the point-light formula would blow up.
    light += leaving * arriving / std::max(distance * distance, 0.25f);
  }
  return source.power * light / (kSourceSamples * kSourceSamples);
}

// Lambert's law for the sun, where it shines in through a window.
float LightFromSun(const SceneImpl& scene, const std::vector<Source>& windows, const Vector3f& to_sun,
                   const Vector3f& point, const Vector3f& normal) {
  const float arriving = to_sun.dot(normal);
  if (arriving <= 0.0f) return 0.0f;
  for (const Source& window : windows) {
    const float leaving = -to_sun.dot(window.normal);
    if (leaving <= 0.0f) continue;
    const float distance = (point - window.corner).dot(window.normal) / leaving;
    const Vector3f in_window = point + distance * to_sun - window.corner;
    const float u = in_window.dot(window.right) / window.right.squaredNorm();
    const float v = in_window.dot(window.down) / window.down.squaredNorm();
    if (distance <= 0.0f || std::min(u, v) < 0.0f || std::max(u, v) > 1.0f) continue;
    return Occluded(scene, point, to_sun, distance) ? 0.0f : arriving;
  }
  return 0.0f;
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

// Linear light of the lamps, the windows, the sun and the surroundings, at a node.
struct NodeLight {
  float lamps = 0.0f, windows = 0.0f, sun = 0.0f, open = 0.0f;
};

struct Sources {
  std::vector<Source> lamps, windows;
  Vector3f to_sun;
};

NodeLight LightAt(const World& world, const SceneImpl& scene, const Sources& sources, const Surface& surface,
                  int column, int row) {
  const auto place = [](int index, int count) {
    return std::clamp(static_cast<float>(index) / static_cast<float>(count - 1), kInset, 1.0f - kInset);
  };
  const Vector3f right = surface.per_u / surface.per_u.squaredNorm(),
                 down = surface.per_v / surface.per_v.squaredNorm();
  const Vector3f point = surface.corner + place(column, surface.light_columns) * right +
                         place(row, surface.light_rows) * down + kLift * surface.normal;
  NodeLight light;
  light.open = Openness(scene, point, surface.normal);
  for (const Source& lamp : sources.lamps) light.lamps += LightFrom(scene, lamp, point, surface.normal);
  if (world.light.windows > 0.0) {
    for (const Source& window : sources.windows) light.windows += LightFrom(scene, window, point, surface.normal);
  }
  if (world.light.sun > 0.0) {
    light.sun = LightFromSun(scene, sources.windows, sources.to_sun, point, surface.normal);
  }
  return light;
}

// Mean over the walls, floor and ceiling, the first faces of every scene.
NodeLight MeanOverRoom(const SceneImpl& scene, const std::vector<NodeLight>& nodes) {
  constexpr std::size_t kRoomFaces = 6;
  const std::size_t count = scene.surfaces[kRoomFaces - 1].light_offset +
                            static_cast<std::size_t>(scene.surfaces[kRoomFaces - 1].light_columns *
                                                     scene.surfaces[kRoomFaces - 1].light_rows);
  double lamps = 0.0, windows = 0.0, open = 0.0;
  for (std::size_t i = 0; i < count; ++i) lamps += nodes[i].lamps, windows += nodes[i].windows, open += nodes[i].open;
  const auto n = static_cast<double>(count);
  return {static_cast<float>(lamps / n), static_cast<float>(windows / n), 0.0f, static_cast<float>(open / n)};
}

Sources FindSources(const World& world, const SceneImpl& scene) {
  Sources sources;
  for (const LampSpec& lamp : world.lamps) sources.lamps.push_back(SourceOf(lamp, world.room));
  // The posters are the last still faces but the lamps.
  const std::size_t first = scene.still_count - world.lamps.size() - world.posters.size();
  for (std::size_t i = 0; i < world.posters.size(); ++i) {
    if (world.posters[i].texture.style == "window") sources.windows.push_back(SourceOf(scene.surfaces[first + i]));
  }
  const double elevation = world.light.sun_elevation, azimuth = world.light.sun_azimuth;
  sources.to_sun = Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                   std::sin(elevation))
                       .cast<float>();
  return sources;
}

}  // namespace

void BakeLight(const World& world, SceneImpl* scene) {
  std::vector<NodeLight> nodes(scene->light.size());
  const Sources sources = FindSources(world, *scene);
  for (std::size_t i = 0; i < scene->still_count; ++i) {
    const Surface& surface = scene->surfaces[i];
    if (surface.glow > 0.0f) continue;
    std::size_t node = surface.light_offset;
    for (int row = 0; row < surface.light_rows; ++row) {
      for (int column = 0; column < surface.light_columns; ++column)
        nodes[node++] = LightAt(world, *scene, sources, surface, column, row);
    }
  }
  const NodeLight mean = MeanOverRoom(*scene, nodes);
  const auto relative = [](float light, float average) {
    return average > 0.0f ? static_cast<double>(light / average) : 0.0;
  };
  const LightSpec& light = world.light;
  // A room without lamps and windows has only the light from everywhere.
  const bool lit = mean.lamps > 0.0f || mean.windows > 0.0f;
  const double lamps = mean.lamps > 0.0f ? light.lamps : 0.0, windows = mean.windows > 0.0f ? light.windows : 0.0;
  const double ambient = lit ? world.room.ambient : 1.0, direct = 1.0 - ambient;
  const double around = lit ? ambient * (lamps + windows) : light.lamps;
  for (std::size_t i = 0; i < scene->still_count; ++i) {
    const Surface& surface = scene->surfaces[i];
    const auto count = static_cast<std::size_t>(surface.light_columns * surface.light_rows);
    if (surface.glow > 0.0f) continue;
    for (std::size_t node = surface.light_offset; node < surface.light_offset + count; ++node) {
      const NodeLight& here = nodes[node];
      const double total = direct * lamps * relative(here.lamps, mean.lamps) +
                           direct * windows * relative(here.windows, mean.windows) +
                           around * relative(here.open, mean.open) + light.sun * static_cast<double>(here.sun);
      // Grey levels are light to the power 1 / gamma, so the factor is too: (albedo * light)^(1/g) = albedo^(1/g)
      // light^(1/g).
      const double factor = kMeanFactor * std::pow(light.level * total, 1.0 / kDisplayGamma);
      scene->light[node] = std::min(kLargestFactor, static_cast<float>(factor));
    }
  }
}

}  // namespace planar_vslam::sim
