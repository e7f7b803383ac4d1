#include "orb_descriptor.h"

#include <cmath>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {
namespace {

constexpr int kProbeReach = 15;                  // px; half of ORB's 31 px patch
constexpr int kProbeSide = 2 * kProbeReach + 1;  // probes along each axis
constexpr int kProbePitch = 40;                  // px between probes: neither patches nor blurred pixels meet
constexpr int kProbeBackground = 100;            // grey level
// After the 7x7 blur with sigma 2 (centre weight 0.046, next 0.041) a pixel that differs by 11 grey levels is off by 1
// in its own place after rounding, and by 0 everywhere else.
constexpr int kProbeContrast = 11;

int ProbeIndex(int dx, int dy) { return (dy + kProbeReach) * kProbeSide + dx + kProbeReach; }

// Row ProbeIndex(dx, dy): OpenCV's unrotated descriptor of a keypoint whose surroundings are flat, but for the pixel at
// (dx, dy), which differs by `contrast`.
cv::Mat ProbeDescriptors(int contrast) {
  const int side = (kProbeSide + 1) * kProbePitch;
  cv::Mat image(side, side, CV_8UC1, cv::Scalar(kProbeBackground));
  std::vector<cv::KeyPoint> keypoints;
  for (int dy = -kProbeReach; dy <= kProbeReach; ++dy) {
    for (int dx = -kProbeReach; dx <= kProbeReach; ++dx) {
      const cv::Point center((dx + kProbeReach + 1) * kProbePitch, (dy + kProbeReach + 1) * kProbePitch);
      image.at<std::uint8_t>(center + cv::Point(dx, dy)) = static_cast<std::uint8_t>(kProbeBackground + contrast);
      keypoints.emplace_back(cv::Point2f(center), static_cast<float>(kProbeSide), 0.0F);
    }
  }
  cv::Mat descriptors;
  cv::ORB::create()->compute(image, keypoints, descriptors);
  PV_CHECK(
      descriptors.rows == kProbeSide * kProbeSide && descriptors.cols == static_cast<int>(BriefPattern::kPairs / 8),
      "rows=" << descriptors.rows << " cols=" << descriptors.cols);
  return descriptors;
}

// A bit is set when the first point of its pair is darker than the second: a darker pixel sets the bits whose first
// point it is, a brighter pixel those whose second point it is.
void LocatePoints(const cv::Mat& descriptors, float* x, float* y) {
  std::array<int, BriefPattern::kPairs> hits{};
  for (int dy = -kProbeReach; dy <= kProbeReach; ++dy) {
    for (int dx = -kProbeReach; dx <= kProbeReach; ++dx) {
      const std::uint8_t* bits = descriptors.ptr<std::uint8_t>(ProbeIndex(dx, dy));
      for (std::size_t pair = 0; pair < hits.size(); ++pair) {
        if ((bits[pair / 8] >> (pair % 8) & 1) == 0) continue;
        ++hits[pair];
        x[pair] = static_cast<float>(dx);
        y[pair] = static_cast<float>(dy);
      }
    }
  }
  for (std::size_t pair = 0; pair < hits.size(); ++pair) {
    PV_CHECK(hits[pair] == 1, "pair " << pair << " of cv::ORB answered to " << hits[pair] << " probes, expected 1");
    PV_CHECK(std::hypot(x[pair], y[pair]) < static_cast<float>(kOrbMargin) - 0.5F, "x=" << x[pair] << " y=" << y[pair]);
  }
}

}  // namespace

PatchOrientation::PatchOrientation() {
  // Half width of each row of the disc. Beyond 45 degrees it mirrors the first octant, which makes the disc symmetric
  // in x and y in spite of rounding.
  const int octant = cvFloor(kRadius * std::sqrt(0.5) + 1.0);
  std::array<int, kRadius + 1> half_width{};
  for (int v = 0; v <= octant; ++v) {
    half_width[static_cast<std::size_t>(v)] = cvRound(std::sqrt(static_cast<double>(kRadius * kRadius - v * v)));
  }
  for (int v = octant + 1; v <= kRadius; ++v) {
    int u = octant;
    while (half_width[static_cast<std::size_t>(u)] < v) --u;
    half_width[static_cast<std::size_t>(v)] = u;
  }
  for (int v = -kRadius; v <= kRadius; ++v) {
    const int width = half_width[static_cast<std::size_t>(std::abs(v))];
    for (int u = -width; u <= width; ++u) {
      mask_[static_cast<std::size_t>(v + kRadius)][static_cast<std::size_t>(u + kRadius)] = 1;
      weighted_[static_cast<std::size_t>(v + kRadius)][static_cast<std::size_t>(u + kRadius)] =
          static_cast<std::int16_t>(u);
    }
  }
}

