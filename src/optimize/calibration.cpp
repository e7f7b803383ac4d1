#include "planar_vslam/optimize/calibration.h"

#include <ceres/ceres.h>
#include <ceres/covariance.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>

#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/optimize/mounted_reprojection_factor.h"
#include "planar_vslam/optimize/reprojection_factor.h"
#include "planar_vslam/planar/pose_manifold.h"
#include "planar_vslam/planar/relative_pose_factor.h"

namespace planar_vslam {
namespace {

// 6-D Mahalanobis norm. Not Cauchy as in bundle adjustment: what starts from wrong values must not be let go of.
constexpr double kMotionHuber = 3.5;

// Readings from well before `from` to well after `to`: the offset moves the ends while the solver runs.
std::vector<OdometryReading> Around(const std::vector<OdometryReading>& readings, Timestamp from, Timestamp to) {
  constexpr double kMargin = 0.6;  // s, beyond any plausible offset
  std::vector<OdometryReading> around;
  for (const OdometryReading& reading : readings) {
    if (SecondsBetween(reading.stamp, from) < kMargin && SecondsBetween(to, reading.stamp) < kMargin) {
      around.push_back(reading);
    }
  }
  return around;
}

Rigid3 Unmounted(const Vector6d& mount, const Rigid3& T_base_camera) {
  return {(ExpSo3(mount.tail<3>()).conjugate() * T_base_camera.rotation).normalized(),
          Eigen::Vector3d(T_base_camera.translation - mount.head<3>())};
}

// All parameter blocks lie in one buffer in a fixed order: Ceres then gives the same bits in every run.
class CalibrationProblem {
 public:
  CalibrationProblem(const Map& map, const std::vector<OdometryReading>& readings, const SensorCorrection& present,
                     const MeasurementModel& context, const CalibrationOptions& options)
      : map_(map), readings_(readings), present_(present), context_(context), options_(options) {
    blocks_.resize(2 * map.keyframes.size() * kPoseBlockSize + map.landmarks.size() * 3 + kScaleSize + 1 + kMountSize);
    std::size_t i = 0;
    for (const auto& [id, keyframe] : map.keyframes) {
      StorePose(keyframe.T_map_base, Pose(i));
      StorePose(keyframe.T_map_base, Base(i));
      ++i;
    }
    i = 0;
    for (const auto& [id, landmark] : map.landmarks) Eigen::Map<Eigen::Vector3d>(Point(i++)) = landmark.p_map;
    std::copy_n(present.odometry.scale.data(), kScaleSize, Scale());
    *Offset() = present.odometry.time_offset;
    std::copy_n(present.camera_mount.data(), kMountSize, Mount());
    ceres::Problem::Options ownership;
    ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_ = std::make_unique<ceres::Problem>(ownership);
    AddBlocks();
    AddReprojections();
    AddMotions();
    AddPriors();
  }

  Expected<bool> Solve() {
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_SCHUR;
    solver.linear_solver_ordering.reset(ordering_.release());
    solver.max_num_iterations = options_.max_iterations;
    solver.num_threads = 1;
    solver.function_tolerance = 1e-7;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, problem_.get(), &summary);
    if (!summary.IsSolutionUsable()) return Error{"calibration: " + summary.message};
    return true;
  }

  SensorCorrection Correction() {
    SensorCorrection correction;
    correction.odometry.scale = Eigen::Map<Eigen::Vector3d>(Scale());
    correction.odometry.time_offset = *Offset();
    correction.camera_mount = Eigen::Map<Vector6d>(Mount());
    return correction;
  }

  // Posterior standard deviations: scale (3), offset, mount (6, z is 0). None where the problem has no unique solution.
  Expected<std::array<double, 10>> Sigmas() {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    const std::vector<const double*> wanted = {Scale(), Offset(), Mount()};
    if (!covariance.Compute(wanted, problem_.get())) return Error{"calibration: the drive leaves the map undetermined"};
    std::array<double, 10> sigmas{};
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> scale;
    Eigen::Matrix<double, 1, 1> offset;
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> mount;
    covariance.GetCovarianceBlock(Scale(), Scale(), scale.data());
    covariance.GetCovarianceBlock(Offset(), Offset(), offset.data());
    covariance.GetCovarianceBlock(Mount(), Mount(), mount.data());
    for (int k = 0; k < 3; ++k) sigmas[static_cast<std::size_t>(k)] = std::sqrt(scale(k, k));
    sigmas[3] = std::sqrt(offset(0, 0));
    for (int k = 0; k < 6; ++k) sigmas[static_cast<std::size_t>(4 + k)] = std::sqrt(std::max(0.0, mount(k, k)));
    return sigmas;
  }

 private:
  static constexpr std::size_t kScaleSize = 3, kMountSize = 6;

