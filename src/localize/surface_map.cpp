#include "planar_vslam/localize/surface_map.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "planar_vslam/geometry/chi_square.h"

namespace planar_vslam {
namespace {

constexpr double kSquare = 0.05;  // m
constexpr double kBlock = 1.0;    // m
constexpr double kSector = M_PI / 4.0;

int FloorDivide(double value, double size) { return static_cast<int>(std::floor(value / size)); }

// Furniture moves: fewer points than between two sweeps of one drive have to find their surface. What the map's
// surfaces are off by is the same for many sweeps in a row, which do not average it out.
ScanMatchOptions AgainstMap(ScanMatchOptions options) {
  constexpr double kLeastShare = 0.45;
  constexpr double kMapPosition = 0.01;  // m
  constexpr double kMapHeading = DegreesToRadians(0.2);
  options.floor.position = std::max(options.floor.position, kMapPosition);
  options.floor.heading = std::max(options.floor.heading, kMapHeading);
  options.min_share = std::min(options.min_share, kLeastShare);
  return options;
}

}  // namespace

SurfaceMap::SurfaceMap(const std::vector<PosedSweep>& sweeps, const ScanMatchOptions& options)
    : options_(AgainstMap(options)) {
  std::map<std::tuple<int, int, int>, std::pair<ScanSurface, int>> sums;
  for (const PosedSweep& sweep : sweeps) {
    const Rigid3 T_map_laser = Embed3(sweep.T_map_base) * sweep.T_base_laser;
    const PreparedScan prepared = PrepareScan(*sweep.scan, T_map_laser, options_);
    for (const ScanSurface& surface : prepared.surfaces) {
      if (surface.normal.isZero()) continue;
      // The two sides of a thin wall have opposite normals.
      const Eigen::Vector2d& normal = surface.normal;
      const int sector = static_cast<int>(std::lround(std::atan2(normal.y(), normal.x()) / kSector)) & 7;
      auto& [sum, count] =
          sums[{FloorDivide(surface.point.x(), kSquare), FloorDivide(surface.point.y(), kSquare), sector}];
      sum.point += surface.point;
      sum.normal += normal;
      ++count;
    }
  }
  for (const auto& [square, of_square] : sums) {
    const auto& [sum, count] = of_square;
    const ScanSurface mean{sum.point / count, sum.normal.normalized()};
    blocks_[{FloorDivide(mean.point.x(), kBlock), FloorDivide(mean.point.y(), kBlock)}].push_back(mean);
  }
}

PreparedScan SurfaceMap::Around(const Eigen::Vector2d& p_map, double radius) const {
  PreparedScan around;
  const int reach = static_cast<int>(std::ceil(radius / kBlock));
  const int column = FloorDivide(p_map.x(), kBlock), row = FloorDivide(p_map.y(), kBlock);
  for (int x = column - reach; x <= column + reach; ++x) {
    const auto end = blocks_.upper_bound({x, row + reach});
    for (auto block = blocks_.lower_bound({x, row - reach}); block != end; ++block) {
      for (const ScanSurface& surface : block->second) {
        around.points.push_back(surface.point);
        around.surfaces.push_back(surface);
      }
    }
  }
  return around;
}

std::optional<LaserFix> SurfaceMap::Fix(const PlanarScan& scan, const Rigid3& T_base_laser, const Rigid2& guess,
                                        const Eigen::Matrix3d& covariance) const {
  constexpr double kCompletePosition = 0.05;  // m
  constexpr double kCompleteAngle = DegreesToRadians(1.5);
  constexpr double kSigmas = 3.0;       // of the guess: at a metre, and of the heading in radians
  constexpr double kLeastOffset = 0.1;  // m
  const PreparedScan current = PrepareScan(scan, T_base_laser, options_);
  double farthest = 0.0;
  for (const Eigen::Vector2d& p : current.points) farthest = std::max(farthest, p.norm());
  const PreparedScan around = Around(guess.translation, farthest + options_.max_offset);
  if (around.points.empty()) return std::nullopt;
  // Where the guess is good, a wide search for surfaces would only find wrong ones.
  ScanMatchOptions options = options_;
  const double sigma = std::sqrt(covariance.diagonal().head<2>().maxCoeff()) + std::sqrt(covariance(2, 2));
  options.max_offset = std::clamp(kSigmas * sigma, std::min(kLeastOffset, options_.max_offset), options_.max_offset);
  const std::optional<ScanMatch> match = MatchScans(around, current, guess, options);
  if (!match.has_value()) return std::nullopt;
  const Eigen::Vector3d floors(options_.floor.position, options_.floor.position, options_.floor.heading);
  LaserFix fix{match->T_reference_current, match->covariance, false};
  fix.covariance.diagonal() += floors.cwiseAbs2();
  const Eigen::Vector3d off = LogSe2(guess.Inverse() * fix.T_map_base);
  const Eigen::Matrix3d expected = covariance + fix.covariance;
  if (off.dot(expected.ldlt().solve(off)) > kChi2ThreeDof999) return std::nullopt;
  const Eigen::Matrix2d position = fix.covariance.topLeftCorner<2, 2>();
  const double largest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(position).eigenvalues().maxCoeff();
  fix.complete =
      largest < kCompletePosition * kCompletePosition && fix.covariance(2, 2) < kCompleteAngle * kCompleteAngle;
  return fix;
}

}  // namespace planar_vslam
