// From a world to textured faces.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "patterns.h"
#include "planar_vslam/geometry/check.h"
#include "planar_vslam/sim/random.h"
#include "planar_vslam/sim/solids.h"
#include "scene_impl.h"

namespace planar_vslam::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// What the camera resolves at about 1.2 m with a focal length of 600 px.
constexpr double kTexel = 0.002;             // m, of surface styles
constexpr double kPictureTexel = 0.0016;     // m
constexpr int kRoomTexture = 2048;           // px, repeats after 4.1 m
constexpr int kObjectTexture = 512;          // px, repeats after 1.0 m
constexpr int kPlainTexture = 16;            // px, the same grey everywhere
constexpr int kLargestPicture = 1024;        // px
constexpr double kPictureThickness = 0.002;  // m, how far pictures stand off the wall
constexpr double kLightNode = 0.10;          // m between the nodes of a light map ...
constexpr double kLightNodes = 100.0;        // ... but no more of them than this along a square face
constexpr float kDaylightGlow = 1.5f;        // of a window's grey level by day: most of it is beyond white

int PowerOfTwo(double at_least) {
  int size = 32;
  while (size < at_least && size < kLargestPicture) size *= 2;
  return size;
}

class SurfaceBuilder {
 public:
  SurfaceBuilder(std::uint64_t seed, SceneImpl* scene) : seed_(MixSeed(seed, RandomStream::kTexture)), scene_(scene) {}

  // The parallelogram from its upper left corner along `right` and `down`, as seen from the lit side.
  Surface& Add(const Vector3d& corner, const Vector3d& right, const Vector3d& down, const TextureSpec& texture,
               int repeat_px) {
    Surface surface;
    surface.corners = {corner.cast<float>(), (corner + right).cast<float>(), (corner + right + down).cast<float>(),
                       (corner + down).cast<float>()};
    surface.corner = corner.cast<float>();
    surface.per_u = (right / right.squaredNorm()).cast<float>();
    surface.per_v = (down / down.squaredNorm()).cast<float>();
    surface.normal = down.cross(right).normalized().cast<float>();
    surface.size = Vector2d(right.norm(), down.norm()).cast<float>();
    const double node = std::max(kLightNode, std::sqrt(right.norm() * down.norm()) / kLightNodes);
    surface.light_columns = std::max(2, 1 + static_cast<int>(std::ceil(right.norm() / node)));
    surface.light_rows = std::max(2, 1 + static_cast<int>(std::ceil(down.norm() / node)));
    ApplyTexture(texture, repeat_px, &surface);
    scene_->surfaces.push_back(surface);
    return scene_->surfaces.back();
  }

 private:
  void ApplyTexture(const TextureSpec& spec, int repeat_px, Surface* surface) {
    const std::uint64_t own_seed = MixSeed(seed_, scene_->surfaces.size());
    const std::vector<std::string>& pictures = PictureStyles();
    if (std::find(pictures.begin(), pictures.end(), spec.style) != pictures.end()) {
      const double width = surface->size.x(), height = surface->size.y();
      const cv::Size size(PowerOfTwo(width / kPictureTexel), PowerOfTwo(height / kPictureTexel));
      scene_->textures.emplace_back(DrawPicture(spec.style, size, width, height, own_seed), TextureEdge::kClamp);
      surface->texture = &scene_->textures.back();
      surface->texel_offset.setZero();
      surface->texels = Eigen::Vector2f(static_cast<float>(size.width), static_cast<float>(size.height));
      surface->texels_per_metre = static_cast<float>(std::max(size.width / width, size.height / height));
      return;
    }
    surface->texture = Repeating(spec, repeat_px);
    surface->texels_per_metre = static_cast<float>(1.0 / kTexel);
    surface->texels = surface->size * surface->texels_per_metre;
    // Another cut-out of the pattern for every face.
    surface->texel_offset =
        Eigen::Vector2f(static_cast<float>(own_seed & 1023), static_cast<float>((own_seed >> 10) & 1023));
  }

  const Texture* Repeating(const TextureSpec& spec, int repeat_px) {
    const int pixels = spec.style == "plain" ? kPlainTexture : repeat_px;
    const auto key = std::make_tuple(spec.style, spec.shade, pixels);
    const auto found = repeating_.find(key);
    if (found != repeating_.end()) return found->second;
    const std::uint64_t seed = MixSeed(~seed_, repeating_.size());
    scene_->textures.emplace_back(DrawSurface(spec.style, spec.shade, pixels, pixels * kTexel, seed),
                                  TextureEdge::kRepeat);
    return repeating_[key] = &scene_->textures.back();
  }

  std::uint64_t seed_;
  SceneImpl* scene_;
  std::map<std::tuple<std::string, int, int>, const Texture*> repeating_;
};

// A wall's foot from left to right as seen from inside, `length` m long.
struct WallLine {
  Vector3d left;
  Vector3d right;  // unit
  Vector3d inward;
  double length;
};

