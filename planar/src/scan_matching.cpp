#include "planar_vslam/planar/scan_matching.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace planar_vslam {
namespace {

constexpr double kSurfaceRadius = 0.20;   // m around a point that tell its surface's direction
constexpr int kSurfaceReach = 12;         // beams to either side, at most
constexpr int kMinNeighbors = 4;          // points of a surface
constexpr double kNormalVariance = 1e-3;  // rad^2, of a surface's direction: range noise over the neighbourhood
// Both sweeps err. That neighbouring points share their neighbourhoods takes nothing away: what a mean gains in
// accuracy, the points it is counted for lose in number.
constexpr double kSweeps = 2.0;

// The points next to `i` in beam order that lie within kSurfaceRadius, without a jump in between.
std::pair<std::size_t, std::size_t> Neighborhood(const std::vector<Eigen::Vector2d>& points, std::size_t i) {
  constexpr double kRadius2 = kSurfaceRadius * kSurfaceRadius, kJump2 = 0.25 * kRadius2;
  const auto reaches = [&](std::size_t a, std::size_t b) {
    return (points[b] - points[i]).squaredNorm() <= kRadius2 && (points[b] - points[a]).squaredNorm() <= kJump2;
  };
  std::size_t first = i, last = i;
  while (first > 0 && i - first < kSurfaceReach && reaches(first, first - 1)) --first;
  while (last + 1 < points.size() && last - i < kSurfaceReach && reaches(last, last + 1)) ++last;
  return {first, last};
}

// Whether the middle of a neighbourhood lies off the line through its ends by more than noise: a round pillar's front.
bool IsCurved(const std::vector<Eigen::Vector2d>& points, std::size_t first, std::size_t last,
              const Eigen::Vector2d& mean, const Eigen::Vector2d& normal, double sigma) {
  constexpr double kSigmas = 2.0;
  const std::size_t third = (last - first + 1) / 3;
  double middle = 0.0, ends = 0.0, in_middle = 0.0, at_ends = 0.0;
  for (std::size_t k = first; k <= last; ++k) {
    const bool is_middle = k >= first + third && k + third <= last;
    (is_middle ? middle : ends) += normal.dot(points[k] - mean);
    (is_middle ? in_middle : at_ends) += 1.0;
  }
  if (in_middle == 0.0 || at_ends == 0.0) return false;
  return std::abs(middle / in_middle - ends / at_ends) > kSigmas * sigma * std::sqrt(1.0 / in_middle + 1.0 / at_ends);
}

// Of points around their mean: standard deviations along and across the line that fits best, and that line's normal.
struct LineFit {
  explicit LineFit(const Eigen::Matrix2d& covariance) {
    const double half = 0.5 * (covariance(0, 0) - covariance(1, 1)), mixed = covariance(0, 1);
    const double root = std::sqrt(half * half + mixed * mixed);
    const double mean = 0.5 * covariance.trace();
    along = std::sqrt(std::max(0.0, mean + root));
    across = std::sqrt(std::max(0.0, mean - root));
    if (root <= 0.0) return;
    // cos(2 a) = half / root of the line's angle a; the larger of its cosine and sine comes first.
    const double larger = std::sqrt(0.5 * (1.0 + std::abs(half) / root)), smaller = 0.5 * mixed / (root * larger);
    normal = half >= 0.0 ? Eigen::Vector2d(-smaller, larger) : Eigen::Vector2d(-larger, smaller);
  }
  double along = 0.0, across = 0.0;  // m
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
};

// The surface that beam i of a laser at `laser` has hit.
ScanSurface SurfaceAt(const std::vector<Eigen::Vector2d>& points, std::size_t i, const Eigen::Vector2d& laser,
                      double sigma) {
  const auto [first, last] = Neighborhood(points, i);
  const auto count = static_cast<double>(last - first + 1);
  ScanSurface surface{points[i], Eigen::Vector2d::Zero()};
  if (count < kMinNeighbors) return surface;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t k = first; k <= last; ++k) mean += points[k];
  mean /= count;
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (std::size_t k = first; k <= last; ++k) spread += (points[k] - mean) * (points[k] - mean).transpose();
  const LineFit line(spread / count);
  constexpr double kFlat = 1.5;  // sigmas across a surface that is a line
  constexpr double kLong = 3.0;  // times as long as thick
  if (line.across > kFlat * sigma || line.along < kLong * std::max(line.across, 0.25 * sigma)) return surface;
  if (IsCurved(points, first, last, mean, line.normal, sigma)) return surface;
  const bool away = line.normal.dot(laser - mean) < 0.0;
  return {mean, away ? Eigen::Vector2d(-line.normal) : line.normal};
}

