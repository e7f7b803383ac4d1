#include "corner_kernel.h"

#include <algorithm>
#include <array>
#include <cstring>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace planar_vslam {
namespace {

// The circle, each next to the one before.
constexpr std::array<int, 16> kCircleX = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr std::array<int, 16> kCircleY = {3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};

namespace plain {
#define PV_TARGET
#define PV_VECTOR_BYTES 16
#include "corner_kernel_loops.h"
#undef PV_TARGET
#undef PV_VECTOR_BYTES
}  // namespace plain

#if defined(__x86_64__)
namespace avx2 {
#define PV_TARGET PV_TARGET_AVX2
#define PV_VECTOR_BYTES 32
#include "corner_kernel_loops.h"
#undef PV_TARGET
#undef PV_VECTOR_BYTES
}  // namespace avx2
#endif

}  // namespace

CornerKernel CornerKernelOf(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx2) return {avx2::FindContrast, avx2::FindPeaks};
#endif
  // SSE4.2 has nothing to add: 16 pixels at a time need no more than every x86-64 processor has.
  static_cast<void>(set);
  return {plain::FindContrast, plain::FindPeaks};
}

}  // namespace planar_vslam
