#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/sim/random.h"
#include "planar_vslam/sim/sensors.h"
#include "scene_impl.h"

namespace planar_vslam {
namespace {

using Eigen::Vector3f;

constexpr int kPacket = 16;      // rays Embree traces at once
constexpr int kEdgeSamples = 4;  // rays of a pixel that faces meet in
constexpr std::size_t kNoiseTable = 1 << 16;
constexpr std::uint32_t kNothing = ~0u;  // surface of a ray that left the world

// Sample positions off the pixel's centre, px: four rooks, none attacking another.
constexpr float kRooks[kEdgeSamples][2] = {{-0.125f, -0.375f}, {0.375f, -0.125f}, {0.125f, 0.375f}, {-0.375f, 0.125f}};

// Rays from one place, sixteen at a time.
class PacketCaster {
 public:
  PacketCaster(const SceneImpl& scene, const Rigid3& T_world_camera, float pixel_angle)
      : scene_(scene),
        R_world_camera_(T_world_camera.R().cast<float>()),
        origin_(T_world_camera.translation.cast<float>()),
        pixel_angle_(pixel_angle) {
    rtcInitIntersectContext(&context_);
    context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    std::fill_n(query_.ray.org_x, kPacket, origin_.x());
    std::fill_n(query_.ray.org_y, kPacket, origin_.y());
    std::fill_n(query_.ray.org_z, kPacket, origin_.z());
    std::fill_n(query_.ray.mask, kPacket, ~0u);
  }

  // Directions in the camera frame, unit length.
  void SetRay(int i, const Vector3f& ray) { SetRays(i, &ray.x(), &ray.y(), &ray.z(), 1); }
  void SetRays(int first, const float* x, const float* y, const float* z, int count) {
    const Eigen::Matrix3f R = R_world_camera_;
    for (int i = 0; i < count; ++i) {
      query_.ray.dir_x[first + i] = R(0, 0) * x[i] + R(0, 1) * y[i] + R(0, 2) * z[i];
      query_.ray.dir_y[first + i] = R(1, 0) * x[i] + R(1, 1) * y[i] + R(1, 2) * z[i];
      query_.ray.dir_z[first + i] = R(2, 0) * x[i] + R(2, 1) * y[i] + R(2, 2) * z[i];
    }
  }
  // Traces the first `count` rays.
  void Cast(int count) {
    for (int i = 0; i < kPacket; ++i) {
      valid_[i] = i < count ? -1 : 0;
      query_.ray.tfar[i] = std::numeric_limits<float>::infinity();
      query_.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(valid_, scene_.everything, &context_, &query_);
  }
  std::uint32_t surface(int i) const {
    return query_.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID ? kNothing : query_.hit.primID[i] / 2;
  }
  float Grey(int i) const {
    if (surface(i) == kNothing) return 0.0f;
    const Surface& surface_hit = scene_.surfaces[surface(i)];
    const Vector3f direction(query_.ray.dir_x[i], query_.ray.dir_y[i], query_.ray.dir_z[i]);
    const float distance = query_.ray.tfar[i];
    // Between the short and the long side of the pixel's footprint on a slanted face.
    const float slant = std::max(std::abs(direction.dot(surface_hit.normal)), 0.05f);
    const float footprint = distance * pixel_angle_ / std::sqrt(slant);
    return scene_.Grey(surface_hit, origin_ + distance * direction, footprint);
  }

 private:
  const SceneImpl& scene_;
  Eigen::Matrix3f R_world_camera_;
  Vector3f origin_;
  float pixel_angle_;  // rad
  RTCIntersectContext context_;
  alignas(64) int valid_[kPacket] = {};
  alignas(64) RTCRayHit16 query_{};
};

// Before development: grey levels, and which surface each pixel's centre shows.
struct Picture {
  std::vector<float> grey;
  std::vector<std::uint32_t> surface;
};

Picture CastCentres(const CameraModel& model, const RayTable& rays, PacketCaster& caster) {
  const auto count = static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
  Picture picture{std::vector<float>(count), std::vector<std::uint32_t>(count)};
  std::size_t pixel = 0;
  for (int row = 0; row < model.height; ++row) {
    for (int column = 0; column < model.width; column += kPacket) {
      const int filled = std::min(kPacket, model.width - column);
      const std::size_t ray = rays.Index(column, row);
      caster.SetRays(0, &rays.x[ray], &rays.y[ray], &rays.z[ray], filled);
      caster.Cast(filled);
      for (int i = 0; i < filled; ++i, ++pixel) {
        picture.grey[pixel] = caster.Grey(i);
        picture.surface[pixel] = caster.surface(i);
      }
    }
  }
  return picture;
}

// Pixels with a neighbour that shows another surface.
std::vector<std::size_t> FindEdges(const CameraModel& model, const std::vector<std::uint32_t>& surface) {
  std::vector<std::size_t> edges;
  const auto width = static_cast<std::size_t>(model.width), height = static_cast<std::size_t>(model.height);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      const std::uint32_t own = surface[i];
      const bool edge = (x > 0 && surface[i - 1] != own) || (x + 1 < width && surface[i + 1] != own) ||
                        (y > 0 && surface[i - width] != own) || (y + 1 < height && surface[i + width] != own);
      if (edge) edges.push_back(i);
    }
  }
  return edges;
}

// Every pixel's samples sit a little elsewhere, up to half their spacing, so that rounding to quarters of a pixel
// averages out along an edge instead of moving all of it.
Eigen::Vector2f RookShift(std::size_t pixel) {
  const std::uint64_t bits = MixSeed(0, pixel);
  const auto shift = [](std::uint64_t byte) {
    return (static_cast<float>(byte & 255) - 127.5f) / 256.0f / kEdgeSamples;
  };
  return {shift(bits), shift(bits >> 8)};
}

// Gives pixels on edges the mean of several rays.
void SmoothEdges(const CameraModel& model, const RayTable& rays, PacketCaster& caster, Picture* picture) {
  constexpr std::size_t kPixels = kPacket / kEdgeSamples;  // in a packet
  const std::vector<std::size_t> edges = FindEdges(model, picture->surface);
  const auto width = static_cast<std::size_t>(model.width);
  for (std::size_t first = 0; first < edges.size(); first += kPixels) {
    const std::size_t last = std::min(first + kPixels, edges.size());
    int filled = 0;
    for (std::size_t i = first; i < last; ++i) {
      const int column = static_cast<int>(edges[i] % width), row = static_cast<int>(edges[i] / width);
      const Vector3f ray = rays.At(column, row);
      const Vector3f step_x = rays.At(column + 1, row) - ray, step_y = rays.At(column, row + 1) - ray;
      const Eigen::Vector2f shift = RookShift(edges[i]);
      for (const auto& [x, y] : kRooks) {
        caster.SetRay(filled++, (ray + (x + shift.x()) * step_x + (y + shift.y()) * step_y).normalized());
      }
    }
    caster.Cast(filled);
    for (std::size_t i = first; i < last; ++i) {
      const int own = static_cast<int>(i - first) * kEdgeSamples;
      float sum = 0.0f;
      for (int sample = 0; sample < kEdgeSamples; ++sample) sum += caster.Grey(own + sample);
      picture->grey[edges[i]] = sum / kEdgeSamples;
    }
  }
}

}  // namespace

