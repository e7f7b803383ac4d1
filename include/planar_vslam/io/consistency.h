#pragma once
// Whether a trajectory's covariances tell the truth: normalised estimation error squared (NEES).
//   e = Log( T_map_base^-1 T_map_base_true )  on the plane [x, y, heading],   NEES = e^T Sigma^-1 e
// With honest covariances its mean is 3 and 95 % of it lie below 7.815. Below 3 they are too wide, above too narrow.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/evaluation.h"

namespace planar_vslam {

struct StampedCovariance {
  Timestamp stamp;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // right tangent [x, y, heading]: m and rad, base axes
};

// CSV `t,xx,xy,xh,yy,yh,hh`, ascending in t. Errors name file and line.
Expected<std::vector<StampedCovariance>> ReadCovariances(const std::filesystem::path& path);
Expected<bool> WriteCovariances(const std::vector<StampedCovariance>& covariances, const std::filesystem::path& path);

struct Consistency {
  long poses = 0;          // with truth and covariance
  double mean_nees = 0.0;  // 3 expected
  double within_95 = 0.0;  // share of poses inside their 95 % ellipsoid
};
// The map's origin is laid on the truth by `T_truth_map`, or by the first pose, which then does not count. A pose
// without a covariance of the same stamp is an error.
Expected<Consistency> EvaluateConsistency(const Trajectory& estimate, const std::vector<StampedCovariance>& covariances,
                                          const Trajectory& truth,
                                          const std::optional<Rigid3>& T_truth_map = std::nullopt);

}  // namespace planar_vslam
