#pragma once
// Bundle adjustment of a neighbourhood: Levenberg-Marquardt on poses and points with a dense Schur complement, written
// for this one shape of problem. It minimises what SolveWithCeres minimises (bundle_problem.h); losses enter by their
// weights rho' (iteratively reweighted least squares).
//
// Steps of a pose are in the axes of the map, at the base:  p <- p + d_t,  R <- Exp(d_r) R.  With l the point,
// v = l - p, and J = de/dl (2x3, over the pixel sigma, reprojection_factor.h), a point seen from the pose gives
//   de/d[d_t, d_r] = J M,   M = [ -I  [v]x ]   (3x6),
// so all that an observation of weight w adds comes from the two values  A = w J^T J  (3x3) and  g = w J^T e:
//   H_ll += A,  b_l += g,   H_pp += M^T A M,  b_p += M^T g,   H_lp = A M.
// Points are eliminated one by one. With H_ll + damping = K K^T (Cholesky),
//   U_a = K^-1 A_a M_a  (3x6, of each free pose a that sees the point),  u = K^-1 b_l,
//   S_ab = H_ab - sum_l U_a^T U_b,   r_a = -b_a + sum_l U_a^T u,   S d_p = r,
//   d_l = -K^-T (u + sum_a U_a d_a).
// Motion links (relative_pose_factor.h) and the floor prior (planar_prior.h) have their Jacobians for right
// perturbations d = blkdiag(R^T, R^T) [d_t, d_r]. A planar pose keeps the columns x, y and yaw, which are its three
// degrees of freedom in these axes (pose_manifold.h).
//
// Damping is lambda times the diagonal of H; lambda follows the ratio of the true to the predicted decrease as in
// H. B. Nielsen, Damping Parameter in Marquardt's Method (IMM-REP-1999-05).
#include "bundle_problem.h"

namespace planar_vslam {

// Moves poses and points to the least cost found. Deterministic: sums in the order of the problem.
BundleOutcome SolveWithSchur(BundleProblem* problem, const BundleLimits& limits);

}  // namespace planar_vslam
