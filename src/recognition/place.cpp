#include "planar_vslam/recognition/place.h"

#include <utility>

#include "planar_vslam/recognition/relocalizer.h"

namespace planar_vslam {
namespace {

std::optional<Placement> Adjusted(const Map& map, const CameraView& view, const Rigid3& T_map_base,
                                  FrameMatches matches) {
  if (matches.count < PlaceLimits::kMinInliers) return std::nullopt;
  std::vector<PoseObservation> observations = ObservationsOf(map, view, matches);
  const PoseOnlyResult pose = OptimizePose(PoseProblem(view, T_map_base), &observations);
  Placement placement{pose.T_map_base, CovarianceOf(pose), std::move(matches)};
  KeepInliers(observations, &placement.matches);
  if (placement.matches.count < PlaceLimits::kMinInliers) return std::nullopt;
  return placement;
}

std::optional<Placement> Projected(const Map& map, const CameraView& view, const std::vector<LandmarkId>& landmarks,
                                   const Rigid3& T_map_base, double window) {
  ProjectionSearchOptions search;
  search.radius = window;
  FrameMatches matches;
  SearchByProjection(map, landmarks, T_map_base * view.T_base_camera, view.camera, *view.features, search, &matches);
  return Adjusted(map, view, T_map_base, std::move(matches));
}

}  // namespace

std::optional<Placement> Recognize(const Map& map, const CameraView& view, KeyframeId keyframe) {
  auto guess = RelocalizeAgainst(map, keyframe, *view.features, view.camera);
  if (!guess.has_value()) return std::nullopt;
  return Adjusted(map, view, guess->T_map_camera * view.T_base_camera.Inverse(), std::move(guess->matches));
}

std::optional<Placement> Verify(const Map& map, const CameraView& view, const std::vector<LandmarkId>& landmarks,
                                const Rigid3& T_map_base) {
  const std::optional<Placement> wide = Projected(map, view, landmarks, T_map_base, PlaceLimits::kGuessWindow);
  if (!wide.has_value()) return std::nullopt;
  return Projected(map, view, landmarks, wide->T_map_base, PlaceLimits::kFinalWindow);
}

std::optional<Placement> Verify(const Map& map, const CameraView& view, const std::vector<LandmarkId>& landmarks,
                                KeyframeId keyframe) {
  const auto guess = RelocalizeAgainst(map, keyframe, *view.features, view.camera);
  if (!guess.has_value()) return std::nullopt;
  return Verify(map, view, landmarks, guess->T_map_camera * view.T_base_camera.Inverse());
}

std::vector<PoseObservation> ObservationsOf(const Map& map, const CameraView& view, const FrameMatches& matches) {
  std::vector<PoseObservation> observations;
  observations.reserve(static_cast<std::size_t>(matches.count));
  for (std::size_t i = 0; i < matches.landmarks.size(); ++i) {
    if (!matches.landmarks[i].valid()) continue;
    const Keypoint& keypoint = view.features->keypoints[i];
    const double sigma = view.pixel_sigma * map.octave_scales[static_cast<std::size_t>(keypoint.octave)];
    observations.push_back({map.landmarks.At(matches.landmarks[i]).p_map, keypoint.pixel.cast<double>(), sigma, true});
  }
  return observations;
}

PoseOnlyProblem PoseProblem(const CameraView& view, const Rigid3& T_map_base) {
  PoseOnlyProblem problem;
  problem.T_map_base = T_map_base;
  problem.T_base_camera = view.T_base_camera;
  problem.camera = view.camera;
  problem.floor = view.planar.mode;
  problem.sigma_height = view.planar.sigma_height;
  problem.sigma_tilt = view.planar.sigma_tilt;
  return problem;
}

void KeepInliers(const std::vector<PoseObservation>& observations, FrameMatches* matches) {
  std::size_t next = 0;
  for (std::size_t i = 0; i < matches->landmarks.size(); ++i) {
    LandmarkId& id = matches->landmarks[i];
    if (!id.valid() || observations[next++].inlier) continue;
    matches->refused.push_back({i, id});
    id = LandmarkId{};
    --matches->count;
  }
}

Matrix6d CovarianceOf(const PoseOnlyResult& pose) {
  constexpr double kUnmeasured = 1e-6;  // 1/m^2, 1/rad^2: what nothing measures is known this well
  return (pose.information + kUnmeasured * Matrix6d::Identity()).inverse();
}

}  // namespace planar_vslam