WallLine LineOf(Wall wall, const Vector3d& room) {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY();
  switch (wall) {
    case Wall::kSouth:
      return {{room.x(), 0, 0}, -x, y, room.x()};
    case Wall::kEast:
      return {{room.x(), room.y(), 0}, -y, -x, room.y()};
    case Wall::kNorth:
      return {{0, room.y(), 0}, x, -y, room.x()};
    case Wall::kWest:
      break;
  }
  return {{0, 0, 0}, y, x, room.y()};
}

// An inner wall's foot on the side a poster hangs on.
WallLine LineOf(const ObjectSpec& wall, bool left_side) {
  const Vector3d along(std::cos(wall.yaw), std::sin(wall.yaw), 0.0), leftward(-along.y(), along.x(), 0.0);
  const Vector3d right = left_side ? Vector3d(-along) : along, inward = left_side ? leftward : Vector3d(-leftward);
  const Vector3d middle(wall.at.x(), wall.at.y(), 0.0);
  return {middle + 0.5 * wall.size.y() * inward - 0.5 * wall.size.x() * right, right, inward, wall.size.x()};
}

// A poster's wall, and its middle from the wall's left end.
struct PosterPlace {
  WallLine line;
  double middle;
};
PosterPlace PlaceOf(const PosterSpec& poster, const World& world) {
  if (poster.inner_wall.empty()) {
    const WallLine line = LineOf(poster.wall, world.room.size);
    const bool rightwards = line.right.sum() > 0.0;  // whether `along` grows to the right
    return {line, rightwards ? poster.along : line.length - poster.along};
  }
  const auto wall = std::find_if(world.objects.begin(), world.objects.end(), [&](const ObjectSpec& object) {
    return object.kind == ObjectKind::kWall && object.name == poster.inner_wall;
  });
  PV_CHECK(wall != world.objects.end(), "inner wall " << poster.inner_wall);
  const WallLine line = LineOf(*wall, poster.left);
  return {line, poster.left ? line.length - poster.along : poster.along};
}

constexpr Wall kWalls[] = {Wall::kSouth, Wall::kEast, Wall::kNorth, Wall::kWest};

void AddRoom(const RoomSpec& room, SurfaceBuilder& builder) {
  const Vector3d& s = room.size;
  builder.Add({0, s.y(), 0}, {s.x(), 0, 0}, {0, -s.y(), 0}, room.floor, kRoomTexture);
  builder.Add({0, 0, s.z()}, {s.x(), 0, 0}, {0, s.y(), 0}, room.ceiling, kRoomTexture);
  for (const Wall wall : kWalls) {
    const WallLine line = LineOf(wall, s);
    builder.Add(line.left + s.z() * Vector3d::UnitZ(), line.length * line.right, -s.z() * Vector3d::UnitZ(), room.walls,
                kRoomTexture);
  }
}

void AddPrism(const Prism& prism, SurfaceBuilder& builder) {
  const auto at = [](const Vector2d& p, double z) { return Vector3d(p.x(), p.y(), z); };
  const std::vector<Vector2d>& foot = prism.footprint;
  const auto corner_top = [&](std::size_t i) {
    return at(foot[i], prism.corner_tops.empty() ? prism.top : prism.corner_tops[i]);
  };
  const double height = prism.top - prism.bottom;
  for (std::size_t i = 0; i < foot.size(); ++i) {
    const std::size_t next = (i + 1) % foot.size();
    Surface& side = builder.Add(at(foot[i], prism.top), at(foot[next], 0) - at(foot[i], 0), {0, 0, -height},
                                prism.texture, kObjectTexture);
    side.corners[0] = corner_top(i).cast<float>();
    side.corners[1] = corner_top(next).cast<float>();
  }
  if (foot.size() == 4) {
    builder.Add(corner_top(3), corner_top(2) - corner_top(3), corner_top(0) - corner_top(3), prism.texture,
                kObjectTexture);
    builder.Add(at(foot[0], prism.bottom), at(foot[1], 0) - at(foot[0], 0), at(foot[3], 0) - at(foot[0], 0),
                prism.texture, kObjectTexture);
    return;
  }
  // The cap in slices: opposite edges of the (even) polygon pair up. Their frame is the polygon's bounding square.
  const auto cap = [&](double z) {
    Vector2d low = foot[0], high = foot[0];
    for (const Vector2d& p : foot) low = low.cwiseMin(p), high = high.cwiseMax(p);
    const Vector2d extent = high - low;
    for (std::size_t i = 0; i + 1 < foot.size() / 2; ++i) {
      Surface& slice = builder.Add(at({low.x(), high.y()}, z), {extent.x(), 0, 0}, {0, -extent.y(), 0},
                                   TextureSpec{"plain"}, kObjectTexture);
      const std::size_t last = foot.size() - 1;
      slice.corners = {at(foot[i], z).cast<float>(), at(foot[i + 1], z).cast<float>(),
                       at(foot[last - i - 1], z).cast<float>(), at(foot[last - i], z).cast<float>()};
    }
  };
  cap(prism.top);
}

