#include "planar_vslam/optimize/map_ties.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/map/distance_driven.h"
#include "planar_vslam/map/predicted_view.h"

namespace planar_vslam {
namespace {

constexpr double kSharedFactor = 6.0;      // k in the header; fitted: NEES bears it out, see BENCHMARK.md
constexpr double kAlong = 0.03;            // share of the way between two keyframes that landmarks leave open
constexpr std::size_t kMostNeighbors = 6;  // ties by landmarks, a keyframe
constexpr int kMinShared = 12;

// Covariance of (r, phi) in the frame of i, as links hold it, as one of the right tangent at j.
Eigen::Matrix3d AtEnd(const MotionLink& link, const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = link.motion.T_i_j.R();
  return B.transpose() * covariance * B;
}

// What one keyframe sees, and which ones before it see the same.
struct SharedView {
  int landmarks = 0;
  double inverse_depths = 0.0;                       // 1/m, their sum
  std::vector<std::pair<int, std::size_t>> sharing;  // [landmarks in common, index in the map], most first
};

// Goes through the keyframes of a map, each by its index.
class SharedViewReader {
 public:
  explicit SharedViewReader(const Map& map)
      : landmark_of_(map.next_landmark_id, nullptr), index_of_(map.next_keyframe_id), shared_(map.keyframes.size(), 0) {
    for (const auto& [id, landmark] : map.landmarks) landmark_of_[id.value] = &landmark;
    std::size_t index = 0;
    for (const auto& [id, keyframe] : map.keyframes) index_of_[id.value] = index++;
  }

  SharedView Read(KeyframeId id, const Keyframe& keyframe) {
    constexpr double kNearest = 0.1;  // m
    const Rigid3 T_camera_map = keyframe.T_map_camera().Inverse();
    SharedView view;
    for (const LandmarkId landmark_id : keyframe.landmarks) {
      if (!landmark_id.valid()) continue;
      const Landmark& landmark = *landmark_of_[landmark_id.value];
      ++view.landmarks;
      view.inverse_depths += 1.0 / std::max(kNearest, (T_camera_map * landmark.p_map).z());
      for (const Observation& o : landmark.observations) {
        if (!(o.keyframe < id)) break;  // in order of keyframes
        ++shared_[index_of_[o.keyframe.value]];
      }
    }
    for (std::size_t older = 0; older < index_of_[id.value]; ++older) {
      const int count = std::exchange(shared_[older], 0);
      if (count >= kMinShared) view.sharing.emplace_back(count, older);
    }
    std::stable_sort(view.sharing.begin(), view.sharing.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    if (view.sharing.size() > kMostNeighbors) view.sharing.resize(kMostNeighbors);
    return view;
  }

 private:
  std::vector<const Landmark*> landmark_of_;  // by id
  std::vector<std::size_t> index_of_;         // by id: asked for every observation of the map
  std::vector<int> shared_;                   // by index, zero between calls
};

// Of a tie by `count` landmarks in common, the right tangent at the newer keyframe; `way` from there to the older one.
Eigen::Matrix3d LandmarkCovariance(int count, int seen, double depth, const Eigen::Vector2d& way,
                                   const MeasurementModel& context) {
  const double n = count;
  const double heading = kSharedFactor * context.pixel_sigma / (context.camera.fx * std::sqrt(n)) * seen / n;
  const double position = depth * heading;
  Eigen::Matrix3d covariance = Eigen::Vector3d(position, position, heading).cwiseAbs2().asDiagonal();
  covariance.topLeftCorner<2, 2>() += kAlong * kAlong * way * way.transpose();
  return covariance;
}

int CountShared(const Keyframe& a, const Keyframe& b) {
  std::vector<LandmarkId> seen = b.landmarks;
  std::sort(seen.begin(), seen.end());
  return static_cast<int>(std::count_if(a.landmarks.begin(), a.landmarks.end(), [&seen](LandmarkId id) {
    return id.valid() && std::binary_search(seen.begin(), seen.end(), id);
  }));
}

// Whether `to`, by what the wheels say, should see much of what `from` sees, and sees something quite different.
bool IsDoubtful(const Map& map, const Keyframe& from, const Keyframe& to, const CameraModel& camera) {
  constexpr std::size_t kRichView = 200;  // keypoints
  constexpr int kMuch = 40;               // landmarks
  constexpr double kHardlyAny = 0.1;      // of them
  if (to.features->keypoints.size() < kRichView) return false;
  const Rigid3 T_map_camera = from.T_map_base * Embed3(to.odometry_link->motion.T_i_j) * to.T_base_camera;
  int expected = 0;
  PredictedView view;
  for (const LandmarkId id : from.landmarks) {
    if (id.valid() && PredictView(map.landmarks.At(id), T_map_camera, camera, map.octave_scales, &view)) ++expected;
  }
  return expected >= kMuch && CountShared(from, to) < kHardlyAny * expected;
}

class TieCollector {
 public:
  TieCollector(const Map& map, const MeasurementModel& context) : map_(map), context_(context), driven_(map) {}

