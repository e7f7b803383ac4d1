#include "tie_information.h"

#include <Eigen/LU>

namespace planar_vslam {
namespace {

constexpr double kFixed = 1e12, kLoose = 1e-6;  // a keyframe nothing ties is unknown, not an error

}  // namespace

void AddTieInformation(const MapTie& tie, const Rigid2& T_to_from, Eigen::Index from, Eigen::Index to,
                       Eigen::Index systematic, InformationEntries* entries) {
  std::vector<Eigen::Index> columns = {from, from + 1, from + 2, to, to + 1, to + 2};
  Eigen::Matrix<double, 3, 7> J = Eigen::Matrix<double, 3, 7>::Zero();
  J.leftCols<3>() = -AdjointSe2(T_to_from);
  J.middleCols<3>(3).setIdentity();
  if (tie.source != TieSource::kLandmarks) {
    columns.push_back(systematic + static_cast<Eigen::Index>(tie.source));
    J.rightCols<1>().head<2>() = T_to_from.translation;  // -R_i_j^T t_i_j
  }
  const Eigen::Matrix<double, 7, 7> H = J.transpose() * tie.covariance.inverse() * J;
  for (std::size_t r = 0; r < columns.size(); ++r) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (columns[r] < columns[c]) continue;
      entries->emplace_back(columns[r], columns[c], H(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)));
    }
  }
}

void AddPosePrior(bool first, Eigen::Index at, InformationEntries* entries) {
  for (Eigen::Index k = at; k < at + 3; ++k) entries->emplace_back(k, k, first ? kFixed : kLoose);
}

void AddSystematicPrior(const SystematicErrors& errors, Eigen::Index at, InformationEntries* entries) {
  for (Eigen::Index k = at; k < at + 2; ++k) entries->emplace_back(k, k, kLoose);
  entries->emplace_back(at, at, 1.0 / (errors.wheels * errors.wheels));
  entries->emplace_back(at + 1, at + 1, 1.0 / (errors.laser * errors.laser));
}

}  // namespace planar_vslam
