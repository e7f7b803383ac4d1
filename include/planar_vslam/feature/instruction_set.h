#pragma once
// Which instructions the inner loops of this module use. The processor decides at run time; all choices give the same
// bits.
#include <vector>

namespace planar_vslam {

enum class InstructionSet {
  kPlain,  // what every processor of the architecture has
  kSse42,  // x86-64 with SSE4.2 and POPCNT
  kAvx2,   // x86-64 with AVX2, FMA and POPCNT
};

// What this processor has, the best last.
std::vector<InstructionSet> UsableInstructionSets();
InstructionSet BestInstructionSet();

}  // namespace planar_vslam

// Put before a function, they let the compiler use these instructions in that function alone. Without FMA the compiler
// cannot fuse a product with a sum, which would change its rounding.
#if defined(__x86_64__)
#define PV_TARGET_SSE42 __attribute__((target("sse4.2,popcnt")))
#define PV_TARGET_AVX2 __attribute__((target("avx2,popcnt")))
#define PV_TARGET_AVX2_FMA __attribute__((target("avx2,fma")))
#endif
