#pragma once
// The damped normal equations of a bundle problem at its present state, and their solution by eliminating the points:
// schur_solver.h derives them.
#include <Eigen/Core>
#include <vector>

#include "bundle_problem.h"
#include "schur_kernel.h"

namespace planar_vslam {

// Rows (A_i x v): the product A [v]x.
inline Eigen::Matrix3d TimesSkew(const Eigen::Matrix3d& A, const Eigen::Vector3d& v) {
  Eigen::Matrix3d product;
  product.col(0) = A.col(1) * v.z() - A.col(2) * v.y();
  product.col(1) = A.col(2) * v.x() - A.col(0) * v.z();
  product.col(2) = A.col(0) * v.y() - A.col(1) * v.x();
  return product;
}

class SchurSystem {
 public:
  // Moves `problem`, which must outlive it.
  explicit SchurSystem(BundleProblem* problem);

  bool IsFinite() const;
  double Evaluate();  // the cost
  void Linearize();   // where Evaluate was called last
  // Solves the equations with damping `lambda`. False where they have no solution.
  bool Solve(double lambda);
  double PredictedDecrease(double lambda) const;  // of the cost, by the quadratic model, for the solution
  void Move();                                    // by the solution

 private:
  // An observation that takes part, where it is evaluated.
  struct Pixel {
    Eigen::Vector2d pixel;
    double inverse_sigma;
    std::uint32_t pose;
    std::uint32_t source;  // index in the problem

    Eigen::Vector3d p_camera = Eigen::Vector3d::Zero();  // at the state evaluated last
    Eigen::Vector2d e = Eigen::Vector2d::Zero();
    double weight = 0.0;  // 0 behind the camera
  };

  // What an observation from a free pose leaves for the elimination of its point.
  struct FreeView {
    Eigen::Matrix3d A;
    Eigen::Vector3d v;
    Eigen::Index slot;
  };

  struct PointSystem {
    std::size_t pixels_begin = 0, pixels_end = 0;
    std::size_t views_begin = 0, views_end = 0;
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    Eigen::Matrix3d K_inverse = Eigen::Matrix3d::Zero();  // of the damped H; zero where it has none
  };

  static constexpr Eigen::Index kNoSlot = -1;

  double EvaluatePixels();
  double EvaluateMotions() const;
  void LinearizePoint(PointSystem* point, const Eigen::Vector3d& p_map);
  void AddView(const Pixel& pixel, const Eigen::Matrix3d& A, const Eigen::Vector3d& g, const Eigen::Vector3d& p_map);
  void LinearizeMotions();
  void LinearizeFloor();
  void KeepFreedom(Eigen::MatrixXd* H, Eigen::VectorXd* b) const;
  void Eliminate(PointSystem* point, double lambda);
  void BackSubstitute();

  BundleProblem& p_;
  std::vector<Eigen::Index> slots_;  // per pose, its place among the free ones
  std::vector<std::size_t> poses_of_slots_;
  Eigen::Index size_ = 0;  // of the reduced system
  std::vector<Pixel> pixels_;
  std::vector<PointSystem> points_;
  std::vector<FreeView> views_;
  SubtractPairs subtract_pairs_ = SubtractPairsOf(BestInstructionSet());
  std::vector<ViewFactor> U_;       // of the views of one point
  std::vector<Eigen::Index> rows_;  // of S, where their blocks begin
  std::vector<CameraPose> cameras_;
  Eigen::MatrixXd H_, S_;  // of the poses, lower triangles: before and after elimination
  Eigen::VectorXd b_, r_;
  Eigen::VectorXd pose_step_;
  std::vector<Eigen::Vector3d> point_steps_;
};

}  // namespace planar_vslam
