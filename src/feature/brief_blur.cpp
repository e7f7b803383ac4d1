#include "brief_blur.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "planar_vslam/geometry/check.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace planar_vslam {
namespace {

constexpr int kRadius = BriefBlur::kRadius;
constexpr int kBlock = BriefBlur::kBlock;

// Added to a number below 2^22, it leaves the nearest integer, ties to even, in the lowest bits.
constexpr float kRounder = 12582912.0F;  // 1.5 * 2^23

// Without fused multiply-add, pixels less than this from a tie are done again with it. Of 14 roundings along a row and
// 10 along a column each errs by at most 2^-16, or 2^-15 before its weight below 0.2, in numbers up to 512.
constexpr float kTieBand = 5e-4F;  // grey levels

[[gnu::always_inline]] inline void Widen(const std::uint8_t* pixels, int count, float* wide) {
  for (int x = 0; x < count; ++x) wide[x] = static_cast<float>(pixels[x]);
}

template <bool Fused>
[[gnu::always_inline]] inline float MultiplyAdd(float a, float b, float c) {
  return Fused ? __builtin_fmaf(a, b, c) : a * b + c;
}

template <bool Fused>
[[gnu::always_inline]] inline void AlongRow(const float* __restrict wide, int count, const BriefBlur::Weights& weights,
                                            float* __restrict sums) {
  const float w0 = weights[0], w1 = weights[1], w2 = weights[2], w3 = weights[3];
  for (int block = 0; block < count; block += kBlock) {
    for (int x = block; x < block + kBlock; ++x) {
      float sum = wide[x] * w3;
      sum = MultiplyAdd<Fused>(wide[x + 1], w2, sum);
      sum = MultiplyAdd<Fused>(wide[x + 2], w1, sum);
      sum = MultiplyAdd<Fused>(wide[x + 3], w0, sum);
      sum = MultiplyAdd<Fused>(wide[x + 4], w1, sum);
      sum = MultiplyAdd<Fused>(wide[x + 5], w2, sum);
      sums[x] = MultiplyAdd<Fused>(wide[x + 6], w3, sum);
    }
  }
}

template <bool Fused>
[[gnu::always_inline]] inline float AlongColumn(const BriefBlur::SumRows& rows, const BriefBlur::Weights& weights,
                                                int x) {
  float sum = rows[3][x] * weights[0];
  sum = MultiplyAdd<Fused>(rows[2][x] + rows[4][x], weights[1], sum);
  sum = MultiplyAdd<Fused>(rows[1][x] + rows[5][x], weights[2], sum);
  return MultiplyAdd<Fused>(rows[0][x] + rows[6][x], weights[3], sum);
}

[[gnu::always_inline]] inline std::uint8_t ToPixel(float sum) {
  const float rounded = sum + kRounder;
  std::uint32_t bits;
  std::memcpy(&bits, &rounded, sizeof bits);
  return static_cast<std::uint8_t>(bits);
}

// 1 where the sum is so near a tie that rounding errors decide.
[[gnu::always_inline]] inline int IsDoubtful(float sum) {
  const float nearest = (sum + kRounder) - kRounder;
  return std::abs(sum - nearest) >= 0.5F - kTieBand ? 1 : 0;
}

[[gnu::always_inline]] inline int FusedColumns(const BriefBlur::SumRows& rows, int count,
                                               const BriefBlur::Weights& weights, std::uint8_t* __restrict blurred) {
  for (int block = 0; block < count; block += kBlock) {
    for (int x = block; x < block + kBlock; ++x) blurred[x] = ToPixel(AlongColumn<true>(rows, weights, x));
  }
  return 0;
}

#if defined(__FP_FAST_FMAF)
constexpr bool kHasFma = true;
#else
constexpr bool kHasFma = false;
#endif

void WidenPlain(const std::uint8_t* pixels, int count, float* wide) { Widen(pixels, count, wide); }
void AlongRowPlain(const float* wide, int count, const BriefBlur::Weights& weights, float* sums) {
  AlongRow<kHasFma>(wide, count, weights, sums);
}
int AlongColumnPlain(const BriefBlur::SumRows& rows, int count, const BriefBlur::Weights& weights,
                     std::uint8_t* blurred, int* doubtful) {
  if (kHasFma) return FusedColumns(rows, count, weights, blurred);
  int doubtful_count = 0;
  for (int block = 0; block < count; block += kBlock) {
    std::array<float, kBlock> sums;
    int is_any_doubtful = 0;
    for (int k = 0; k < kBlock; ++k) {
      const float sum = AlongColumn<false>(rows, weights, block + k);
      sums[static_cast<std::size_t>(k)] = sum;
      is_any_doubtful |= IsDoubtful(sum);
    }
    for (int k = 0; k < kBlock; ++k) blurred[block + k] = ToPixel(sums[static_cast<std::size_t>(k)]);
    for (int k = 0; k < kBlock && is_any_doubtful != 0; ++k) {
      if (IsDoubtful(sums[static_cast<std::size_t>(k)]) != 0) doubtful[doubtful_count++] = block + k;
    }
  }
  return doubtful_count;
}

#if defined(__x86_64__)
PV_TARGET_AVX2_FMA void WidenAvx2(const std::uint8_t* pixels, int count, float* wide) { Widen(pixels, count, wide); }
PV_TARGET_AVX2_FMA void AlongRowAvx2(const float* wide, int count, const BriefBlur::Weights& weights, float* sums) {
  AlongRow<true>(wide, count, weights, sums);
}
PV_TARGET_AVX2_FMA inline __m256i EightAlongColumn(const BriefBlur::SumRows& rows, const BriefBlur::Weights& weights,
                                                   int x) {
  __m256 sum = _mm256_mul_ps(_mm256_loadu_ps(rows[3] + x), _mm256_set1_ps(weights[0]));
  for (std::size_t v = 1; v <= kRadius; ++v) {
    const __m256 pair = _mm256_add_ps(_mm256_loadu_ps(rows[3 - v] + x), _mm256_loadu_ps(rows[3 + v] + x));
    sum = _mm256_fmadd_ps(pair, _mm256_set1_ps(weights[v]), sum);
  }
  return _mm256_cvtps_epi32(sum);
}
PV_TARGET_AVX2_FMA int AlongColumnAvx2(const BriefBlur::SumRows& rows, int count, const BriefBlur::Weights& weights,
                                       std::uint8_t* blurred, int*) {
  for (int x = 0; x < count; x += kBlock) {
    // The packing works on halves: it leaves the quarters in the order 0 2 1 3.
    const __m256i packed = _mm256_permute4x64_epi64(
        _mm256_packs_epi32(EightAlongColumn(rows, weights, x), EightAlongColumn(rows, weights, x + 8)), 0xD8);
    const __m128i pixels = _mm_packus_epi16(_mm256_castsi256_si128(packed), _mm256_extracti128_si256(packed, 1));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(blurred + x), pixels);
  }
  return 0;
}
#endif

