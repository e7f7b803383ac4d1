#include "planar_vslam/backend/loop_detection.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/map/distance_driven.h"
#include "planar_vslam/map/queries.h"
#include "planar_vslam/recognition/place.h"
#include "planar_vslam/recognition/place_index.h"

namespace planar_vslam {
namespace {

class LoopFinder {
 public:
  LoopFinder(const Map& map, KeyframeId newest, const MapDrift& drift, const MeasurementModel& context,
             const LoopOptions& options)
      : map_(map),
        newest_(newest),
        keyframe_(map.keyframes.At(newest)),
        drift_(drift),
        context_(context),
        options_(options),
        driven_(drift.ties().driven()) {}

  std::optional<Loop> Find() const {
    if (driven_.HasReturned(map_, keyframe_)) return std::nullopt;
    for (const KeyframeId candidate : Candidates()) {
      std::optional<Loop> loop = Try(candidate);
      if (loop.has_value()) return loop;
    }
    return std::nullopt;
  }

 private:
  // Old keyframes in whose view the newest may stand, those that look most like it first.
  std::vector<KeyframeId> Candidates() const {
    const Eigen::Matrix3d covariance = drift_.CovarianceOfNewest();
    const double distance =
        PlaceLimits::kReach + options_.sigma_factor * std::sqrt(covariance.topLeftCorner<2, 2>().trace());
    const double angle = std::min(PlaceLimits::kReachAngle + options_.sigma_factor * std::sqrt(covariance(2, 2)), M_PI);
    std::vector<KeyframeId> old =
        NearbyKeyframes(map_, keyframe_.T_map_camera(), distance, angle, map_.keyframes.size());
    old.erase(std::remove_if(old.begin(), old.end(), [this](KeyframeId id) { return !driven_.IsReturn(id, newest_); }),
              old.end());
    return PlaceIndex(map_, OldLandmarks(old)).Resembling(*keyframe_.features, PlaceLimits::kTried);
  }

  std::vector<LandmarkId> OldLandmarks(const std::vector<KeyframeId>& keyframes) const {
    std::vector<LandmarkId> ids = LandmarksOf(map_, keyframes);
    ids.erase(std::remove_if(ids.begin(), ids.end(),
                             [this](LandmarkId id) { return !driven_.IsOld(map_.landmarks.At(id), newest_); }),
              ids.end());
    return ids;
  }

  std::optional<Loop> Try(KeyframeId candidate) const {
    const std::vector<LandmarkId> place =
        OldLandmarks(VotedKeyframes(map_, OldLandmarks({candidate}), PlaceLimits::kPlaceKeyframes));
    std::optional<Placement> found = Verify(map_, ViewOf(keyframe_), place, candidate);
    if (!found.has_value() || found->matches.count < options_.min_inliers || !found->Shows(options_.min_share) ||
        !MayStandAt(candidate, found->T_map_base)) {
      return std::nullopt;
    }
    Loop loop{candidate, {{newest_, found->T_map_base, std::move(found->matches)}}};
    if (!Confirm(place, &loop)) return std::nullopt;
    return loop;
  }

  CameraView ViewOf(const Keyframe& keyframe) const {
    CameraView view{keyframe.features, keyframe.T_base_camera, context_.camera, context_.planar, context_.pixel_sigma};
    if (!keyframe.on_floor) view.planar.mode = PlanarMode::kOff;
    return view;
  }

  // Whether the map may be off as far as that, on the floor.
  bool MayStandAt(KeyframeId old, const Rigid3& T_map_base) const {
    constexpr double kOffset = 0.05;  // m, what recognising a place adds
    constexpr double kOffsetAngle = DegreesToRadians(1.0);
    const Eigen::Vector3d e = LogSe2(ProjectToPlane(keyframe_.T_map_base).Inverse() * ProjectToPlane(T_map_base));
    Eigen::Matrix3d covariance =
        options_.sigma_factor * options_.sigma_factor * drift_.Uncertainty().CovarianceBetween(old, newest_);
    covariance.diagonal() += Eigen::Vector3d(kOffset, kOffset, kOffsetAngle).cwiseAbs2();
    return e.dot(covariance.ldlt().solve(e)) < kChi2ThreeDof99;
  }

  // The keyframes before the newest see the place too, from where it would have them.
  bool Confirm(const std::vector<LandmarkId>& place, Loop* loop) const {
    const Rigid3 T_new_old = loop->views.front().T_map_base * keyframe_.T_map_base.Inverse();
    auto it = std::prev(map_.keyframes.end());
    for (int k = 1; k < PlaceLimits::kViewsInARow; ++k) {
      if (it == map_.keyframes.begin()) return false;
      const auto& [id, keyframe] = *--it;
      const Rigid3 expected = T_new_old * keyframe.T_map_base;
      std::optional<Placement> found = Verify(map_, ViewOf(keyframe), place, expected);
      if (!found.has_value() || 2 * found->matches.count < options_.min_inliers) return false;
      const Vector6d difference = LogSe3(expected.Inverse() * found->T_map_base);
      if (difference.head<3>().norm() > PlaceLimits::kAgreeDistance) return false;
      if (difference.tail<3>().norm() > PlaceLimits::kAgreeAngle) return false;
      loop->views.push_back({id, found->T_map_base, std::move(found->matches)});
    }
    return true;
  }

  const Map& map_;
  KeyframeId newest_;
  const Keyframe& keyframe_;
  const MapDrift& drift_;
  const MeasurementModel& context_;
  const LoopOptions& options_;
  const DistanceDriven& driven_;
};

}  // namespace

std::optional<Loop> FindLoop(const Map& map, KeyframeId newest, const MapDrift& drift, const MeasurementModel& context,
                             const LoopOptions& options) {
  if (!options.enabled) return std::nullopt;
  return LoopFinder(map, newest, drift, context, options).Find();
}

}  // namespace planar_vslam
