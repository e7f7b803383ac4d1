#pragma once
// What ties and priors add to H of map_uncertainty.h: entries of its lower triangle.
#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "planar_vslam/optimize/map_ties.h"
#include "planar_vslam/optimize/map_uncertainty.h"

namespace planar_vslam {

constexpr Eigen::Index kSystematicErrors = 3;  // unknowns beside the poses

using InformationEntries = std::vector<Eigen::Triplet<double>>;

// The unknowns of the tie's two poses start at `from` and `to`, the systematic errors at `systematic`.
void AddTieInformation(const MapTie& tie, const Rigid2& T_to_from, Eigen::Index from, Eigen::Index to,
                       Eigen::Index systematic, InformationEntries* entries);
// The first keyframe is fixed; the others are hardly known before the ties say something.
void AddPosePrior(bool first, Eigen::Index at, InformationEntries* entries);
void AddSystematicPrior(const SystematicErrors& errors, Eigen::Index at, InformationEntries* entries);

}  // namespace planar_vslam
