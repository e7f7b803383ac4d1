#include "planar_vslam/optimize/pose_graph.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <deque>
#include <optional>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/planar/pose_manifold.h"
#include "planar_vslam/planar/relative_pose_factor.h"

namespace planar_vslam {
namespace {

// What the graph moves of a pose: x, y and heading on the floor.
struct OnFloor {
  static constexpr int kRows = 3;
  using Manifold = FloorPoseManifold;
  using Weight = RelativePoseFactor<kRows>::Weight;

  static Rigid3 Start(const Rigid3& T_map_base) { return Embed3(ProjectToPlane(T_map_base)); }
  static Rigid3 Between(const Rigid3& T_map_i, const Rigid3& T_map_j) {
    return Embed3(ProjectToPlane(T_map_i).Inverse() * ProjectToPlane(T_map_j));
  }
  // The pose above the floor goes with it.
  static Rigid3 Moved(const Rigid3& block, const Rigid3& T_map_base) {
    return Embed3(ProjectToPlane(block) * ProjectToPlane(T_map_base).Inverse()) * T_map_base;
  }
  static Weight WeightOf(const Matrix6d& covariance) {
    Matrix6d planar = Matrix6d::Identity();
    planar(kPlanarRows, kPlanarRows) = covariance(kPlanarRows, kPlanarRows);
    return SquareRootInformation(planar)(kPlanarRows, Eigen::all);
  }
};

// Or all of it.
struct OnSlopes {
  static constexpr int kRows = 6;
  using Manifold = PoseManifold;
  static Rigid3 Start(const Rigid3& T_map_base) { return T_map_base; }
  static Rigid3 Between(const Rigid3& T_map_i, const Rigid3& T_map_j) { return T_map_i.Inverse() * T_map_j; }
  static Rigid3 Moved(const Rigid3& block, const Rigid3& /*T_map_base*/) { return block; }
  static Matrix6d WeightOf(const Matrix6d& covariance) { return SquareRootInformation(covariance); }
};

// Of what landmarks tell.
Matrix6d SeenCovariance(const Eigen::Matrix3d& planar) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance(kPlanarRows, kPlanarRows) = planar;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> position(planar.topLeftCorner<2, 2>());
  covariance(2, 2) = position.eigenvalues()[0];  // the larger one contains the error along the way
  covariance(3, 3) = covariance(4, 4) = planar(2, 2);
  return covariance;
}

Matrix6d TieCovariance(const Eigen::Matrix3d& planar, TieSource source, double distance, double sigma_slope) {
  Matrix6d covariance = SeenCovariance(planar);
  if (source == TieSource::kLandmarks) return covariance;
  covariance(2, 2) += sigma_slope * sigma_slope * distance * distance;
  covariance(3, 3) = covariance(4, 4) = sigma_slope * sigma_slope;
  return covariance;
}

template <class Space>
class PoseGraph {
 public:
  PoseGraph(const Map& map, const PlanarPriorOptions& planar) : map_(map), planar_(planar) {
    for (const auto& [id, keyframe] : map.keyframes) before_.push_back(keyframe.T_map_base);
    blocks_.resize(before_.size() * kPoseBlockSize);
    for (std::size_t k = 0; k < before_.size(); ++k) {
      StorePose(Space::Start(before_[k]), Block(k));
      problem_.AddParameterBlock(Block(k), kPoseBlockSize, &manifold_);
    }
    problem_.SetParameterBlockConstant(Block(0));
  }

  void AddTie(const MapTie& tie) {
    const std::size_t from = IndexOf(tie.from), to = IndexOf(tie.to);
    const Rigid3 T_from_to = Space::Between(before_[from], before_[to]);
    Add(from, to, T_from_to,
        TieCovariance(tie.covariance, tie.source, T_from_to.translation.norm(), planar_.sigma_slope));
  }
  void AddLoop(const LoopTie& loop) {
    const std::size_t from = IndexOf(loop.from);
    const Rigid3 T_from_to = Space::Between(before_[from], loop.T_map_to);
    Add(from, IndexOf(loop.to), T_from_to,
        TieCovariance(loop.covariance, loop.source, T_from_to.translation.norm(), planar_.sigma_slope));
  }
  void AddFloor() {
    std::size_t k = 0;
    for (const auto& [id, keyframe] : map_.keyframes) {
      problem_.AddResidualBlock(keyframe.on_floor ? &floor_ : &slope_, nullptr, Block(k++));
    }
  }

