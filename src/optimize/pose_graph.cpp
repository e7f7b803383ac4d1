#include "planar_vslam/optimize/pose_graph.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <deque>
#include <optional>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/planar/pose_manifold.h"
#include "planar_vslam/planar/relative_pose_factor.h"

namespace planar_vslam {
namespace {

RelativePoseFactor<3>::Weight WeightOnFloor(const Eigen::Matrix3d& covariance) {
  Matrix6d lifted = Matrix6d::Identity();
  lifted(kPlanarRows, kPlanarRows) = covariance;
  return SquareRootInformation(lifted)(kPlanarRows, Eigen::all);
}

class PoseGraph {
 public:
  explicit PoseGraph(const Map& map) : map_(map) {
    for (const auto& [id, keyframe] : map.keyframes) before_.push_back(ProjectToPlane(keyframe.T_map_base));
    blocks_.resize(before_.size() * kPoseBlockSize);
    for (std::size_t k = 0; k < before_.size(); ++k) {
      Start(k, before_[k]);
      problem_.AddParameterBlock(Block(k), kPoseBlockSize, &manifold_);
    }
    problem_.SetParameterBlockConstant(Block(0));
  }

  void AddTie(const MapTie& tie) {
    const std::size_t from = IndexOf(tie.from), to = IndexOf(tie.to);
    Add(from, to, before_[from].Inverse() * before_[to], tie.covariance);
  }
  void AddLoop(const LoopTie& loop) { Add(IndexOf(loop.from), IndexOf(loop.to), loop.T_from_to, loop.covariance); }

  // Everything from `first` on starts moved so that the loop is closed.
  void MoveFrom(std::size_t first, const LoopTie& loop) {
    const std::size_t to = IndexOf(loop.to);
    const Rigid2 T_new_old = before_[IndexOf(loop.from)] * loop.T_from_to * before_[to].Inverse();
    for (std::size_t k = first; k < before_.size(); ++k) Start(k, T_new_old * before_[k]);
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
  // What the floor's motion makes of a pose above it.
  Rigid3 Moved(std::size_t k, const Rigid3& T_map_base) const {
    const Rigid2 after = ProjectToPlane(LoadPose(blocks_.data() + k * kPoseBlockSize));
    return Embed3(after * before_[k].Inverse()) * T_map_base;
  }

 private:
  static ceres::Problem::Options Options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }
  double* Block(std::size_t k) { return blocks_.data() + k * kPoseBlockSize; }
  void Start(std::size_t k, const Rigid2& pose) { StorePose(Embed3(pose), Block(k)); }
  void Add(std::size_t i, std::size_t j, const Rigid2& T_i_j, const Eigen::Matrix3d& covariance) {
    factors_.emplace_back(Embed3(T_i_j), WeightOnFloor(covariance));
    problem_.AddResidualBlock(&factors_.back(), nullptr, Block(i), Block(j));
  }

  FloorPoseManifold manifold_;
  std::deque<RelativePoseFactor<3>> factors_;  // cost functions cannot be moved
  const Map& map_;
  std::vector<Rigid2> before_;  // by index
  std::vector<double> blocks_;
  ceres::Problem problem_{Options()};
};

}  // namespace

Expected<std::vector<std::pair<KeyframeId, Rigid3>>> SolvePoseGraph(const Map& map, const std::vector<MapTie>& ties,
                                                                    const std::vector<LoopTie>& loops) {
  PoseGraph graph(map);
  for (const MapTie& tie : ties) graph.AddTie(tie);
  for (const LoopTie& loop : loops) graph.AddLoop(loop);
  if (!loops.empty()) {
    const LoopTie& loop = loops.front();
    KeyframeId after_kidnap{0};
    for (const MapTie& tie : ties) {
      if (tie.doubtful && loop.from < tie.to && !(loop.to < tie.to)) after_kidnap = std::max(after_kidnap, tie.to);
    }
    if (after_kidnap.value > 0) graph.MoveFrom(graph.IndexOf(after_kidnap), loop);
  }
  if (std::optional<Error> error = graph.Solve()) return *error;
  std::vector<std::pair<KeyframeId, Rigid3>> poses;
  std::size_t k = 0;
  for (const auto& [id, keyframe] : map.keyframes) poses.emplace_back(id, graph.Moved(k++, keyframe.T_map_base));
  return poses;
}

}  // namespace planar_vslam