// Reference points in square buckets, for the nearest one within a bucket's size.
class PointGrid {
 public:
  PointGrid(const PreparedScan& scan, double least_cell) {
    const std::vector<Eigen::Vector2d>& points = scan.points;
    constexpr double kMaxCells = 256.0;  // per axis
    Eigen::Vector2d upper = points.front();
    origin_ = upper;
    for (const Eigen::Vector2d& p : points) {
      origin_ = origin_.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
    cell_ = std::max(least_cell, (upper - origin_).maxCoeff() / kMaxCells);
    const Eigen::Vector2i last = CellOf(upper);
    columns_ = last.x() + 1;
    rows_ = last.y() + 1;
    begin_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
    for (const Eigen::Vector2d& p : points) ++begin_[BucketOf(p) + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    points_.resize(points.size());
    normals_.resize(points.size());
    indices_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t slot = next[BucketOf(points[i])]++;
      points_[slot] = points[i];
      normals_[slot] = scan.surfaces[i].normal;
      indices_[slot] = static_cast<int>(i);
    }
  }
  // Index of the nearest point within `radius` <= cell that is not on a wall's other side than a surface with `normal`;
  // -1 where there is none.
  int Nearest(const Eigen::Vector2d& p, const Eigen::Vector2d& normal, double radius) const {
    const Eigen::Vector2i cell = CellOf(p);
    const int first_row = std::max(cell.y() - 1, 0), last_row = std::min(cell.y() + 1, rows_ - 1);
    if (first_row > last_row) return -1;
    int nearest = -1;
    double best = radius * radius;
    for (int column = std::max(cell.x() - 1, 0); column <= std::min(cell.x() + 1, columns_ - 1); ++column) {
      // The buckets of a column are neighbours.
      const std::size_t end = begin_[Bucket(column, last_row) + 1];
      for (std::size_t k = begin_[Bucket(column, first_row)]; k < end; ++k) {
        const double distance = (points_[k] - p).squaredNorm();
        if (distance > best || (distance == best && nearest >= 0) || normals_[k].dot(normal) < 0.0) continue;
        best = distance;
        nearest = indices_[k];
      }
    }
    return nearest;
  }

 private:
  // Points far outside are next to no bucket.
  Eigen::Vector2i CellOf(const Eigen::Vector2d& p) const {
    constexpr double kFar = 1e6;  // cells
    const Eigen::Vector2d cell = (p - origin_) / cell_;
    return {static_cast<int>(std::floor(std::clamp(cell.x(), -kFar, kFar))),
            static_cast<int>(std::floor(std::clamp(cell.y(), -kFar, kFar)))};
  }
  std::size_t Bucket(int column, int row) const {
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(rows_) + static_cast<std::size_t>(row);
  }
  std::size_t BucketOf(const Eigen::Vector2d& p) const {
    const Eigen::Vector2i cell = CellOf(p);
    return Bucket(cell.x(), cell.y());
  }
  Eigen::Vector2d origin_;  // m, corner of the first bucket
  double cell_;             // m
  int columns_ = 0, rows_ = 0;
  std::vector<std::size_t> begin_;        // columns * rows + 1 offsets
  std::vector<Eigen::Vector2d> points_;   // by bucket
  std::vector<Eigen::Vector2d> normals_;  // of points_
  std::vector<int> indices_;              // of points_
};

// One Gauss-Newton step's sums, over the points within `radius` of a reference surface.
struct Normal {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0.0, weights = 0.0;
  int on_surface = 0, considered = 0;
};

Normal Linearize(const PreparedScan& reference, const PointGrid& grid, const PreparedScan& current, const Rigid2& T,
                 double radius, double tukey) {
  Normal sum;
  const Eigen::Matrix2d R = T.R();
  for (std::size_t k = 0; k < current.points.size(); ++k) {
    if (current.surfaces[k].normal.isZero()) continue;  // a leg or an edge: its place on a surface is not known
    ++sum.considered;
    const Eigen::Vector2d& q = current.surfaces[k].point;
    const Eigen::Vector2d p = T.translation + R * q;
    const Eigen::Vector2d own = R * current.surfaces[k].normal;
    const int nearest = grid.Nearest(p, own, radius);
    if (nearest < 0) continue;
    const ScanSurface& surface = reference.surfaces[static_cast<std::size_t>(nearest)];
    constexpr double kSameWay = 0.5;  // cosine between the two normals
    if (surface.normal.isZero() || surface.normal.dot(own) < kSameWay) continue;
    const Eigen::Vector2d normal = (surface.normal + own).normalized();
    const double e = normal.dot(p - surface.point);
    if (std::abs(e) >= tukey) continue;
    const double weight = std::pow(1.0 - (e / tukey) * (e / tukey), 2);
    const Eigen::Vector2d n_current = R.transpose() * normal;
    const Eigen::Vector3d g(n_current.x(), n_current.y(), n_current.dot(Eigen::Vector2d(-q.y(), q.x())));
    sum.H += weight * g * g.transpose();
    sum.b += weight * e * g;
    sum.squares += weight * e * e;
    sum.weights += weight;
    ++sum.on_surface;
  }
  return sum;
}

}  // namespace

