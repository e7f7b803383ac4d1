#include "planar_vslam/optimize/map_uncertainty.h"

namespace planar_vslam {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

// One tie's share of H. The systematic error of its source, if it has one, is the last column.
void AddTie(const MapTie& tie, const Rigid2& T_j_i, std::size_t systematic_at, Triplets* entries) {
  std::vector<std::size_t> columns = {3 * tie.i, 3 * tie.i + 1, 3 * tie.i + 2, 3 * tie.j, 3 * tie.j + 1, 3 * tie.j + 2};
  Eigen::Matrix<double, 3, 7> J = Eigen::Matrix<double, 3, 7>::Zero();
  J.leftCols<3>() = -AdjointSe2(T_j_i);
  J.middleCols<3>(3).setIdentity();
  if (tie.source != TieSource::kLandmarks) {
    columns.push_back(systematic_at + static_cast<std::size_t>(tie.source));
    J.rightCols<1>().head<2>() = T_j_i.translation;  // -R_i_j^T t_i_j
  }
  const Eigen::Matrix<double, 7, 7> H = J.transpose() * tie.covariance.inverse() * J;
  for (std::size_t r = 0; r < columns.size(); ++r) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      entries->emplace_back(static_cast<int>(columns[r]), static_cast<int>(columns[c]),
                            H(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)));
    }
  }
}

Eigen::Matrix3d Symmetric(const Eigen::Matrix3d& block) { return 0.5 * (block + block.transpose()); }

}  // namespace

MapUncertainty::MapUncertainty(const Map& map, const std::vector<MapTie>& ties, const SystematicErrors& systematic) {
  for (const auto& [id, keyframe] : map.keyframes) poses_.Insert(id, ProjectToPlane(keyframe.T_map_base));
  const std::size_t systematic_at = 3 * poses_.size();
  size_ = static_cast<Eigen::Index>(systematic_at + 2);
  Triplets entries;
  for (const MapTie& tie : ties) {
    const Rigid2 T_j_i = poses_.EntryAt(tie.j).second.Inverse() * poses_.EntryAt(tie.i).second;
    AddTie(tie, T_j_i, systematic_at, &entries);
  }
  constexpr double kFixed = 1e12, kLoose = 1e-6;  // a keyframe nothing ties is unknown, not an error
  for (Eigen::Index k = 0; k < size_; ++k) entries.emplace_back(k, k, k < 3 ? kFixed : kLoose);
  entries.emplace_back(size_ - 2, size_ - 2, 1.0 / (systematic.wheels * systematic.wheels));
  entries.emplace_back(size_ - 1, size_ - 1, 1.0 / (systematic.laser * systematic.laser));
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

}  // namespace planar_vslam