// Index of what stands at `i` when the image, of `size` px, is reflected at its outermost pixels.
int Reflect(int i, int size) {
  if (i < 0) return -i;
  return i < size ? i : 2 * (size - 1) - i;
}

std::uint8_t FusedPixel(const cv::Mat& level, const BriefBlur::Weights& weights, int x, int y) {
  std::array<float, 2 * kRadius + 1> sums;
  BriefBlur::SumRows rows;
  for (int v = -kRadius; v <= kRadius; ++v) {
    const std::uint8_t* pixels = level.ptr<std::uint8_t>(Reflect(y + v, level.rows));
    float sum = 0.0F;
    for (int u = -kRadius; u <= kRadius; ++u) {
      const float weight = weights[static_cast<std::size_t>(std::abs(u))];
      sum = std::fma(static_cast<float>(pixels[Reflect(x + u, level.cols)]), weight, sum);
    }
    const std::size_t k = static_cast<std::size_t>(v + kRadius);
    sums[k] = sum;
    rows[k] = &sums[k];
  }
  return ToPixel(AlongColumn<true>(rows, weights, 0));
}

}  // namespace

BriefBlur::Kernel BriefBlur::KernelOf(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx2) return {WidenAvx2, AlongRowAvx2, AlongColumnAvx2};
#endif
  static_cast<void>(set);
  return {WidenPlain, AlongRowPlain, AlongColumnPlain};
}

BriefBlur::BriefBlur(InstructionSet set) : kernel_(KernelOf(set)) {
  const cv::Mat kernel = cv::getGaussianKernel(2 * kRadius + 1, 2.0, CV_32F);
  for (int k = 0; k <= kRadius; ++k) weights_[static_cast<std::size_t>(k)] = kernel.at<float>(kRadius + k);
}

void BriefBlur::Coverage::Reset(int reach_x, int reach_y, std::size_t block_count) {
  reach_x_ = reach_x;
  reach_y_ = reach_y;
  next_ = 0;
  band_ = -1;
  last_row_.assign(block_count, -1);
}

