#pragma once
// Least-squares alignment of paired points: target ~ scale * T_target_source * source (Umeyama 1991; Horn 1987).
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

struct Similarity3 {
  double scale = 1.0;
  Rigid3 T_target_source;
  Eigen::Vector3d Apply(const Eigen::Vector3d& p_source) const {
    return T_target_source.rotation * (scale * p_source) + T_target_source.translation;
  }
};

enum class Alignment { kNone, kSe2, kSe3, kSim3 };

// kSe2 rotates about z only and leaves z untouched. Needs equal sizes; fewer than 3 pairs (2 for kSe2) give identity.
Similarity3 AlignPoints(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target,
                        Alignment alignment);

}  // namespace planar_vslam
