#include "schur_kernel.h"

#include <cstring>

namespace planar_vslam {
namespace {

using Four [[gnu::vector_size(32)]] = double;
using Two [[gnu::vector_size(16)]] = double;

// Six numbers of a column of S or a row of U.
struct Six {
  Four head;
  Two tail;
};

template <class Vector>
[[gnu::always_inline]] inline void Load(const double* from, Vector* to) {
  std::memcpy(to, from, sizeof *to);
}
[[gnu::always_inline]] inline void LoadSix(const double* from, Six* to) {
  Load(from, &to->head);
  Load(from + 4, &to->tail);
}

// block -= U_a^T U_c, of which `rows_a` are the rows of U_a.
[[gnu::always_inline]] inline void SubtractProduct(const Six* rows_a, const double* U_c, Eigen::Index stride,
                                                   double* block) {
  for (int column = 0; column < 6; ++column, block += stride) {
    const double c0 = U_c[column], c1 = U_c[6 + column], c2 = U_c[12 + column];
    Six six;
    LoadSix(block, &six);
    six.head -= rows_a[0].head * c0 + rows_a[1].head * c1 + rows_a[2].head * c2;
    six.tail -= rows_a[0].tail * c0 + rows_a[1].tail * c1 + rows_a[2].tail * c2;
    std::memcpy(block, &six.head, sizeof six.head);
    std::memcpy(block + 4, &six.tail, sizeof six.tail);
  }
}

[[gnu::always_inline]] inline void Subtract(const std::vector<ViewFactor>& U, const std::vector<Eigen::Index>& rows,
                                            Eigen::Index stride, double* S) {
  for (std::size_t a = 0; a < U.size(); ++a) {
    Six rows_a[3];
    for (Eigen::Index k = 0; k < 3; ++k) LoadSix(U[a].data() + 6 * k, &rows_a[k]);
    for (std::size_t c = 0; c <= a; ++c) SubtractProduct(rows_a, U[c].data(), stride, S + rows[a] + rows[c] * stride);
  }
}

void SubtractPlain(const std::vector<ViewFactor>& U, const std::vector<Eigen::Index>& rows, Eigen::Index stride,
                   double* S) {
  Subtract(U, rows, stride, S);
}

#if defined(__x86_64__)
PV_TARGET_AVX2 void SubtractAvx2(const std::vector<ViewFactor>& U, const std::vector<Eigen::Index>& rows,
                                 Eigen::Index stride, double* S) {
  Subtract(U, rows, stride, S);
}
#endif

}  // namespace

SubtractPairs SubtractPairsOf([[maybe_unused]] InstructionSet set) {
#if defined(__x86_64__)
  if (set >= InstructionSet::kAvx2) return SubtractAvx2;
#endif
  return SubtractPlain;
}

}  // namespace planar_vslam
