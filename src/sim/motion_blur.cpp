#include "motion_blur.h"

#include <algorithm>
#include <cmath>

#include "parallel_rows.h"

namespace planar_vslam::sim {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kUnnoticeable = 0.3f;  // px, shorter ways leave the pixel as it is
constexpr int kMostTaps = 32;

// Bilinear; outside, the border goes on.
float GreyAt(const Picture& picture, const std::vector<float>& grey, const Vector2f& at) {
  const float x = std::clamp(at.x(), 0.0f, static_cast<float>(picture.width - 1));
  const float y = std::clamp(at.y(), 0.0f, static_cast<float>(picture.height - 1));
  const int x0 = std::min(static_cast<int>(x), picture.width - 2),
            y0 = std::min(static_cast<int>(y), picture.height - 2);
  const float ax = x - static_cast<float>(x0), ay = y - static_cast<float>(y0);
  const float* upper = &grey[picture.Index(x0, y0)];
  const float* lower = upper + picture.width;
  const float top = upper[0] + ax * (upper[1] - upper[0]), bottom = lower[0] + ax * (lower[1] - lower[0]);
  return top + ay * (bottom - top);
}

}  // namespace

void BlurByMotion(const CameraModel& model, const RayTable& rays, const Vector6d& velocity, double time, int threads,
                  Picture* picture) {
  // What a camera at rest would see move the other way.
  const Vector3f v = (-time * velocity.head<3>()).cast<float>(), w = (-time * velocity.tail<3>()).cast<float>();
  const auto fx = static_cast<float>(model.fx), fy = static_cast<float>(model.fy);
  const std::vector<float> sharp = picture->grey;
  ForEachRow(threads, picture->height, [&](int row) {
    for (int column = 0; column < picture->width; ++column) {
      const std::size_t pixel = picture->Index(column, row);
      const Vector3f ray = rays.At(column, row);
      const Vector3f way = v / picture->distance[pixel] + w.cross(ray);
      const float slope = way.z() / ray.z();
      const Vector2f smear(fx * (way.x() - slope * ray.x()) / ray.z(), fy * (way.y() - slope * ray.y()) / ray.z());
      const float length = smear.norm();
      if (!(length > kUnnoticeable)) continue;
      const int taps = std::min(static_cast<int>(length) + 2, kMostTaps);
      const Vector2f centre(static_cast<float>(column), static_cast<float>(row));
      float sum = 0.0f;
      for (int tap = 0; tap < taps; ++tap) {
        const float along = (static_cast<float>(tap) + 0.5f) / static_cast<float>(taps) - 0.5f;
        sum += GreyAt(*picture, sharp, centre + along * smear);
      }
      picture->grey[pixel] = sum / static_cast<float>(taps);
    }
  });
}

}  // namespace planar_vslam::sim