  // Everything from `first` on starts moved so that the loop is closed.
  void MoveFrom(std::size_t first, const LoopTie& loop) {
    const Rigid3 T_new_old = Space::Start(loop.T_map_to) * Space::Start(before_[IndexOf(loop.to)]).Inverse();
    for (std::size_t k = first; k < before_.size(); ++k) {
      StorePose(T_new_old * Space::Start(before_[k]), Block(k));
    }
  }

  // What Ceres says where there is no solution.
  std::optional<Error> Solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 30;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (summary.IsSolutionUsable()) return std::nullopt;
    return Error{summary.message};
  }

  std::size_t IndexOf(KeyframeId id) const { return map_.keyframes.IndexOf(id); }

  std::vector<std::pair<KeyframeId, Rigid3>> Poses() const {
    std::vector<std::pair<KeyframeId, Rigid3>> poses;
    for (const auto& [id, keyframe] : map_.keyframes) {
      const Rigid3 block = LoadPose(blocks_.data() + poses.size() * kPoseBlockSize);
      poses.emplace_back(id, Space::Moved(block, keyframe.T_map_base));
    }
    return poses;
  }

 private:
  static ceres::Problem::Options Options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }
  double* Block(std::size_t k) { return blocks_.data() + k * kPoseBlockSize; }
  void Add(std::size_t i, std::size_t j, const Rigid3& T_i_j, const Matrix6d& covariance) {
    factors_.emplace_back(T_i_j, Space::WeightOf(covariance));
    problem_.AddResidualBlock(&factors_.back(), nullptr, Block(i), Block(j));
  }

  const Map& map_;
  const PlanarPriorOptions planar_;
  typename Space::Manifold manifold_;
  PlanarPriorFactor floor_{FloorSigmasOf(planar_, true)};
  PlanarPriorFactor slope_{FloorSigmasOf(planar_, false)};
  std::deque<RelativePoseFactor<Space::kRows>> factors_;  // cost functions cannot be moved
  std::vector<Rigid3> before_;                            // by index
  std::vector<double> blocks_;
  ceres::Problem problem_{Options()};
};

template <class Space>
Expected<std::vector<std::pair<KeyframeId, Rigid3>>> Solve(const std::vector<MapTie>& ties,
                                                           const std::vector<LoopTie>& loops, PoseGraph<Space>* graph) {
  for (const MapTie& tie : ties) graph->AddTie(tie);
  for (const LoopTie& loop : loops) graph->AddLoop(loop);
  if (!loops.empty()) {
    const LoopTie& loop = loops.front();
    KeyframeId after_kidnap{0};
    for (const MapTie& tie : ties) {
      if (tie.doubtful && loop.from < tie.to && !(loop.to < tie.to)) after_kidnap = std::max(after_kidnap, tie.to);
    }
    if (after_kidnap.value > 0) graph->MoveFrom(graph->IndexOf(after_kidnap), loop);
  }
  if (std::optional<Error> error = graph->Solve()) return *error;
  return graph->Poses();
}

}  // namespace

Expected<std::vector<std::pair<KeyframeId, Rigid3>>> SolvePoseGraph(const Map& map, const std::vector<MapTie>& ties,
                                                                    const std::vector<LoopTie>& loops,
                                                                    const PlanarPriorOptions& planar) {
  const bool flat =
      std::all_of(map.keyframes.begin(), map.keyframes.end(), [](const auto& k) { return k.second.on_floor; });
  if (flat || planar.mode == PlanarMode::kOff) {
    PoseGraph<OnFloor> graph(map, planar);
    return Solve(ties, loops, &graph);
  }
  PoseGraph<OnSlopes> graph(map, planar);
  graph.AddFloor();
  return Solve(ties, loops, &graph);
}

}  // namespace planar_vslam
