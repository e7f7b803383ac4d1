#include "brief_blur.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "planar_vslam/geometry/check.h"

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

template <bool kFused>
[[gnu::always_inline]] inline float MultiplyAdd(float a, float b, float c) {
  return kFused ? __builtin_fmaf(a, b, c) : a * b + c;
}

template <bool kFused>
[[gnu::always_inline]] inline void AlongRow(const float* __restrict wide, const BriefBlur::Weights& weights,
                                            float* __restrict sums) {
  const float w0 = weights[0], w1 = weights[1], w2 = weights[2], w3 = weights[3];
  for (int x = 0; x < kBlock; ++x) {
    float sum = wide[x] * w3;
    sum = MultiplyAdd<kFused>(wide[x + 1], w2, sum);
    sum = MultiplyAdd<kFused>(wide[x + 2], w1, sum);
    sum = MultiplyAdd<kFused>(wide[x + 3], w0, sum);
    sum = MultiplyAdd<kFused>(wide[x + 4], w1, sum);
    sum = MultiplyAdd<kFused>(wide[x + 5], w2, sum);
    sums[x] = MultiplyAdd<kFused>(wide[x + 6], w3, sum);
  }
}

template <bool kFused>
[[gnu::always_inline]] inline float AlongColumn(const BriefBlur::SumRows& rows, const BriefBlur::Weights& weights,
                                                int x) {
  float sum = rows[3][x] * weights[0];
  sum = MultiplyAdd<kFused>(rows[2][x] + rows[4][x], weights[1], sum);
  sum = MultiplyAdd<kFused>(rows[1][x] + rows[5][x], weights[2], sum);
  return MultiplyAdd<kFused>(rows[0][x] + rows[6][x], weights[3], sum);
}

[[gnu::always_inline]] inline std::uint8_t ToPixel(float sum) {
  const float rounded = sum + kRounder;
  std::uint32_t bits;
  std::memcpy(&bits, &rounded, sizeof bits);
  return static_cast<std::uint8_t>(bits);
}

[[gnu::always_inline]] inline void FusedColumns(const BriefBlur::SumRows& rows, const BriefBlur::Weights& weights,
                                                std::uint8_t* __restrict blurred) {
  for (int x = 0; x < kBlock; ++x) blurred[x] = ToPixel(AlongColumn<true>(rows, weights, x));
}

#if defined(__FP_FAST_FMAF)
constexpr bool kHasFma = true;
#else
constexpr bool kHasFma = false;
#endif

void WidenPlain(const std::uint8_t* pixels, int count, float* wide) { Widen(pixels, count, wide); }
void AlongRowPlain(const float* wide, const BriefBlur::Weights& weights, float* sums) {
  AlongRow<kHasFma>(wide, weights, sums);
}
bool AlongColumnPlain(const BriefBlur::SumRows& rows, const BriefBlur::Weights& weights, std::uint8_t* blurred) {
  if (kHasFma) {
    FusedColumns(rows, weights, blurred);
    return true;
  }
  float farthest = 0.0F;  // from an integer
  for (int x = 0; x < kBlock; ++x) {
    const float sum = AlongColumn<false>(rows, weights, x);
    blurred[x] = ToPixel(sum);
    farthest = std::max(farthest, std::abs(sum - static_cast<float>(blurred[x])));
  }
  return farthest < 0.5F - kTieBand;
}

#if defined(__x86_64__)
PV_TARGET_AVX2_FMA void WidenAvx2(const std::uint8_t* pixels, int count, float* wide) { Widen(pixels, count, wide); }
PV_TARGET_AVX2_FMA void AlongRowAvx2(const float* wide, const BriefBlur::Weights& weights, float* sums) {
  AlongRow<true>(wide, weights, sums);
}
PV_TARGET_AVX2_FMA bool AlongColumnAvx2(const BriefBlur::SumRows& rows, const BriefBlur::Weights& weights,
                                        std::uint8_t* blurred) {
  FusedColumns(rows, weights, blurred);
  return true;
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

void BriefBlur::Coverage::Reset(std::size_t block_count) {
  last_row_.assign(block_count, -1);
  next_ = 0;
}

void BriefBlur::Coverage::MoveTo(int row, const std::vector<Corner>& corners, int reach_x, int reach_y) {
  const int last_block = static_cast<int>(last_row_.size()) - 1;
  for (; next_ < corners.size() && corners[next_].y - reach_y <= row; ++next_) {
    const Corner& corner = corners[next_];
    const int end = std::min(last_block, (corner.x + reach_x) / kBlock);
    for (int block = std::max(0, corner.x - reach_x) / kBlock; block <= end; ++block) {
      last_row_[static_cast<std::size_t>(block)] = corner.y + reach_y;
    }
  }
}

void BriefBlur::FilterRow(const cv::Mat& level, int y) {
  kernel_.widen(level.ptr<std::uint8_t>(y), level.cols, &wide_[kRadius]);
  for (int u = 1; u <= kRadius; ++u) {
    const auto at = [&](int x) { return static_cast<std::size_t>(kRadius + x); };
    wide_[at(-u)] = wide_[at(u)];
    wide_[at(level.cols - 1 + u)] = wide_[at(level.cols - 1 - u)];
  }
  float* sums = SumsOf(y);
  for (std::size_t block = 0; block < block_count_; ++block) {
    if (rows_.Holds(block, y)) kernel_.along_row(&wide_[block * kBlock], weights_, sums + block * kBlock);
  }
}

void BriefBlur::FilterColumns(const cv::Mat& level, int y) {
  SumRows rows;
  for (int v = -kRadius; v <= kRadius; ++v) {
    rows[static_cast<std::size_t>(v + kRadius)] = SumsOf(Reflect(y + v, level.rows));
  }
  std::uint8_t* blurred = buffer_.ptr<std::uint8_t>(y);
  for (std::size_t block = 0; block < block_count_; ++block) {
    if (columns_.Holds(block, y) && !kernel_.along_column(rows, weights_, blurred)) {
      const int begin = static_cast<int>(block) * kBlock, end = std::min(begin + kBlock, level.cols);
      for (int x = begin; x < end; ++x) blurred[x - begin] = FusedPixel(level, weights_, x, y);
    }
    for (const float*& row : rows) row += kBlock;
    blurred += kBlock;
  }
}

void BriefBlur::Apply(const cv::Mat& level, const std::vector<Corner>& corners, int reach, cv::Mat* blurred) {
  PV_CHECK(std::min(level.cols, level.rows) >= kMinSide, level.size());
  block_count_ = static_cast<std::size_t>((level.cols + kBlock - 1) / kBlock);
  stride_ = block_count_ * kBlock;
  wide_.resize(stride_ + 2 * kRadius);
  sums_.resize(stride_ * (2 * kRadius + 1));
  buffer_.create(level.rows, static_cast<int>(stride_), CV_8UC1);
  rows_.Reset(block_count_);
  columns_.Reset(block_count_);
  int next_row = 0;
  for (int y = 0; y < level.rows; ++y) {
    for (; next_row <= std::min(y + kRadius, level.rows - 1); ++next_row) {
      rows_.MoveTo(next_row, corners, reach, reach + kRadius);
      FilterRow(level, next_row);
    }
    columns_.MoveTo(y, corners, reach, reach);
    FilterColumns(level, y);
  }
  *blurred = buffer_.colRange(0, level.cols);
}

}  // namespace planar_vslam