// The board along the walls' foot, posters and lamps: seen, but neither solid nor casting shadows.
void AddPictures(const World& world, SurfaceBuilder& builder) {
  const Vector3d up = Vector3d::UnitZ();
  if (world.room.skirting > 0.0) {
    for (const Wall wall : kWalls) {
      const WallLine line = LineOf(wall, world.room.size);
      const Vector3d corner = line.left + kPictureThickness * line.inward + world.room.skirting * up;
      builder.Add(corner, line.length * line.right, -world.room.skirting * up, TextureSpec{"wood", 75}, kObjectTexture);
    }
  }
  // Later posters hang over earlier ones.
  double stand_off = 2.0 * kPictureThickness;
  for (const PosterSpec& poster : world.posters) {
    const PosterPlace place = PlaceOf(poster, world);
    const WallLine& line = place.line;
    const Vector3d corner = line.left + (place.middle - 0.5 * poster.size.x()) * line.right + stand_off * line.inward +
                            (poster.height + 0.5 * poster.size.y()) * up;
    Surface& surface =
        builder.Add(corner, poster.size.x() * line.right, -poster.size.y() * up, poster.texture, kObjectTexture);
    if (poster.texture.style == "window") surface.glow = world.light.windows > 0.0 ? kDaylightGlow : 1.0f;
    stand_off += 1e-4;
  }
  // Switched off, a lamp is a grey plate.
  const auto lamp_glow = static_cast<float>(std::clamp(world.light.level * world.light.lamps, 0.25, 1.0));
  for (const LampSpec& lamp : world.lamps) {
    const Vector3d corner(lamp.at.x() - 0.5 * lamp.size.x(), lamp.at.y() - 0.5 * lamp.size.y(),
                          world.room.size.z() - kPictureThickness);
    builder.Add(corner, {lamp.size.x(), 0, 0}, {0, lamp.size.y(), 0}, TextureSpec{"plain", 252}, kObjectTexture).glow =
        lamp_glow;
  }
}

// Legs, body, arms' width and head, each an upright box or prism.
std::vector<std::pair<Prism, double>> WalkerParts(double height, int person) {
  const auto box = [&](double x, double y, double half_x, double half_y, double bottom, double top,
                       const TextureSpec& texture) {
    Prism part;
    part.footprint = {
        {x - half_x, y - half_y}, {x + half_x, y - half_y}, {x + half_x, y + half_y}, {x - half_x, y + half_y}};
    part.bottom = bottom * height, part.top = top * height;
    part.texture = texture;
    return part;
  };
  const TextureSpec trousers{"fabric", 45 + 25 * (person % 3)}, skin{"plain", 150};
  const TextureSpec shirt{person % 2 == 0 ? "shapes" : "fabric"};
  return {{box(0.0, 0.10, 0.07, 0.07, 0.0, 0.48, trousers), 1.0},
          {box(0.0, -0.10, 0.07, 0.07, 0.0, 0.48, trousers), -1.0},
          {box(0.0, 0.0, 0.12, 0.22, 0.48, 0.83, shirt), 0.0},
          {box(0.0, 0.0, 0.09, 0.08, 0.85, 1.0, skin), 0.0}};
}

// Whoever occludes the camera comes last; nobody else where nobody walks.
void AddWalkers(const World& world, SurfaceBuilder& builder, SceneImpl* scene) {
  std::vector<double> heights;
  for (const PersonSpec& person : world.people) heights.push_back(person.height);
  if (!world.events.occlusions.empty()) heights.push_back(1.75);
  for (std::size_t walker = 0; walker < heights.size(); ++walker) {
    for (const auto& [part, step] : WalkerParts(heights[walker], static_cast<int>(walker))) {
      const std::size_t first = scene->surfaces.size();
      AddPrism(part, builder);
      for (std::size_t i = first; i < scene->surfaces.size(); ++i) {
        Surface& face = scene->surfaces[i];
        face.light_columns = face.light_rows = 2;
        // Lit from above, by no lamp in particular.
        face.glow = static_cast<float>(std::sqrt(world.light.level)) * (0.72f + 0.2f * face.normal.z());
        scene->walker_faces.push_back({walker, step, face});
      }
    }
  }
}

}  // namespace

void BuildSurfaces(const World& world, std::uint64_t seed, SceneImpl* scene) {
  SurfaceBuilder builder(seed, scene);
  AddRoom(world.room, builder);
  scene->surfaces[0].gloss = static_cast<float>(world.room.gloss);
  scene->surfaces[0].roughness = static_cast<float>(world.room.roughness);
  for (const Prism& prism : MakeSolids(world.objects)) AddPrism(prism, builder);
  scene->solid_count = scene->surfaces.size();
  AddPictures(world, builder);
  scene->still_count = scene->surfaces.size();
  AddWalkers(world, builder, scene);
  for (Surface& surface : scene->surfaces) {
    surface.light_offset = scene->light.size();
    scene->light.resize(scene->light.size() + static_cast<std::size_t>(surface.light_columns * surface.light_rows),
                        surface.glow);
  }
}

}  // namespace planar_vslam::sim
