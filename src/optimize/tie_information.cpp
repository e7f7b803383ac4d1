#include "tie_information.h"

#include <Eigen/LU>
#include <vector>

namespace planar_vslam {
namespace {

constexpr double kFixed = 1e12, kLoose = 1e-6;  // a keyframe nothing ties is unknown, not an error
constexpr Eigen::Index kLengthOfWheels = 0, kLengthOfLaser = 1, kTurnOfWheels = 2;  // the systematic errors

}  // namespace

void AddTieInformation(const MapTie& tie, const Rigid2& T_to_from, Eigen::Index from, Eigen::Index to,
                       Eigen::Index systematic, InformationEntries* entries) {
  std::vector<Eigen::Index> columns = {from, from + 1, from + 2, to, to + 1, to + 2};
  Eigen::Matrix<double, 3, 8> J = Eigen::Matrix<double, 3, 8>::Zero();
  J.leftCols<3>() = -AdjointSe2(T_to_from);
  J.middleCols<3>(3).setIdentity();
  J.col(6).head<2>() = T_to_from.translation;  // -R_i_j^T t_i_j
  J(2, 7) = T_to_from.angle;                   // -phi_i_j
  Eigen::Matrix3d covariance = tie.covariance;
  if (tie.source == TieSource::kLandmarks) {
    covariance.topLeftCorner<2, 2>() += T_to_from.translation * T_to_from.translation.transpose();
  } else {
    columns.push_back(systematic + (tie.source == TieSource::kWheels ? kLengthOfWheels : kLengthOfLaser));
  }
  if (tie.source == TieSource::kWheels) columns.push_back(systematic + kTurnOfWheels);
  const Eigen::Matrix<double, 8, 8> H = J.transpose() * covariance.inverse() * J;
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
  const auto add = [&](Eigen::Index k, double sigma) { entries->emplace_back(at + k, at + k, 1.0 / (sigma * sigma)); };
  add(kLengthOfWheels, errors.wheels);
  add(kLengthOfLaser, errors.laser);
  add(kTurnOfWheels, errors.turn);
}

}  // namespace planar_vslam
