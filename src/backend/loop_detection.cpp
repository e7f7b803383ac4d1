// Recognising a place that was mapped before: FindLoop.
#include <algorithm>
#include <cmath>

#include "planar_vslam/backend/loop_closing.h"
#include "planar_vslam/map/distance_driven.h"
#include "planar_vslam/optimize/pose_only.h"
#include "planar_vslam/recognition/relocalizer.h"

namespace planar_vslam {
namespace {

constexpr double kChi2ThreeDof99 = 11.345;  // chi-square, 3 dof, 99 %

class LoopFinder {
 public:
  LoopFinder(const Map& map, KeyframeId newest, const MapUncertainty& uncertainty, const MeasurementModel& context,
             const LoopOptions& options)
      : map_(map),
        newest_(newest),
        keyframe_(map.keyframes.At(newest)),
        uncertainty_(uncertainty),
        context_(context),
        options_(options),
        driven_(map) {}

  std::optional<Loop> Find() const {
    if (driven_.HasReturned(keyframe_)) return std::nullopt;
    for (const KeyframeId candidate : Candidates()) {
      std::optional<Loop> loop = Verify(candidate);
      if (loop.has_value()) return loop;
    }
    return std::nullopt;
  }

 private:
  // Old keyframes in whose view the newest may stand, those that look most like it first.
  std::vector<KeyframeId> Candidates() const {
    constexpr double kReach = 3.0;  // m, over which a place is recognised
    constexpr double kReachAngle = DegreesToRadians(45.0);
    constexpr std::size_t kTried = 3;
    const Eigen::Matrix3d covariance = uncertainty_.CovarianceOf(newest_);
    const double distance = kReach + options_.sigma_factor * std::sqrt(covariance.topLeftCorner<2, 2>().trace());
    const double angle = std::min(kReachAngle + options_.sigma_factor * std::sqrt(covariance(2, 2)), M_PI);
    std::vector<KeyframeId> old =
        NearbyKeyframes(map_, keyframe_.T_map_camera(), distance, angle, map_.keyframes.size());
    old.erase(std::remove_if(old.begin(), old.end(),
                             [this](KeyframeId id) { return driven_.Between(id, newest_) <= DistanceDriven::kReturn; }),
              old.end());
    return KeyframesResembling(map_, *keyframe_.features, OldLandmarks(old), kTried);
  }

  std::vector<LandmarkId> OldLandmarks(const std::vector<KeyframeId>& keyframes) const {
    std::vector<LandmarkId> ids = LandmarksOf(map_, keyframes);
    ids.erase(std::remove_if(ids.begin(), ids.end(),
                             [this](LandmarkId id) { return !driven_.IsOld(map_.landmarks.At(id), newest_); }),
              ids.end());
    return ids;
  }

  std::optional<Loop> Verify(KeyframeId candidate) const {
    const auto hypothesis = RelocalizeAgainst(map_, candidate, *keyframe_.features, context_.camera, {});
    if (!hypothesis.has_value()) return std::nullopt;
    constexpr std::size_t kOldPlace = 20;  // keyframes
    const std::vector<LandmarkId> place = OldLandmarks(VotedKeyframes(map_, OldLandmarks({candidate}), kOldPlace));
    Loop loop{candidate, {}};
    LoopView view;
    constexpr double kPnpRadius = 10.0;  // px
    if (!Fit(newest_, hypothesis->T_map_camera * keyframe_.T_base_camera.Inverse(), place, kPnpRadius, &view) ||
        view.matches.count < options_.min_inliers ||
        view.matches.count < options_.min_share * static_cast<double>(view.matches.visible.size()) ||
        !MayStandAt(candidate, view.T_map_base)) {
      return std::nullopt;
    }
    loop.views.push_back(std::move(view));
    if (!Confirm(place, &loop)) return std::nullopt;
    return loop;
  }

  // The pose from which a keyframe sees the old landmarks, from a guess of it.
  bool Fit(KeyframeId id, const Rigid3& guess, const std::vector<LandmarkId>& place, double radius,
           LoopView* view) const {
    const Keyframe& keyframe = map_.keyframes.At(id);
    *view = LoopView{id, guess, {}};
    constexpr double kFinalRadius = 4.0;  // px
    constexpr int kLeast = 12;            // inliers that fix a pose
    for (const double r : {radius, kFinalRadius}) {
      view->matches = FrameMatches{};
      view->matches.landmarks.resize(keyframe.features->keypoints.size());
      ProjectionSearchOptions search;
      search.radius = r;
      SearchByProjection(map_, place, view->T_map_base * keyframe.T_base_camera, context_.camera, *keyframe.features,
                         search, &view->matches);
      if (view->matches.count < kLeast || Adjust(keyframe, view) < kLeast) return false;
    }
    return true;
  }

