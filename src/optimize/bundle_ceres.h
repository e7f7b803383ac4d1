#pragma once
// Bundle adjustment by Ceres: what adjusts the whole map, and the oracle of schur_solver.h.
#include "bundle_problem.h"

namespace planar_vslam {

// Moves poses and points to the least cost found. Deterministic: one thread, blocks in id
// order in one buffer. Sparse Schur beyond about 60 free poses.
BundleOutcome SolveWithCeres(BundleProblem* problem, const BundleLimits& limits);

}  // namespace planar_vslam