  std::vector<MapTie> Collect() {
    SharedViewReader shared_views(map_);
    for (const auto& [id, keyframe] : map_.keyframes) {
      if (context_.options.use_odometry && keyframe.odometry_link.has_value()) AddWheels(id, keyframe);
      for (const MotionLink& link : keyframe.laser_links) {
        Add(link, CovarianceWithFloor(link.motion, context_.laser_floor), id, TieSource::kLaser);
      }
      AddLandmarks(id, keyframe, shared_views.Read(id, keyframe));
    }
    return std::move(ties_);
  }

 private:
  // `covariance` of the motion, as links hold it.
  MapTie& Add(const MotionLink& link, const Eigen::Matrix3d& covariance, KeyframeId to, TieSource source) {
    ties_.push_back({map_.keyframes.IndexOf(link.from), map_.keyframes.IndexOf(to), AtEnd(link, covariance), source});
    return ties_.back();
  }

  void AddWheels(KeyframeId id, const Keyframe& keyframe) {
    const MotionLink& link = *keyframe.odometry_link;
    MapTie& tie = Add(link, CovarianceWithFloor(link.motion, context_.odometry_noise), id, TieSource::kWheels);
    const bool laser_agrees = std::any_of(keyframe.laser_links.begin(), keyframe.laser_links.end(),
                                          [&link](const MotionLink& l) { return l.from == link.from; });
    if (laser_agrees || !IsDoubtful(map_, map_.keyframes.At(link.from), keyframe, context_.camera)) return;
    constexpr double kKidnapped = 5.0;  // m
    constexpr double kTurned = DegreesToRadians(90.0);
    tie.covariance = Eigen::Vector3d(kKidnapped, kKidnapped, kTurned).cwiseAbs2().asDiagonal();
    tie.doubtful = true;
  }

  void AddLandmarks(KeyframeId id, const Keyframe& keyframe, const SharedView& view) {
    const std::size_t newer = map_.keyframes.IndexOf(id);
    const Rigid2 T_newer_map = ProjectToPlane(keyframe.T_map_base).Inverse();
    const double depth = view.landmarks / view.inverse_depths;
    const bool has_returned = driven_.HasReturned(keyframe);
    for (const auto& [count, older] : view.sharing) {
      const auto& [older_id, other] = map_.keyframes.EntryAt(older);
      if (!has_returned && driven_.Between(older_id, id) > DistanceDriven::kReturn) continue;
      const Eigen::Vector2d way = (T_newer_map * ProjectToPlane(other.T_map_base)).translation;
      ties_.push_back(
          {older, newer, LandmarkCovariance(count, view.landmarks, depth, way, context_), TieSource::kLandmarks});
    }
  }

  const Map& map_;
  const MeasurementModel& context_;
  DistanceDriven driven_;
  std::vector<MapTie> ties_;
};

}  // namespace

std::vector<MapTie> TiesOf(const Map& map, const MeasurementModel& context) {
  return TieCollector(map, context).Collect();
}

}  // namespace planar_vslam
