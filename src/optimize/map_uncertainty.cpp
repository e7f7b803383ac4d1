#include "planar_vslam/optimize/map_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tie_information.h"

namespace planar_vslam {
namespace {

Eigen::Matrix3d Symmetric(const Eigen::Matrix3d& block) { return 0.5 * (block + block.transpose()); }

}  // namespace

MapUncertainty::MapUncertainty(const Map& map, const std::vector<MapTie>& ties, const SystematicErrors& systematic) {
  for (const auto& [id, keyframe] : map.keyframes) poses_.Insert(id, ProjectToPlane(keyframe.T_map_base));
  size_ = static_cast<Eigen::Index>(3 * poses_.size()) + kSystematicErrors;
  std::vector<Eigen::Index> at(map.next_keyframe_id);  // by id
  Eigen::Index next = 0;
  for (const auto& [id, pose] : poses_) at[id.value] = std::exchange(next, next + 3);
  InformationEntries entries;
  for (const MapTie& tie : ties) {
    const Rigid2 T_to_from = poses_.At(tie.to).Inverse() * poses_.At(tie.from);
    AddTieInformation(tie, T_to_from, at[tie.from.value], at[tie.to.value], next, &entries);
  }
  for (Eigen::Index k = 0; k < next; k += 3) AddPosePrior(k == 0, k, &entries);
  AddSystematicPrior(systematic, next, &entries);
  Eigen::SparseMatrix<double> H(size_, size_);
  H.setFromTriplets(entries.begin(), entries.end());
  solver_.compute(H);
}

// The columns of H^-1 of these poses, three a pose.
Eigen::MatrixXd MapUncertainty::Columns(const std::vector<Eigen::Index>& poses) const {
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(size_, 3 * static_cast<Eigen::Index>(poses.size()));
  for (std::size_t k = 0; k < poses.size(); ++k) {
    right.block<3, 3>(3 * poses[k], 3 * static_cast<Eigen::Index>(k)).setIdentity();
  }
  return solver_.solve(right);
}

Eigen::Matrix3d MapUncertainty::CovarianceOf(KeyframeId id) const {
  const auto at = static_cast<Eigen::Index>(poses_.IndexOf(id));
  if (at == 0) return Eigen::Matrix3d::Zero();
  return Symmetric(Columns({at}).middleRows<3>(3 * at));
}

Eigen::Matrix3d MapUncertainty::CovarianceBetween(KeyframeId from, KeyframeId to) const {
  const auto i = static_cast<Eigen::Index>(poses_.IndexOf(from)), j = static_cast<Eigen::Index>(poses_.IndexOf(to));
  const Eigen::MatrixXd columns = Columns({i, j});
  Eigen::Matrix<double, 6, 6> joint;
  joint.topRows<3>() = columns.middleRows<3>(3 * i);
  joint.bottomRows<3>() = columns.middleRows<3>(3 * j);
  Eigen::Matrix<double, 3, 6> J;
  J.leftCols<3>() = -AdjointSe2(poses_.At(to).Inverse() * poses_.At(from));
  J.rightCols<3>().setIdentity();
  return Symmetric(J * joint * J.transpose());
}

std::optional<double> MapUncertainty::ScaleSigma() const {
  constexpr double kOnePlace = 0.01;  // m^2
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& [id, pose] : poses_) mean += pose.translation / static_cast<double>(poses_.size());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size_);
  double squares = 0.0;
  Eigen::Index at = 0;
  for (const auto& [id, pose] : poses_) {
    const Eigen::Vector2d arm = pose.translation - mean;
    gradient.segment<2>(at) = pose.R().transpose() * arm;  // dp = R dt of the right tangent
    squares += arm.squaredNorm();
    at += 3;
  }
  if (squares < kOnePlace) return std::nullopt;
  gradient /= squares;
  return std::sqrt(std::max(0.0, gradient.dot(solver_.solve(gradient))));
}

}  // namespace planar_vslam