const std::vector<BriefBlur::Coverage::Run>& BriefBlur::Coverage::RunsOf(int row, const std::vector<Corner>& corners) {
  if (row / kRows == band_) return runs_;
  band_ = row / kRows;
  const int first_row = band_ * kRows, last_row = first_row + kRows - 1;
  const int last_block = static_cast<int>(last_row_.size()) - 1;
  for (; next_ < corners.size() && corners[next_].y - reach_y_ <= last_row; ++next_) {
    const Corner& corner = corners[next_];
    const int end = std::min(last_block, (corner.x + reach_x_) / kBlock);
    for (int block = std::max(0, corner.x - reach_x_) / kBlock; block <= end; ++block) {
      last_row_[static_cast<std::size_t>(block)] = corner.y + reach_y_;
    }
  }
  runs_.clear();
  constexpr std::size_t kWord = 64;  // blocks
  for (std::size_t begin = 0; begin < last_row_.size(); begin += kWord) {
    std::uint64_t holds = 0;  // bit k: block begin + k
    for (std::size_t k = 0; k < std::min(kWord, last_row_.size() - begin); ++k) {
      holds |= static_cast<std::uint64_t>(last_row_[begin + k] >= first_row) << k;
    }
    while (holds != 0) {
      const int first = __builtin_ctzll(holds);
      // What follows the run: the lowest bit that is not set from `first` on.
      const std::uint64_t rest = ~(holds >> first);
      const int length = rest == 0 ? static_cast<int>(kWord) : __builtin_ctzll(rest);
      const int block = static_cast<int>(begin) + first;
      runs_.push_back({block * kBlock, (block + length) * kBlock});
      if (first + length >= static_cast<int>(kWord)) break;
      holds = holds >> (first + length) << (first + length);
    }
  }
  return runs_;
}

void BriefBlur::FilterRow(const cv::Mat& level, int y, const std::vector<Coverage::Run>& runs) {
  if (runs.empty()) return;
  kernel_.widen(level.ptr<std::uint8_t>(y), level.cols, &wide_[kRadius]);
  for (int u = 1; u <= kRadius; ++u) {
    const auto at = [&](int x) { return static_cast<std::size_t>(kRadius + x); };
    wide_[at(-u)] = wide_[at(u)];
    wide_[at(level.cols - 1 + u)] = wide_[at(level.cols - 1 - u)];
  }
  for (const Coverage::Run& run : runs) {
    kernel_.along_row(wide_.data() + run.begin, run.end - run.begin, weights_, SumsOf(y) + run.begin);
  }
}

void BriefBlur::FilterColumns(const cv::Mat& level, int y, const std::vector<Coverage::Run>& runs) {
  for (const Coverage::Run& run : runs) {
    SumRows rows;
    for (int v = -kRadius; v <= kRadius; ++v) {
      rows[static_cast<std::size_t>(v + kRadius)] = SumsOf(Reflect(y + v, level.rows)) + run.begin;
    }
    std::uint8_t* blurred = buffer_.ptr<std::uint8_t>(y) + run.begin;
    const int count = kernel_.along_column(rows, run.end - run.begin, weights_, blurred, doubtful_.data());
    for (int k = 0; k < count; ++k) {
      const int x = doubtful_[static_cast<std::size_t>(k)];
      if (run.begin + x < level.cols) blurred[x] = FusedPixel(level, weights_, run.begin + x, y);
    }
  }
}

void BriefBlur::Apply(const cv::Mat& level, const std::vector<Corner>& corners, int reach, cv::Mat* blurred) {
  PV_CHECK(std::min(level.cols, level.rows) >= kMinSide, level.size());
  const std::size_t block_count = static_cast<std::size_t>((level.cols + kBlock - 1) / kBlock);
  stride_ = block_count * kBlock;
  wide_.resize(stride_ + kRadius + kRadius);
  sums_.resize(stride_ * std::tuple_size<SumRows>::value);
  doubtful_.resize(stride_);
  buffer_.create(level.rows, static_cast<int>(stride_), CV_8UC1);
  rows_.Reset(reach, reach + kRadius, block_count);
  columns_.Reset(reach, reach, block_count);
  int next_row = 0;
  for (int y = 0; y < level.rows; ++y) {
    for (; next_row <= std::min(y + kRadius, level.rows - 1); ++next_row) {
      FilterRow(level, next_row, rows_.RunsOf(next_row, corners));
    }
    FilterColumns(level, y, columns_.RunsOf(y, corners));
  }
  *blurred = buffer_.colRange(0, level.cols);
}

}  // namespace planar_vslam