  // The view's pose by its matches; of those only inliers remain, which are counted.
  int Adjust(const Keyframe& keyframe, LoopView* view) const {
    std::vector<PoseObservation> observations;
    for (std::size_t i = 0; i < view->matches.landmarks.size(); ++i) {
      const LandmarkId id = view->matches.landmarks[i];
      if (!id.valid()) continue;
      const Keypoint& keypoint = keyframe.features->keypoints[i];
      const double sigma = context_.pixel_sigma * map_.octave_scales[static_cast<std::size_t>(keypoint.octave)];
      observations.push_back({map_.landmarks.At(id).p_map, keypoint.pixel.cast<double>(), sigma, true});
    }
    PoseOnlyProblem problem;
    problem.T_map_base = view->T_map_base;
    problem.T_base_camera = keyframe.T_base_camera;
    problem.camera = context_.camera;
    problem.floor = keyframe.on_floor ? context_.planar.mode : PlanarMode::kOff;
    problem.sigma_height = context_.planar.sigma_height;
    problem.sigma_tilt = context_.planar.sigma_tilt;
    view->T_map_base = OptimizePose(problem, &observations).T_map_base;
    std::size_t next = 0;
    for (LandmarkId& id : view->matches.landmarks) {
      if (!id.valid() || observations[next++].inlier) continue;
      id = LandmarkId{};
      --view->matches.count;
    }
    return view->matches.count;
  }

  // Whether the map may be off as far as that, on the floor.
  bool MayStandAt(KeyframeId old, const Rigid3& T_map_base) const {
    constexpr double kOffset = 0.05;  // m, what recognising a place adds
    constexpr double kOffsetAngle = DegreesToRadians(1.0);
    const Eigen::Vector3d e = LogSe2(ProjectToPlane(keyframe_.T_map_base).Inverse() * ProjectToPlane(T_map_base));
    Eigen::Matrix3d covariance =
        options_.sigma_factor * options_.sigma_factor * uncertainty_.CovarianceBetween(old, newest_);
    covariance.diagonal() += Eigen::Vector3d(kOffset, kOffset, kOffsetAngle).cwiseAbs2();
    return e.dot(covariance.ldlt().solve(e)) < kChi2ThreeDof99;
  }

  // The keyframes before the newest see the place too, from where it would have them.
  bool Confirm(const std::vector<LandmarkId>& place, Loop* loop) const {
    constexpr int kConfirmations = 2;
    constexpr double kRadius = 10.0;  // px
    constexpr double kAgree = 0.10;   // m
    constexpr double kAgreeAngle = DegreesToRadians(2.0);
    const Rigid3 T_new_old = loop->views.front().T_map_base * keyframe_.T_map_base.Inverse();
    auto it = std::prev(map_.keyframes.end());
    for (int k = 0; k < kConfirmations; ++k) {
      if (it == map_.keyframes.begin()) return false;
      const auto& [id, keyframe] = *--it;
      const Rigid3 expected = T_new_old * keyframe.T_map_base;
      LoopView view;
      if (!Fit(id, expected, place, kRadius, &view) || 2 * view.matches.count < options_.min_inliers) return false;
      const Vector6d difference = LogSe3(expected.Inverse() * view.T_map_base);
      if (difference.head<3>().norm() > kAgree || difference.tail<3>().norm() > kAgreeAngle) return false;
      loop->views.push_back(std::move(view));
    }
    return true;
  }

  const Map& map_;
  KeyframeId newest_;
  const Keyframe& keyframe_;
  const MapUncertainty& uncertainty_;
  const MeasurementModel& context_;
  const LoopOptions& options_;
  DistanceDriven driven_;
};

}  // namespace

std::optional<Loop> FindLoop(const Map& map, KeyframeId newest, const MapUncertainty& uncertainty,
                             const MeasurementModel& context, const LoopOptions& options) {
  if (!options.enabled) return std::nullopt;
  return LoopFinder(map, newest, uncertainty, context, options).Find();
}

}  // namespace planar_vslam
