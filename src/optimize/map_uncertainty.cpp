#include "planar_vslam/optimize/map_uncertainty.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace planar_vslam {
namespace {

constexpr double kSharedFactor = 4.0;      // k above; a guess that NEES bears out, see BENCHMARK.md
constexpr double kAlong = 0.03;            // share of the way between two keyframes that landmarks leave open
constexpr std::size_t kMostNeighbors = 6;  // ties by landmarks, a keyframe
constexpr int kMinShared = 12;

enum class Source { kWheels, kLaser, kLandmarks };

// Covariance of (r, phi) in the frame of i, as links hold it, as one of the right tangent at j.
Eigen::Matrix3d AtEnd(const OdometryLink& link, const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = link.odometry.T_i_j.R();
  return B.transpose() * covariance * B;
}

class TieGraph {
 public:
  TieGraph(const Map& map, const SystematicErrors& systematic) {
    for (const auto& [id, keyframe] : map.keyframes) {
      ids_.push_back(id);
      poses_.push_back(ProjectToPlane(keyframe.T_map_base));
    }
    for (const double sigma : {systematic.wheels, systematic.laser}) {
      const auto at = static_cast<int>(3 * ids_.size() + entries_.size());
      entries_.emplace_back(at, at, 1.0 / (sigma * sigma));
    }
  }

  void Tie(const OdometryLink& link, KeyframeId to, const OdometryNoise& noise, Source source) {
    Tie(IndexOf(link.from), IndexOf(to), AtEnd(link, CovarianceWithFloor(link.odometry, noise)), source);
  }

  // A relative pose of keyframes, by index in the map, with covariance of the right tangent at j.
  void Tie(std::size_t i, std::size_t j, const Eigen::Matrix3d& covariance, Source source) {
    const Rigid2 T_j_i = Between(j, i);
    std::vector<std::size_t> columns = {3 * i, 3 * i + 1, 3 * i + 2, 3 * j, 3 * j + 1, 3 * j + 2};
    Eigen::Matrix<double, 3, 7> J = Eigen::Matrix<double, 3, 7>::Zero();
    J.leftCols<3>() = -AdjointSe2(T_j_i);
    J.middleCols<3>(3).setIdentity();
    if (source != Source::kLandmarks) {
      columns.push_back(3 * ids_.size() + static_cast<std::size_t>(source));
      J.rightCols<1>().head<2>() = T_j_i.translation;  // -R_i_j^T t_i_j
    }
    const Eigen::Matrix<double, 7, 7> H = J.transpose() * covariance.inverse() * J;
    for (std::size_t r = 0; r < columns.size(); ++r) {
      for (std::size_t c = 0; c < columns.size(); ++c) {
        entries_.emplace_back(static_cast<int>(columns[r]), static_cast<int>(columns[c]),
                              H(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)));
      }
    }
  }

  Rigid2 Between(std::size_t i, std::size_t j) const { return poses_[i].Inverse() * poses_[j]; }

  Eigen::Matrix3d CovarianceOf(KeyframeId id) const {
    const auto size = static_cast<Eigen::Index>(3 * ids_.size() + 2);
    Eigen::SparseMatrix<double> H(size, size);
    std::vector<Eigen::Triplet<double>> entries = entries_;
    constexpr double kFixed = 1e12, kLoose = 1e-6;  // a keyframe nothing ties is unknown, not an error
    for (Eigen::Index k = 0; k < size; ++k) entries.emplace_back(k, k, k < 3 ? kFixed : kLoose);
    H.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(H);
    const auto at = static_cast<Eigen::Index>(3 * IndexOf(id));
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(size, 3);
    right.block<3, 3>(at, 0).setIdentity();
    const Eigen::MatrixXd columns = solver.solve(right);
    const Eigen::Matrix3d block = columns.block<3, 3>(at, 0);
    return 0.5 * (block + block.transpose());
  }

 private:
  std::size_t IndexOf(KeyframeId id) const {
    return static_cast<std::size_t>(std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin());
  }

  std::vector<KeyframeId> ids_;
  std::vector<Rigid2> poses_;
  std::vector<Eigen::Triplet<double>> entries_;  // of H: a pose's three, one after the other, then a share a source
};

