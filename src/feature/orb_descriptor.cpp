#include "orb_descriptor.h"

#include <cmath>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/features2d.hpp>

#include "planar_vslam/geometry/check.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif

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

constexpr int kRadius = PatchOrientation::kRadius;

// `center` is the keypoint's pixel, `step` the bytes from row to row.
PatchOrientation::Moments MomentsPlain(const PatchOrientation::Disc<std::int16_t>& disc, const std::uint8_t* center,
                                       std::ptrdiff_t step) {
  PatchOrientation::Moments moments;
  for (int v = -kRadius; v <= kRadius; ++v) {
    const std::uint8_t* pixels = center + v * step - kRadius;
    const auto& inside = disc.inside[static_cast<std::size_t>(v + kRadius)];
    const auto& column = disc.column[static_cast<std::size_t>(v + kRadius)];
    int sum = 0, weighted_sum = 0;
    for (std::size_t u = 0; u < inside.size(); ++u) {
      sum += inside[u] * static_cast<std::int16_t>(pixels[u]);
      weighted_sum += column[u] * static_cast<std::int16_t>(pixels[u]);
    }
    moments.x += weighted_sum;
    moments.y += v * sum;
  }
  return moments;
}

// Rotates by an angle of this cosine and sine, rounds to even, and samples around `center`.
using Samples = std::array<std::uint8_t, 2 * BriefPattern::kPairs>;
void SamplePlain(const BriefPattern::Points& points, const std::uint8_t* center, std::ptrdiff_t step, float cosine,
                 float sine, Samples* samples) {
  const cv::v_float32x4 cosines = cv::v_setall_f32(cosine), sines = cv::v_setall_f32(sine);
  const cv::v_float32x4 steps = cv::v_setall_f32(static_cast<float>(step));
  for (std::size_t i = 0; i < samples->size(); i += 4) {
    const cv::v_float32x4 px = cv::v_load(&points.x[i]), py = cv::v_load(&points.y[i]);
    const cv::v_float32x4 column = cv::v_cvt_f32(cv::v_round(px * cosines - py * sines));
    const cv::v_float32x4 row = cv::v_cvt_f32(cv::v_round(px * sines + py * cosines));
    // Whole numbers below 2^24: exact in float.
    alignas(16) std::array<int, 4> offset;
    cv::v_store_aligned(offset.data(), cv::v_round(row * steps + column));
    for (std::size_t k = 0; k < 4; ++k) (*samples)[i + k] = center[offset[k]];
  }
}

#if defined(__x86_64__)
PV_TARGET_AVX2 inline int SumOf(__m256i numbers) {
  const __m128i four = _mm_add_epi32(_mm256_castsi256_si128(numbers), _mm256_extracti128_si256(numbers, 1));
  const __m128i two = _mm_add_epi32(four, _mm_shuffle_epi32(four, 0x4E));
  return _mm_cvtsi128_si32(_mm_add_epi32(two, _mm_shuffle_epi32(two, 0xB1)));
}

PV_TARGET_AVX2 PatchOrientation::Moments MomentsAvx2(const PatchOrientation::Disc<std::int8_t>& disc,
                                                     const std::uint8_t* center, std::ptrdiff_t step) {
  // Sums of two pixels fit 16 bits: 2 * 255 * 15 at most.
  const __m256i ones = _mm256_set1_epi16(1);
  __m256i x = _mm256_setzero_si256(), y = _mm256_setzero_si256();
  for (int v = -kRadius; v <= kRadius; ++v) {
    const std::size_t row = static_cast<std::size_t>(v + kRadius);
    const __m256i pixels = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(center + v * step - kRadius));
    const __m256i inside = _mm256_load_si256(reinterpret_cast<const __m256i*>(disc.inside[row].data()));
    const __m256i column = _mm256_load_si256(reinterpret_cast<const __m256i*>(disc.column[row].data()));
    x = _mm256_add_epi32(x, _mm256_madd_epi16(_mm256_maddubs_epi16(pixels, column), ones));
    y = _mm256_add_epi32(
        y, _mm256_madd_epi16(_mm256_maddubs_epi16(pixels, inside), _mm256_set1_epi16(static_cast<std::int16_t>(v))));
  }
  return {SumOf(x), SumOf(y)};
}

