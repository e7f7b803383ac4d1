#include "planar_vslam/optimize/map_uncertainty.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace planar_vslam {
namespace {

constexpr double kSharedFactor = 4.0;      // k above; a guess that NEES bears out, see BENCHMARK.md
constexpr std::size_t kMostNeighbors = 6;  // ties by landmarks, a keyframe
constexpr int kMinShared = 12;

class TieGraph {
 public:
  explicit TieGraph(const Map& map) {
    for (const auto& [id, keyframe] : map.keyframes) {
      ids_.push_back(id);
      poses_.push_back(ProjectToPlane(keyframe.T_map_base));
    }
  }

  // A relative pose with covariance of the right tangent at j.
  void Tie(KeyframeId from, KeyframeId to, const Eigen::Matrix3d& covariance) {
    const Eigen::Matrix3d W = covariance.inverse();
    const std::size_t i = IndexOf(from), j = IndexOf(to);
    const Eigen::Matrix3d J_i = -AdjointSe2((poses_[i].Inverse() * poses_[j]).Inverse());
    Add(i, i, J_i.transpose() * W * J_i);
    Add(j, j, W);
    Add(i, j, J_i.transpose() * W);
    Add(j, i, W * J_i);
  }

  Eigen::Matrix3d CovarianceOf(KeyframeId id) const {
    const auto size = static_cast<Eigen::Index>(3 * ids_.size());
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
  void Add(std::size_t i, std::size_t j, const Eigen::Matrix3d& block) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        entries_.emplace_back(static_cast<int>(3 * i) + r, static_cast<int>(3 * j) + c, block(r, c));
      }
    }
  }

  std::vector<KeyframeId> ids_;
  std::vector<Rigid2> poses_;
  std::vector<Eigen::Triplet<double>> entries_;
};

// Covariance of (r, phi) in the frame of i, as links hold it, as one of the right tangent at j.
Eigen::Matrix3d AtEnd(const OdometryLink& link, const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = link.odometry.T_i_j.R();
  return B.transpose() * covariance * B;
}

double MedianDepth(const Map& map, const Keyframe& keyframe) {
  const Rigid3 T_camera_map = keyframe.T_map_camera().Inverse();
  std::vector<double> depths;
  for (const LandmarkId id : keyframe.landmarks) {
    const Landmark* landmark = id.valid() ? map.landmarks.Find(id) : nullptr;
    if (landmark != nullptr) depths.push_back((T_camera_map * landmark->p_map).z());
  }
  constexpr double kUnknown = 5.0;  // m
  if (depths.empty()) return kUnknown;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return std::max(0.1, *middle);
}

// The keyframes before this one that share most landmarks with it, [landmarks in common, keyframe]. `shared` is scratch
// of a zero per keyframe id.
std::vector<std::pair<int, KeyframeId>> SharingBefore(const Map& map, KeyframeId id, std::vector<int>* shared) {
  for (const LandmarkId landmark : map.keyframes.At(id).landmarks) {
    if (!landmark.valid()) continue;
    for (const Observation& o : map.landmarks.At(landmark).observations) {
      if (!(o.keyframe < id)) break;  // in order of keyframes
      ++(*shared)[o.keyframe.value];
    }
  }
  std::vector<std::pair<int, KeyframeId>> neighbors;
  for (std::uint32_t other = 0; other < id.value; ++other) {
    const int count = std::exchange((*shared)[other], 0);
    if (count >= kMinShared) neighbors.emplace_back(count, KeyframeId{other});
  }
  std::stable_sort(neighbors.begin(), neighbors.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (neighbors.size() > kMostNeighbors) neighbors.resize(kMostNeighbors);
  return neighbors;
}

void TieByLandmarks(const Map& map, const BundleContext& context, TieGraph* graph) {
  std::vector<int> shared(map.next_keyframe_id, 0);
  for (const auto& [id, keyframe] : map.keyframes) {
    const std::vector<std::pair<int, KeyframeId>> neighbors = SharingBefore(map, id, &shared);
    if (neighbors.empty()) continue;
    const double depth = MedianDepth(map, keyframe);
    for (const auto& [count, older] : neighbors) {
      const double heading =
          kSharedFactor * context.options.pixel_sigma / (context.camera.fx * std::sqrt(static_cast<double>(count)));
      const Eigen::Vector3d sigma(depth * heading, depth * heading, heading);
      graph->Tie(older, id, sigma.cwiseAbs2().asDiagonal());
    }
  }
}

}  // namespace

Eigen::Matrix3d KeyframeCovariance(const Map& map, KeyframeId id, const BundleContext& context) {
  if (map.keyframes.empty() || map.keyframes.begin()->first == id) return Eigen::Matrix3d::Zero();
  TieGraph graph(map);
  for (const auto& [to, keyframe] : map.keyframes) {
    if (context.options.use_odometry && keyframe.odometry_link.has_value()) {
      const OdometryLink& link = *keyframe.odometry_link;
      graph.Tie(link.from, to, AtEnd(link, CovarianceWithFloor(link.odometry, context.odometry_noise)));
    }
    for (const OdometryLink& link : keyframe.laser_links) {
      graph.Tie(link.from, to, AtEnd(link, CovarianceWithFloor(link.odometry, context.odometry_noise)));
    }
  }
  TieByLandmarks(map, context, &graph);
  return graph.CovarianceOf(id);
}

}  // namespace planar_vslam