float PatchOrientation::Degrees(const cv::Mat& level, int x, int y) const {
  int moment_x = 0, moment_y = 0;
  for (int v = -kRadius; v <= kRadius; ++v) {
    const std::uint8_t* pixels = level.ptr<std::uint8_t>(y + v) + x - kRadius;
    const Row& mask = mask_[static_cast<std::size_t>(v + kRadius)];
    const Row& weighted = weighted_[static_cast<std::size_t>(v + kRadius)];
    int sum = 0, weighted_sum = 0;
    for (std::size_t u = 0; u < mask.size(); ++u) {
      sum += mask[u] * static_cast<std::int16_t>(pixels[u]);
      weighted_sum += weighted[u] * static_cast<std::int16_t>(pixels[u]);
    }
    moment_x += weighted_sum;
    moment_y += v * sum;
  }
  return cv::fastAtan2(static_cast<float>(moment_y), static_cast<float>(moment_x));
}

BriefPattern::BriefPattern() {
  LocatePoints(ProbeDescriptors(-kProbeContrast), &x_[0], &y_[0]);
  LocatePoints(ProbeDescriptors(+kProbeContrast), &x_[kPairs], &y_[kPairs]);
}

Descriptor BriefPattern::Describe(const cv::Mat& blurred, int x, int y, float angle) const {
  // Cosine in double, rotation in float, rounding to even: as OpenCV does it.
  const cv::v_float32x4 cosine = cv::v_setall_f32(static_cast<float>(std::cos(static_cast<double>(angle))));
  const cv::v_float32x4 sine = cv::v_setall_f32(static_cast<float>(std::sin(static_cast<double>(angle))));
  const cv::v_float32x4 step = cv::v_setall_f32(static_cast<float>(blurred.step[0]));
  const std::uint8_t* center = blurred.ptr<std::uint8_t>(y) + x;

  alignas(16) std::array<std::uint8_t, 2 * kPairs> samples;
  for (std::size_t i = 0; i < samples.size(); i += 4) {
    const cv::v_float32x4 px = cv::v_load(&x_[i]), py = cv::v_load(&y_[i]);
    const cv::v_float32x4 column = cv::v_cvt_f32(cv::v_round(px * cosine - py * sine));
    const cv::v_float32x4 row = cv::v_cvt_f32(cv::v_round(px * sine + py * cosine));
    // Whole numbers below 2^24: exact in float.
    alignas(16) std::array<int, 4> offset;
    cv::v_store_aligned(offset.data(), cv::v_round(row * step + column));
    for (std::size_t k = 0; k < 4; ++k) samples[i + k] = center[offset[k]];
  }
  Descriptor descriptor;
  auto* bytes = reinterpret_cast<std::uint8_t*>(descriptor.data());
  for (std::size_t i = 0; i < kPairs; i += 16) {
    const cv::v_uint8x16 first = cv::v_load_aligned(&samples[i]), second = cv::v_load_aligned(&samples[kPairs + i]);
    const auto bits = static_cast<std::uint16_t>(cv::v_signmask(first < second));
    std::memcpy(bytes + i / 8, &bits, sizeof bits);
  }
  return descriptor;
}

void BlurForBrief(const cv::Mat& level, cv::Mat* blurred) {
  // cv::ORB's GaussianBlur(7x7, sigma 2) works inside a larger image, where OpenCV takes the plain separable filter.
  // On an image of its own it would take the fixed-point filter: twice the time, other roundings.
  const cv::Mat kernel = cv::getGaussianKernel(7, 2.0, CV_32F);
  cv::sepFilter2D(level, *blurred, CV_8U, kernel, kernel, cv::Point(-1, -1), 0.0, cv::BORDER_REFLECT_101);
}

}  // namespace planar_vslam