// What one keyframe sees, and which ones before it see the same.
struct Sight {
  int landmarks = 0;
  double inverse_depths = 0.0;                       // 1/m, their sum
  std::vector<std::pair<int, std::size_t>> sharing;  // [landmarks in common, index in the map], most first
};

// Goes through the keyframes of a map, each by its index.
class SightReader {
 public:
  explicit SightReader(const Map& map)
      : landmark_of_(map.next_landmark_id, nullptr), index_of_(map.next_keyframe_id), shared_(map.keyframes.size(), 0) {
    for (const auto& [id, landmark] : map.landmarks) landmark_of_[id.value] = &landmark;
    std::size_t index = 0;
    for (const auto& [id, keyframe] : map.keyframes) index_of_[id.value] = index++;
  }

  Sight Read(KeyframeId id, const Keyframe& keyframe) {
    constexpr double kNearest = 0.1;  // m
    const Rigid3 T_camera_map = keyframe.T_map_camera().Inverse();
    Sight sight;
    for (const LandmarkId landmark_id : keyframe.landmarks) {
      if (!landmark_id.valid()) continue;
      const Landmark& landmark = *landmark_of_[landmark_id.value];
      ++sight.landmarks;
      sight.inverse_depths += 1.0 / std::max(kNearest, (T_camera_map * landmark.p_map).z());
      for (const Observation& o : landmark.observations) {
        if (!(o.keyframe < id)) break;  // in order of keyframes
        ++shared_[index_of_[o.keyframe.value]];
      }
    }
    for (std::size_t older = 0; older < index_of_[id.value]; ++older) {
      const int count = std::exchange(shared_[older], 0);
      if (count >= kMinShared) sight.sharing.emplace_back(count, older);
    }
    std::stable_sort(sight.sharing.begin(), sight.sharing.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    if (sight.sharing.size() > kMostNeighbors) sight.sharing.resize(kMostNeighbors);
    return sight;
  }

 private:
  std::vector<const Landmark*> landmark_of_;  // by id
  std::vector<std::size_t> index_of_;         // by id
  std::vector<int> shared_;                   // by index, zero between calls
};

// Of a tie by `count` landmarks in common, the right tangent at the newer keyframe; `way` from there to the older one.
Eigen::Matrix3d LandmarkCovariance(int count, int seen, double depth, const Eigen::Vector2d& way,
                                   const BundleContext& context) {
  const double n = count;
  const double heading = kSharedFactor * context.options.pixel_sigma / (context.camera.fx * std::sqrt(n)) * seen / n;
  const double position = depth * heading;
  Eigen::Matrix3d covariance = Eigen::Vector3d(position, position, heading).cwiseAbs2().asDiagonal();
  covariance.topLeftCorner<2, 2>() += kAlong * kAlong * way * way.transpose();
  return covariance;
}

void TieByLandmarks(const Map& map, const BundleContext& context, TieGraph* graph) {
  SightReader reader(map);
  std::size_t newer = 0;
  for (const auto& [id, keyframe] : map.keyframes) {
    const Sight sight = reader.Read(id, keyframe);
    const double depth = sight.landmarks / sight.inverse_depths;
    for (const auto& [count, older] : sight.sharing) {
      const Eigen::Vector2d way = graph->Between(newer, older).translation;
      graph->Tie(older, newer, LandmarkCovariance(count, sight.landmarks, depth, way, context), Source::kLandmarks);
    }
    ++newer;
  }
}

}  // namespace

Eigen::Matrix3d KeyframeCovariance(const Map& map, KeyframeId id, const BundleContext& context,
                                   const SystematicErrors& systematic) {
  if (map.keyframes.empty() || map.keyframes.begin()->first == id) return Eigen::Matrix3d::Zero();
  TieGraph graph(map, systematic);
  for (const auto& [to, keyframe] : map.keyframes) {
    if (context.options.use_odometry && keyframe.odometry_link.has_value()) {
      graph.Tie(*keyframe.odometry_link, to, context.odometry_noise, Source::kWheels);
    }
    for (const OdometryLink& link : keyframe.laser_links) graph.Tie(link, to, context.odometry_noise, Source::kLaser);
  }
  TieByLandmarks(map, context, &graph);
  return graph.CovarianceOf(id);
}

}  // namespace planar_vslam