PV_TARGET_AVX2 void SampleAvx2(const BriefPattern::Points& points, const std::uint8_t* center, std::ptrdiff_t step,
                               float cosine, float sine, Samples* samples) {
  const __m256 cosines = _mm256_set1_ps(cosine), sines = _mm256_set1_ps(sine);
  const __m256i steps = _mm256_set1_epi32(static_cast<int>(step));
  for (std::size_t i = 0; i < samples->size(); i += 8) {
    const __m256 px = _mm256_load_ps(&points.x[i]), py = _mm256_load_ps(&points.y[i]);
    const __m256i column = _mm256_cvtps_epi32(_mm256_sub_ps(_mm256_mul_ps(px, cosines), _mm256_mul_ps(py, sines)));
    const __m256i row = _mm256_cvtps_epi32(_mm256_add_ps(_mm256_mul_ps(px, sines), _mm256_mul_ps(py, cosines)));
    alignas(32) std::array<int, 8> offset;
    _mm256_store_si256(reinterpret_cast<__m256i*>(offset.data()),
                       _mm256_add_epi32(_mm256_mullo_epi32(row, steps), column));
    for (std::size_t k = 0; k < 8; ++k) (*samples)[i + k] = center[offset[k]];
  }
}
#endif

}  // namespace

PatchOrientation::PatchOrientation(InstructionSet set) : set_(set) {
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
      const std::size_t row = static_cast<std::size_t>(v + kRadius), column = static_cast<std::size_t>(u + kRadius);
      wide_.inside[row][column] = 1;
      wide_.column[row][column] = static_cast<std::int16_t>(u);
      narrow_.inside[row][column] = 1;
      narrow_.column[row][column] = static_cast<std::int8_t>(u);
    }
  }
}

float PatchOrientation::Degrees(const cv::Mat& level, int x, int y) const {
  const std::uint8_t* center = level.ptr<std::uint8_t>(y) + x;
  const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(level.step[0]);
#if defined(__x86_64__)
  const bool is_avx2 = set_ == InstructionSet::kAvx2;
  const Moments moments = is_avx2 ? MomentsAvx2(narrow_, center, step) : MomentsPlain(wide_, center, step);
#else
  const Moments moments = MomentsPlain(wide_, center, step);
#endif
  return cv::fastAtan2(static_cast<float>(moments.y), static_cast<float>(moments.x));
}

BriefPattern::BriefPattern(InstructionSet set) : set_(set) {
  LocatePoints(ProbeDescriptors(-kProbeContrast), &points_.x[0], &points_.y[0]);
  LocatePoints(ProbeDescriptors(+kProbeContrast), &points_.x[kPairs], &points_.y[kPairs]);
}

Descriptor BriefPattern::Describe(const cv::Mat& blurred, int x, int y, float angle) const {
  // Cosine in double, rotation in float, rounding to even: as OpenCV does it.
  const float cosine = static_cast<float>(std::cos(static_cast<double>(angle)));
  const float sine = static_cast<float>(std::sin(static_cast<double>(angle)));
  const std::uint8_t* center = blurred.ptr<std::uint8_t>(y) + x;
  const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(blurred.step[0]);
  alignas(32) Samples samples;
#if defined(__x86_64__)
  const auto sample = set_ == InstructionSet::kAvx2 ? SampleAvx2 : SamplePlain;
#else
  const auto sample = SamplePlain;
#endif
  sample(points_, center, step, cosine, sine, &samples);
  Descriptor descriptor;
  auto* bytes = reinterpret_cast<std::uint8_t*>(descriptor.data());
  for (std::size_t i = 0; i < kPairs; i += 16) {
    const cv::v_uint8x16 first = cv::v_load_aligned(&samples[i]), second = cv::v_load_aligned(&samples[kPairs + i]);
    const auto bits = static_cast<std::uint16_t>(cv::v_signmask(first < second));
    std::memcpy(bytes + i / 8, &bits, sizeof bits);
  }
  return descriptor;
}

}  // namespace planar_vslam