  // Where the base would be if the camera did not sway, and where it is.
  double* Pose(std::size_t i) { return blocks_.data() + i * kPoseBlockSize; }
  double* Base(std::size_t i) { return Pose(map_.keyframes.size() + i); }
  double* Point(std::size_t i) { return Pose(2 * map_.keyframes.size()) + 3 * i; }
  double* Scale() { return Point(map_.landmarks.size()); }
  double* Offset() { return Scale() + kScaleSize; }
  double* Mount() { return Offset() + 1; }
  double* PoseOf(KeyframeId id) { return Pose(map_.keyframes.IndexOf(id)); }
  double* BaseOf(KeyframeId id) { return Base(map_.keyframes.IndexOf(id)); }

  void AddBlocks() {
    ordering_ = std::make_unique<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < 2 * map_.keyframes.size(); ++i) {
      problem_->AddParameterBlock(Pose(i), kPoseBlockSize, &pose_manifold_);
      ordering_->AddElementToGroup(Pose(i), 1);
    }
    problem_->SetParameterBlockConstant(Pose(0));
    for (std::size_t i = 0; i < map_.landmarks.size(); ++i) {
      problem_->AddParameterBlock(Point(i), 3);
      ordering_->AddElementToGroup(Point(i), 0);
    }
    problem_->AddParameterBlock(Scale(), kScaleSize);
    problem_->AddParameterBlock(Offset(), 1);
    problem_->AddParameterBlock(Mount(), kMountSize, &mount_manifold_);
    for (double* block : {Scale(), Offset(), Mount()}) ordering_->AddElementToGroup(block, 1);
  }

  void AddReprojections() {
    std::size_t i = 0;
    for (const auto& [id, landmark] : map_.landmarks) {
      double* point = Point(i++);
      for (const Observation& o : landmark.observations) {
        const Keyframe& keyframe = map_.keyframes.At(o.keyframe);
        const Keypoint& keypoint = keyframe.features->keypoints[o.keypoint];
        const double sigma = context_.pixel_sigma * map_.octave_scales[static_cast<std::size_t>(keypoint.octave)];
        reprojections_.emplace_back(keypoint.pixel.cast<double>(),
                                    Unmounted(present_.camera_mount, keyframe.T_base_camera), context_.camera, sigma);
        problem_->AddResidualBlock(&reprojections_.back(), &pixel_loss_, PoseOf(o.keyframe), point, Mount());
      }
    }
  }

  Matrix6d WheelWeight(const PlanarMotion& motion) const {
    return SquareRootInformation(LiftedCovariance(motion, context_.odometry_noise));
  }
  Matrix6d LaserWeight(const PlanarMotion& motion) const {
    const Eigen::Matrix3d planar = CovarianceWithFloor(motion, context_.laser_floor);
    return SquareRootInformation(LiftedCovariance(motion, planar, context_.odometry_noise));
  }

  void AddMotions() {
    for (const auto& [id, keyframe] : map_.keyframes) {
      AddSway(id, keyframe);
      if (keyframe.odometry_link.has_value()) AddOdometry(id, keyframe, *keyframe.odometry_link);
      for (const MotionLink& link : keyframe.laser_links) AddLaser(id, keyframe, link);
      const bool floor = context_.planar.mode != PlanarMode::kOff && keyframe.on_floor;
      if (floor) problem_->AddResidualBlock(&floor_, nullptr, BaseOf(id));
    }
  }

  // Log of the base in the base that the camera shows, turned into camera axes: sway turns the camera about itself.
  void AddSway(KeyframeId id, const Keyframe& keyframe) {
    constexpr double kRigid = 1e-3;  // m
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(kRigid), Eigen::Vector3d::Constant(options_.camera_sway_sigma);
    const Matrix6d weight = sigma.cwiseInverse().asDiagonal() * AdjointSe3(keyframe.T_base_camera.Inverse());
    sways_.emplace_back(Rigid3(), weight);
    problem_->AddResidualBlock(&sways_.back(), nullptr, PoseOf(id), BaseOf(id));
  }

  void AddOdometry(KeyframeId id, const Keyframe& keyframe, const MotionLink& link) {
    const Timestamp from = map_.keyframes.At(link.from).stamp;
    std::vector<OdometryReading> around = Around(readings_, from, keyframe.stamp);
    if (around.size() < 2) return;
    odometry_.emplace_back(std::move(around), from, keyframe.stamp, WheelWeight(link.motion));
    problem_->AddResidualBlock(&odometry_.back(), &motion_loss_, BaseOf(link.from), BaseOf(id), Scale(), Offset());
  }

  // The sweeps were carried to their keyframes with the present offset.
  void AddLaser(KeyframeId id, const Keyframe& keyframe, const MotionLink& link) {
    const Timestamp from = map_.keyframes.At(link.from).stamp;
    ImageInstant i{Around(readings_, from, from), from},
        j{Around(readings_, keyframe.stamp, keyframe.stamp), keyframe.stamp};
    if (i.around.size() < 2 || j.around.size() < 2) return;
    laser_.emplace_back(link.motion.T_i_j, std::move(i), std::move(j), present_.odometry.time_offset,
                        LaserWeight(link.motion));
    problem_->AddResidualBlock(&laser_.back(), &motion_loss_, BaseOf(link.from), BaseOf(id), Offset());
  }

