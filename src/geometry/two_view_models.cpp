#include "two_view_models.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/geometry/chi_square.h"

namespace planar_vslam {

namespace {

constexpr int kRefits = 3;  // rounds of refitting to all inliers of a new best sample

using Points = std::vector<Eigen::Vector2d>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Sample = std::array<std::size_t, kTwoViewSample>;

// Hartley's normalisation: centred, mean distance sqrt(2).
struct NormalizedPoints {
  Points points;
  Eigen::Matrix3d from_pixels = Eigen::Matrix3d::Identity();

  explicit NormalizedPoints(const Points& pixels) : points(pixels) {
    const double count = static_cast<double>(pixels.size());
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& pixel : pixels) mean += pixel / count;
    double distance = 0.0;
    for (const Eigen::Vector2d& pixel : pixels) distance += (pixel - mean).norm() / count;
    const double scale = distance > 0.0 ? std::sqrt(2.0) / distance : 1.0;
    for (Eigen::Vector2d& point : points) point = scale * (point - mean);
    from_pixels << scale, 0.0, -scale * mean.x(), 0.0, scale, -scale * mean.y(), 0.0, 0.0, 1.0;
  }
};

struct NormalizedMatches {
  NormalizedPoints first;
  NormalizedPoints second;
};

// The unit vector `gram` shrinks most, as a row-major 3x3 matrix.
Eigen::Matrix3d SmallestEigenvectorMatrix(const Matrix9d& gram) {
  const Eigen::SelfAdjointEigenSolver<Matrix9d> solver(gram);
  const Vector9d v = solver.eigenvectors().col(0);
  Eigen::Matrix3d matrix;
  matrix << v(0), v(1), v(2), v(3), v(4), v(5), v(6), v(7), v(8);
  return matrix;
}

class HomographyModel {
 public:
  static constexpr std::size_t kSamplePoints = 4;
  static constexpr double kThreshold = kChi2TwoDof95;

  explicit HomographyModel(const Eigen::Matrix3d& H) : forward_(H), backward_(H.inverse()) {}

  // Direct linear transform (Hartley and Zisserman alg. 4.2).
  template <class Indices>
  static Eigen::Matrix3d Fit(const NormalizedMatches& matches, const Indices& indices, std::size_t count) {
    Matrix9d gram = Matrix9d::Zero();
    for (std::size_t k = 0; k < count; ++k) {
      const Eigen::Vector3d p = matches.first.points[indices[k]].homogeneous();
      const Eigen::Vector2d q = matches.second.points[indices[k]];
      Vector9d row;
      row << Eigen::Vector3d::Zero(), -p, q.y() * p;
      gram += row * row.transpose();
      row << p, Eigen::Vector3d::Zero(), -q.x() * p;
      gram += row * row.transpose();
    }
    return matches.second.from_pixels.inverse() * SmallestEigenvectorMatrix(gram) * matches.first.from_pixels;
  }

  // Squared pixels. Not finite where a point goes to infinity.
  double ErrorInSecond(const Eigen::Vector2d& first, const Eigen::Vector2d& second) const {
    return ((forward_ * first.homogeneous()).hnormalized() - second).squaredNorm();
  }
  double ErrorInFirst(const Eigen::Vector2d& first, const Eigen::Vector2d& second) const {
    return ((backward_ * second.homogeneous()).hnormalized() - first).squaredNorm();
  }

 private:
  Eigen::Matrix3d forward_;
  Eigen::Matrix3d backward_;
};

class FundamentalModel {
 public:
  static constexpr std::size_t kSamplePoints = kTwoViewSample;
  static constexpr double kThreshold = kChi2OneDof95;

  explicit FundamentalModel(const Eigen::Matrix3d& F) : forward_(F), backward_(F.transpose()) {}

