#include <algorithm>
#include <cmath>
#include <random>

#include "motion_blur.h"
#include "parallel_rows.h"
#include "picture.h"
#include "planar_vslam/geometry/check.h"
#include "planar_vslam/sim/random.h"
#include "planar_vslam/sim/sensors.h"
#include "scene_impl.h"

namespace planar_vslam {
namespace {

constexpr std::size_t kNoiseTable = 1 << 16;

// Where the camera is when each row is read.
std::vector<sim::Viewpoint> RowViewpoints(const CameraSpec& spec, const CameraShot& shot) {
  std::vector<sim::Viewpoint> rows(static_cast<std::size_t>(spec.model.height));
  const double middle = 0.5 * (spec.model.height - 1);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (row > 0 && spec.rolling_shutter == 0.0) {
      rows[row] = rows[0];
      continue;
    }
    const double after = spec.rolling_shutter * (static_cast<double>(row) - middle) / spec.model.height;
    const Rigid3 T = shot.T_world_camera * ExpSe3(after * shot.velocity);
    rows[row] = {T.R().cast<float>(), T.translation.cast<float>()};
  }
  return rows;
}

// The ray of a pixel; where the lens has none, that of the nearest pixel towards the centre which has one.
Eigen::Vector3f RayOf(const CameraModel& model, const Eigen::Vector2d& pixel) {
  constexpr double kInwards = 0.98;
  const Eigen::Vector2d centre(model.cx, model.cy);
  std::optional<Eigen::Vector2d> ideal = model.UndistortPixel(pixel);
  for (double share = kInwards; !ideal.has_value(); share *= kInwards) {
    ideal = model.UndistortPixel(centre + share * (pixel - centre));
  }
  return model.Ray(*ideal).normalized().cast<float>();
}

}  // namespace

CameraSensor::CameraSensor(const CameraSpec& spec, int threads)
    : spec_(spec), threads_(threads), normals_(kNoiseTable) {
  const CameraModel& model = spec_.model;
  const std::vector<std::string> problems = model.Problems();
  PV_CHECK(problems.empty(), problems.front());
  PV_CHECK(threads > 0, threads << " threads");
  rays_.columns = model.width + 1;
  for (int row = 0; row <= model.height; ++row) {
    for (int column = 0; column <= model.width; ++column) {
      const Eigen::Vector3f ray = RayOf(model, Eigen::Vector2d(column, row));
      rays_.x.push_back(ray.x());
      rays_.y.push_back(ray.y());
      rays_.z.push_back(ray.z());
    }
  }
  std::mt19937_64 generator(MixSeed(0, RandomStream::kImageNoise));
  std::normal_distribution<float> normal;
  for (float& value : normals_) value = normal(generator);
}

GrayImage CameraSensor::Render(const Scene& scene, const CameraShot& shot) const {
  const CameraModel& model = spec_.model;
  sim::Picture picture =
      sim::TakePicture(scene.impl(), rays_, RowViewpoints(spec_, shot), static_cast<float>(1.0 / model.fx), threads_);
  if (shot.exposure.time > 0.0) {
    sim::BlurByMotion(model, rays_, shot.velocity, shot.exposure.time, threads_, &picture);
  }
  auto pixels = std::make_shared<std::vector<std::uint8_t>>(picture.grey.size());
  const auto width = static_cast<std::size_t>(model.width);
  sim::ForEachRow(threads_, model.height, [&](int row) {
    const std::size_t first = static_cast<std::size_t>(row) * width;
    Develop(&picture.grey[first], first, shot, &(*pixels)[first]);
  });
  return {model.width, model.height, pixels};
}

// Exposure, noise and rounding of a row that begins at pixel `first`.
void CameraSensor::Develop(const float* grey, std::size_t first, const CameraShot& shot, std::uint8_t* pixels) const {
  const auto exposure = static_cast<float>(shot.exposure.factor);
  const auto noise = static_cast<float>(spec_.noise * shot.exposure.noise_gain);
  std::uint64_t draw = MixSeed(shot.noise_seed, first);
  for (std::size_t i = 0; i < static_cast<std::size_t>(spec_.model.width); ++i) {
    // One 64-bit draw serves four pixels.
    draw = i % 4 == 0 ? MixSeed(shot.noise_seed, first + i) : draw >> 16;
    const float value = std::min(exposure * grey[i], 255.0f);
    // A quarter of the variance at mid grey comes from reading out, the rest grows with the light.
    const float deviation = noise * std::sqrt(0.25f + 0.75f * value / 128.0f);
    const float noisy = value + deviation * normals_[draw & (kNoiseTable - 1)];
    pixels[i] = static_cast<std::uint8_t>(std::clamp(noisy + 0.5f, 0.0f, 255.0f));
  }
}

}  // namespace planar_vslam