  void AddPrior(const Eigen::VectorXd& mean, const Eigen::VectorXd& sigma, double* block) {
    priors_.emplace_back(sigma.cwiseInverse().asDiagonal().toDenseMatrix(), mean);
    problem_->AddResidualBlock(&priors_.back(), nullptr, block);
  }

  void AddPriors() {
    const CalibrationOptions& o = options_;
    AddPrior(Eigen::Vector3d::Ones(), Eigen::Vector3d::Constant(o.odometry_scale_sigma), Scale());
    AddPrior(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Constant(1, o.time_offset_sigma), Offset());
    Vector6d mount_sigma;
    mount_sigma << Eigen::Vector3d::Constant(o.camera_position_sigma), Eigen::Vector3d::Constant(o.camera_angle_sigma);
    AddPrior(Vector6d::Zero(), mount_sigma, Mount());
    // Points that the images leave open (behind a camera, on one ray) would leave the whole undetermined.
    constexpr double kPointSigma = 10.0;  // m
    std::size_t i = 0;
    for (const auto& [id, landmark] : map_.landmarks) {
      AddPrior(landmark.p_map, Eigen::Vector3d::Constant(kPointSigma), Point(i++));
    }
  }

  const Map& map_;
  const std::vector<OdometryReading>& readings_;
  const SensorCorrection& present_;
  const MeasurementModel& context_;
  const CalibrationOptions& options_;
  std::vector<double> blocks_;
  PoseManifold pose_manifold_;
  ceres::SubsetManifold mount_manifold_{static_cast<int>(kMountSize), {2}};  // planar motion says nothing of z
  std::deque<MountedReprojectionFactor> reprojections_;                      // cost functions cannot be moved
  std::deque<RelativePoseFactor<6>> sways_;
  std::deque<OdometryCalibrationFactor> odometry_;
  std::deque<DelayedMotionFactor> laser_;
  std::deque<ceres::NormalPrior> priors_;
  PlanarPriorFactor floor_{FloorSigmasOf(context_.planar, true)};
  ceres::HuberLoss pixel_loss_{std::sqrt(kChi2TwoDof95)};
  ceres::HuberLoss motion_loss_{kMotionHuber};
  std::unique_ptr<ceres::ParameterBlockOrdering> ordering_;
  std::unique_ptr<ceres::Problem> problem_;  // last: it refers to all of the above
};

// Addresses of the calibrated values inside a correction, in the order of CalibrationResult::values.
std::array<double*, kCalibratedValues> ValuesOf(SensorCorrection* c) {
  return {&c->odometry.scale[0], &c->odometry.scale[1], &c->odometry.scale[2],
          &c->camera_mount[0],   &c->camera_mount[1],   &c->camera_mount[3],
          &c->camera_mount[4],   &c->camera_mount[5],   &c->odometry.time_offset};
}

}  // namespace

Expected<CalibrationResult> CalibrateMap(const Map& map, const std::vector<OdometryReading>& readings,
                                         const SensorCorrection& present, const MeasurementModel& context,
                                         const CalibrationOptions& options) {
  if (!map.metric) return Error{"calibration: the map has no scale, expected a metric one"};
  CalibrationProblem problem(map, readings, present, context, options);
  const Expected<bool> solved = problem.Solve();
  if (!solved) return solved.error();
  const Expected<std::array<double, 10>> sigmas = problem.Sigmas();
  if (!sigmas) return sigmas.error();

  constexpr std::array<const char*, kCalibratedValues> kNames = {
      "odometry_scale_x", "odometry_scale_y", "odometry_scale_yaw", "camera_x",   "camera_y",
      "camera_roll",      "camera_pitch",     "camera_yaw",         "time_offset"};
  constexpr std::array<const char*, kCalibratedValues> kUnits = {"", "", "", "m", "m", "rad", "rad", "rad", "s"};
  constexpr std::array<std::size_t, kCalibratedValues> kSigmaAt = {0, 1, 2, 4, 5, 7, 8, 9, 3};
  const double scale = options.odometry_scale_sigma, position = options.camera_position_sigma,
               angle = options.camera_angle_sigma;
  const std::array<double, kCalibratedValues> priors = {
      scale, scale, scale, position, position, angle, angle, angle, options.time_offset_sigma};
  CalibrationResult result;
  result.correction = present;
  SensorCorrection found = problem.Correction();
  const auto applied = ValuesOf(&result.correction), values = ValuesOf(&found);
  for (std::size_t k = 0; k < kCalibratedValues; ++k) {
    const double sigma = (*sigmas)[kSigmaAt[k]];
    const bool observed = sigma < options.max_sigma_ratio * priors[k];
    result.values[k] = {kNames[k], kUnits[k], *values[k], sigma, priors[k], observed};
    if (observed) *applied[k] = *values[k];
  }
  return result;
}

}  // namespace planar_vslam