  // Eight-point algorithm (Hartley and Zisserman alg. 11.1).
  template <class Indices>
  static Eigen::Matrix3d Fit(const NormalizedMatches& matches, const Indices& indices, std::size_t count) {
    Matrix9d gram = Matrix9d::Zero();
    for (std::size_t k = 0; k < count; ++k) {
      const Eigen::Vector3d p = matches.first.points[indices[k]].homogeneous();
      const Eigen::Vector2d q = matches.second.points[indices[k]];
      Vector9d row;
      row << q.x() * p, q.y() * p, p;
      gram += row * row.transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(SmallestEigenvectorMatrix(gram),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Vector3d rank_two(svd.singularValues()(0), svd.singularValues()(1), 0.0);
    const Eigen::Matrix3d F = svd.matrixU() * rank_two.asDiagonal() * svd.matrixV().transpose();
    return matches.second.from_pixels.transpose() * F * matches.first.from_pixels;
  }

  // Squared pixels to the epipolar line.
  double ErrorInSecond(const Eigen::Vector2d& first, const Eigen::Vector2d& second) const {
    return SquaredDistance(forward_ * first.homogeneous(), second);
  }
  double ErrorInFirst(const Eigen::Vector2d& first, const Eigen::Vector2d& second) const {
    return SquaredDistance(backward_ * second.homogeneous(), first);
  }

 private:
  static double SquaredDistance(const Eigen::Vector3d& line, const Eigen::Vector2d& point) {
    const double signed_distance = line.dot(point.homogeneous());
    return signed_distance * signed_distance / line.head<2>().squaredNorm();
  }

  Eigen::Matrix3d forward_;
  Eigen::Matrix3d backward_;
};

// Mur-Artal et al. eq. 2: each transfer error under the model's threshold adds what it stays under the common
// threshold, so that the scores of both models compare. An inlier is under the threshold both ways.
template <class Model>
double Score(const Model& model, const Points& first, const Points& second, double sigma,
             std::vector<std::size_t>* inliers) {
  // Both keypoints of a match are uncertain; between views of like scale their variances add.
  const double inverse_variance = 1.0 / (2.0 * sigma * sigma);
  double score = 0.0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const double in_second = model.ErrorInSecond(first[i], second[i]) * inverse_variance;
    const double in_first = model.ErrorInFirst(first[i], second[i]) * inverse_variance;
    if (in_second < Model::kThreshold) score += kChi2TwoDof95 - in_second;
    if (in_first < Model::kThreshold) score += kChi2TwoDof95 - in_first;
    if (inliers != nullptr && in_second < Model::kThreshold && in_first < Model::kThreshold) inliers->push_back(i);
  }
  return score;
}

template <class Model>
ModelFit Scored(const Eigen::Matrix3d& matrix, const Points& first, const Points& second, double sigma) {
  ModelFit fit;
  fit.matrix = matrix;
  fit.score = Score(Model(matrix), first, second, sigma, &fit.inliers);
  return fit;
}

template <class Model>
ModelFit FitRobustly(const Points& first, const Points& second, const NormalizedMatches& matches,
                     const std::vector<Sample>& samples, double sigma) {
  ModelFit best;
  for (const Sample& sample : samples) {
    const Eigen::Matrix3d matrix = Model::Fit(matches, sample, Model::kSamplePoints);
    if (!(Score(Model(matrix), first, second, sigma, nullptr) > best.score)) continue;
    best = Scored<Model>(matrix, first, second, sigma);
    for (int round = 0; round < kRefits && best.inliers.size() >= Model::kSamplePoints; ++round) {
      const Eigen::Matrix3d refitted = Model::Fit(matches, best.inliers, best.inliers.size());
      ModelFit refit = Scored<Model>(refitted, first, second, sigma);
      if (!(refit.score > best.score)) break;
      best = std::move(refit);
    }
  }
  return best;
}

// Distinct indices per sample, by the first steps of a Fisher-Yates shuffle.
std::vector<Sample> DrawSamples(std::size_t match_count, int sample_count, std::uint32_t seed) {
  std::mt19937 generator(seed);
  std::vector<std::size_t> indices(match_count);
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  std::vector<Sample> samples(static_cast<std::size_t>(sample_count));
  for (Sample& sample : samples) {
    for (std::size_t k = 0; k < sample.size(); ++k) {
      std::swap(indices[k], indices[k + generator() % (match_count - k)]);
      sample[k] = indices[k];
    }
  }
  return samples;
}

}  // namespace

TwoViewModels FitTwoViewModels(const std::vector<Eigen::Vector2d>& first, const std::vector<Eigen::Vector2d>& second,
                               int ransac_iterations, double pixel_sigma, std::uint32_t seed) {
  PV_CHECK(first.size() == second.size() && first.size() >= kTwoViewSample,
           first.size() << " first and " << second.size() << " second pixels");
  PV_CHECK(ransac_iterations > 0 && pixel_sigma > 0.0,
           "ransac_iterations=" << ransac_iterations << " pixel_sigma=" << pixel_sigma);
  const NormalizedMatches matches{NormalizedPoints(first), NormalizedPoints(second)};
  const std::vector<Sample> samples = DrawSamples(first.size(), ransac_iterations, seed);
  TwoViewModels models;
  models.homography = FitRobustly<HomographyModel>(first, second, matches, samples, pixel_sigma);
  models.fundamental = FitRobustly<FundamentalModel>(first, second, matches, samples, pixel_sigma);
  return models;
}

}  // namespace planar_vslam
