#include "planar_vslam/feature/instruction_set.h"

namespace planar_vslam {

InstructionSet BestInstructionSet() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return InstructionSet::kAvx2;
  if (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt")) return InstructionSet::kSse42;
#endif
  return InstructionSet::kPlain;
}

std::vector<InstructionSet> UsableInstructionSets() {
  std::vector<InstructionSet> sets{InstructionSet::kPlain};
  if (BestInstructionSet() >= InstructionSet::kSse42) sets.push_back(InstructionSet::kSse42);
  if (BestInstructionSet() >= InstructionSet::kAvx2) sets.push_back(InstructionSet::kAvx2);
  return sets;
}

}  // namespace planar_vslam