PreparedScan PrepareScan(const PlanarScan& scan, const Rigid3& T_frame_laser, const ScanMatchOptions& options) {
  PreparedScan prepared;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = scan.ranges[i];
    if (!(range >= scan.range_min && range < scan.range_max)) continue;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Eigen::Vector3d p = T_frame_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0.0);
    prepared.points.emplace_back(p.head<2>());
  }
  const Eigen::Vector2d laser = T_frame_laser.translation.head<2>();
  prepared.surfaces.reserve(prepared.points.size());
  for (std::size_t i = 0; i < prepared.points.size(); ++i) {
    prepared.surfaces.push_back(SurfaceAt(prepared.points, i, laser, options.range_sigma));
  }
  return prepared;
}

std::optional<ScanMatch> MatchScans(const PreparedScan& reference, const PreparedScan& current, const Rigid2& guess,
                                    const ScanMatchOptions& options) {
  const auto enough = static_cast<std::size_t>(options.min_points);
  if (reference.points.size() < enough || current.points.size() < enough) return std::nullopt;
  constexpr int kIterations = 40;
  constexpr double kConverged = 0.03;  // of a standard deviation: directions nothing faces never quite settle
  constexpr double kShrink = 0.7;      // of the search radius, per iteration
  constexpr double kNear = 5.0;        // sigmas of a range within which a point counts as on a surface
  const PointGrid grid(reference, options.max_offset);
  const double near = kNear * options.range_sigma;
  // Points between the reference's beams are up to half their spacing away along the surface.
  const double least_radius = std::max(near, 0.5 * kSurfaceRadius);
  double reach = options.max_offset;
  Rigid2 T = guess;
  Normal sum;
  bool converged = false;
  for (int i = 0; i < kIterations && !converged; ++i) {
    const bool last_radius = reach <= near;
    sum = Linearize(reference, grid, current, T, std::min(options.max_offset, std::max(reach, least_radius)),
                    std::max(reach, near));
    if (sum.on_surface < options.min_points / 2) return std::nullopt;
    // Normals that err by a few hundredths of a radian make a bare wall seem to tell of motion along it. As much as
    // that is drawn towards the guess, and directions that nothing faces stay where the guess had them.
    const Eigen::Vector3d anchor(kNormalVariance * sum.weights, kNormalVariance * sum.weights, 1e-6 * sum.H.trace());
    const Eigen::Vector3d off = LogSe2(guess.Inverse() * T);
    const Eigen::Vector3d step =
        -(sum.H + Eigen::Matrix3d(anchor.asDiagonal())).ldlt().solve(sum.b + anchor.cwiseProduct(off));
    T = T * ExpSe2(step);
    const double settled = kConverged * options.range_sigma;
    converged = last_radius && step.dot(sum.H * step) < settled * settled;
    reach *= kShrink;
  }
  ScanMatch match;
  match.T_reference_current = T;
  match.share = static_cast<double>(sum.on_surface) / std::max(1, sum.considered);
  match.rms = std::sqrt(sum.squares / std::max(sum.weights, 1e-12));
  if (!converged || match.share < options.min_share || sum.on_surface < options.min_points / 2) return std::nullopt;
  const double sigma = std::max(options.range_sigma, match.rms);
  constexpr double kLeastInformation = 1e-6;  // of points: keeps a direction that nothing faces finite
  match.covariance = kSweeps * sigma * sigma * (sum.H + kLeastInformation * Eigen::Matrix3d::Identity()).inverse();
  return match;
}

PlanarMotion MotionOf(const ScanMatch& match, double seconds) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();  // right perturbation at the current base -> frame of the reference
  B.topLeftCorner<2, 2>() = match.T_reference_current.R();
  PlanarMotion motion;
  motion.T_i_j = match.T_reference_current;
  motion.covariance = B * match.covariance * B.transpose();
  motion.distance = match.T_reference_current.translation.norm();
  motion.turn = std::abs(match.T_reference_current.angle);
  motion.seconds = seconds;
  return motion;
}

}  // namespace planar_vslam