CameraSensor::CameraSensor(const CameraSpec& spec) : spec_(spec), normals_(kNoiseTable) {
  const CameraModel& model = spec_.model;
  const std::vector<std::string> problems = model.Problems();
  PV_CHECK(problems.empty(), problems.front());
  rays_.columns = model.width + 1;
  for (int row = 0; row <= model.height; ++row) {
    for (int column = 0; column <= model.width; ++column) {
      const Eigen::Vector2d ideal = model.UndistortPixel(Eigen::Vector2d(column, row));
      const Vector3f ray = model.Ray(ideal).normalized().cast<float>();
      rays_.x.push_back(ray.x());
      rays_.y.push_back(ray.y());
      rays_.z.push_back(ray.z());
    }
  }
  std::mt19937_64 generator(MixSeed(0, RandomStream::kImageNoise));
  std::normal_distribution<float> normal;
  for (float& value : normals_) value = normal(generator);
}

GrayImage CameraSensor::Render(const Scene& scene, const Rigid3& T_world_camera, std::uint64_t noise_seed) const {
  PacketCaster caster(scene.impl(), T_world_camera, static_cast<float>(1.0 / spec_.model.fx));
  Picture picture = CastCentres(spec_.model, rays_, caster);
  SmoothEdges(spec_.model, rays_, caster, &picture);
  return {spec_.model.width, spec_.model.height,
          std::make_shared<const std::vector<std::uint8_t>>(Develop(picture.grey, noise_seed))};
}

// Exposure, noise and rounding.
std::vector<std::uint8_t> CameraSensor::Develop(const std::vector<float>& grey, std::uint64_t noise_seed) const {
  const auto exposure = static_cast<float>(spec_.exposure), noise = static_cast<float>(spec_.noise);
  std::vector<std::uint8_t> pixels(grey.size());
  std::uint64_t draw = 0;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    // One 64-bit draw serves four pixels.
    draw = i % 4 == 0 ? MixSeed(noise_seed, i) : draw >> 16;
    const float value = std::min(exposure * grey[i], 255.0f);
    // A quarter of the variance at mid grey comes from reading out, the rest grows with the light.
    const float deviation = noise * std::sqrt(0.25f + 0.75f * value / 128.0f);
    const float noisy = value + deviation * normals_[draw & (kNoiseTable - 1)];
    pixels[i] = static_cast<std::uint8_t>(std::clamp(noisy + 0.5f, 0.0f, 255.0f));
  }
  return pixels;
}

}  // namespace planar_vslam
