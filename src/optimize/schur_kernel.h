#pragma once
// The innermost loop of the elimination of points, for the processor at hand; all choices give the same bits.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/feature/instruction_set.h"

namespace planar_vslam {

using ViewFactor = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;

// S(rows[a], rows[c]) -= U[a]^T U[c], blocks of 6 x 6, for all c <= a. S is stored by columns of length `stride`.
using SubtractPairs = void (*)(const std::vector<ViewFactor>& U, const std::vector<Eigen::Index>& rows,
                               Eigen::Index stride, double* S);
SubtractPairs SubtractPairsOf(InstructionSet set);

}  // namespace planar_vslam
