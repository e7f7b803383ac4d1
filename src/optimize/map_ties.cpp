#include "planar_vslam/optimize/map_ties.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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
  double inverse_depths = 0.0;                      // 1/m, their sum
  std::vector<std::pair<int, KeyframeId>> sharing;  // [landmarks in common, keyframe], most first
};

// Reads keyframes of one map.
class SharedViewReader {
 public:
  explicit SharedViewReader(const Map& map) : map_(map), shared_(map.next_keyframe_id, 0) {}

  SharedView Read(KeyframeId id, const Keyframe& keyframe) {
    constexpr double kNearest = 0.1;  // m
    const Rigid3 T_camera_map = keyframe.T_map_camera().Inverse();
    SharedView view;
    older_.clear();
    for (const LandmarkId landmark_id : keyframe.landmarks) {
      if (!landmark_id.valid()) continue;
      const Landmark& landmark = map_.landmarks.At(landmark_id);
      ++view.landmarks;
      view.inverse_depths += 1.0 / std::max(kNearest, (T_camera_map * landmark.p_map).z());
      for (const Observation& o : landmark.observations) {
        if (!(o.keyframe < id)) break;  // in order of keyframes
        if (shared_[o.keyframe.value]++ == 0) older_.push_back(o.keyframe);
      }
    }
    std::sort(older_.begin(), older_.end());
    for (const KeyframeId older : older_) {
      const int count = std::exchange(shared_[older.value], 0);
      if (count >= kMinShared) view.sharing.emplace_back(count, older);
    }
    std::stable_sort(view.sharing.begin(), view.sharing.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    if (view.sharing.size() > kMostNeighbors) view.sharing.resize(kMostNeighbors);
    return view;
  }

 private:
  const Map& map_;
  std::vector<int> shared_;        // by id, zero between calls
  std::vector<KeyframeId> older_;  // of one keyframe, reused from call to call
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

// Makes the ties of one keyframe of a map with those before it.
class TieMaker {
 public:
  TieMaker(const Map& map, const MeasurementModel& context, const DistanceDriven& driven)
      : map_(map), context_(context), driven_(driven), shared_views_(map) {}

  // `slack` falls to how near a distance driven is to making another decision here.
  std::vector<MapTie> TiesOf(KeyframeId id, const Keyframe& keyframe, double* slack) {
    std::vector<MapTie> ties;
    ties.reserve(1 + keyframe.laser_links.size() + kMostNeighbors);
    if (context_.options.use_odometry && keyframe.odometry_link.has_value()) ties.push_back(ByWheels(id, keyframe));
    for (const MotionLink& link : keyframe.laser_links) {
      ties.push_back(
          {link.from, id, AtEnd(link, CovarianceWithFloor(link.motion, context_.laser_floor)), TieSource::kLaser});
    }
    AddByLandmarks(id, keyframe, slack, &ties);
    return ties;
  }

 private:
  MapTie ByWheels(KeyframeId id, const Keyframe& keyframe) const {
    const MotionLink& link = *keyframe.odometry_link;
    MapTie tie{link.from, id, AtEnd(link, CovarianceWithFloor(link.motion, context_.odometry_noise)),
               TieSource::kWheels};
    const bool laser_agrees = std::any_of(keyframe.laser_links.begin(), keyframe.laser_links.end(),
                                          [&link](const MotionLink& l) { return l.from == link.from; });
    if (laser_agrees || !IsDoubtful(map_, map_.keyframes.At(link.from), keyframe, context_.camera)) return tie;
    constexpr double kKidnapped = 5.0;  // m
    constexpr double kTurned = DegreesToRadians(90.0);
    tie.covariance = Eigen::Vector3d(kKidnapped, kKidnapped, kTurned).cwiseAbs2().asDiagonal();
    tie.doubtful = true;
    return tie;
  }

  void AddByLandmarks(KeyframeId id, const Keyframe& keyframe, double* slack, std::vector<MapTie>* ties) {
    const SharedView view = shared_views_.Read(id, keyframe);
    const Rigid2 T_newer_map = ProjectToPlane(keyframe.T_map_base).Inverse();
    const double depth = view.landmarks / view.inverse_depths;
    const bool has_returned = driven_.HasReturned(map_, keyframe, slack);
    for (const auto& [count, older] : view.sharing) {
      *slack = std::min(*slack, std::abs(driven_.Between(older, id) - DistanceDriven::kReturn));
      if (!has_returned && driven_.IsReturn(older, id)) continue;
      const Rigid2 T_map_older = ProjectToPlane(map_.keyframes.At(older).T_map_base);
      const Eigen::Vector2d way = (T_newer_map * T_map_older).translation;
      ties->push_back(
          {older, id, LandmarkCovariance(count, view.landmarks, depth, way, context_), TieSource::kLandmarks});
    }
  }

  const Map& map_;
  const MeasurementModel& context_;
  const DistanceDriven& driven_;
  SharedViewReader shared_views_;
};

bool Same(const MapTie& a, const MapTie& b) {
  return a.from == b.from && a.to == b.to && a.covariance == b.covariance && a.source == b.source &&
         a.doubtful == b.doubtful;
}

bool Same(const Rigid3& a, const Rigid3& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

// But for what ties do not depend on.
bool Same(const Landmark& a, const Landmark& b) {
  const auto same = [](const Observation& x, const Observation& y) { return x.keyframe == y.keyframe; };
  return a.p_map == b.p_map && a.view_direction == b.view_direction && a.min_distance == b.min_distance &&
         a.max_distance == b.max_distance &&
         std::equal(a.observations.begin(), a.observations.end(), b.observations.begin(), b.observations.end(), same);
}

void SortUnique(std::vector<KeyframeId>* ids) {
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

// Every keyframe that has changed, that sees a landmark that has changed, or that sees what a moved one sees.
std::vector<KeyframeId> Touched(const Map& before, const Map& now, MapTies::Changes* changes) {
  std::vector<KeyframeId> touched;
  std::vector<char> is_touched(std::max(before.next_keyframe_id, now.next_keyframe_id), 0);  // by id
  const auto touch = [&](KeyframeId id) {
    if (std::exchange(is_touched[id.value], 1) == 0) touched.push_back(id);
  };
  const auto add_observers = [&touch](const Landmark* landmark) {
    if (landmark == nullptr) return;
    for (const Observation& o : landmark->observations) touch(o.keyframe);
  };
  now.keyframes.VisitChanges(before.keyframes, [&](KeyframeId id, const Keyframe* was, const Keyframe* is) {
    if (is == nullptr) {
      changes->erased.push_back(id);
      return;
    }
    touch(id);
    if (was == nullptr || (Same(was->T_map_base, is->T_map_base) && Same(was->T_base_camera, is->T_base_camera)))
      return;
    changes->moved.push_back(id);
    for (const LandmarkId landmark : is->landmarks) add_observers(now.landmarks.Find(landmark));
  });
  now.landmarks.VisitChanges(before.landmarks, [&](LandmarkId, const Landmark* was, const Landmark* is) {
    if (was != nullptr && is != nullptr && Same(*was, *is)) return;
    add_observers(was);
    add_observers(is);
  });
  std::sort(touched.begin(), touched.end());
  return touched;
}

}  // namespace

std::vector<MapTie> TiesOf(const Map& map, const MeasurementModel& context) {
  MapTies ties(context);
  ties.Follow(map);
  return ties.All();
}

// Touched ones, those with a link from one, and those for which distances have changed too much.
std::vector<KeyframeId> MapTies::ToTieAnew(const Map& map, Changes* changes) {
  std::vector<KeyframeId> anew = Touched(map_, map, changes);
  const std::size_t touched = anew.size();
  for (std::size_t k = 0; k < touched; ++k) {
    const Keyframe* keyframe = map.keyframes.Find(anew[k]);
    if (keyframe != nullptr) anew.insert(anew.end(), keyframe->linked_by.begin(), keyframe->linked_by.end());
  }
  KeyframeId first{map.next_keyframe_id};  // to stand, or not to stand, where it did
  for (const auto* changed : {&changes->moved, &changes->erased}) {
    if (!changed->empty()) first = std::min(first, changed->front());
  }
  first = std::min(first, KeyframeId{map_.next_keyframe_id});
  constexpr double kRounding = 1e-6;  // m
  const double change = driven_.Follow(map, first) + kRounding;
  for (auto it = ties_.From(first); it != ties_.end(); ++it) {
    const KeyframeId id = it->first;
    slack_[id.value] -= change;
    if (slack_[id.value] <= 0.0) anew.push_back(id);
  }
  SortUnique(&anew);
  return anew;
}

MapTies::Changes MapTies::Follow(const Map& map) {
  Changes changes;
  const std::vector<KeyframeId> anew = ToTieAnew(map, &changes);
  slack_.resize(map.next_keyframe_id, 0.0);
  ties_.Erase(changes.erased);
  TieMaker maker(map, context_, driven_);
  for (const KeyframeId id : anew) {
    const Keyframe* keyframe = map.keyframes.Find(id);
    if (keyframe == nullptr) continue;
    slack_[id.value] = std::numeric_limits<double>::infinity();
    std::vector<MapTie> ties = maker.TiesOf(id, *keyframe, &slack_[id.value]);
    const std::vector<MapTie>* before = ties_.Find(id);
    const auto same = [](const MapTie& a, const MapTie& b) { return Same(a, b); };
    if (before != nullptr && std::equal(ties.begin(), ties.end(), before->begin(), before->end(), same)) continue;
    changes.retied.push_back(id);
    if (before != nullptr) {
      ties_.Edit(id) = std::move(ties);
    } else {
      ties_.Insert(id, std::move(ties));
    }
  }
  map_ = map;
  return changes;
}

std::vector<MapTie> MapTies::All() const {
  std::vector<MapTie> all;
  for (const auto& [id, ties] : ties_) all.insert(all.end(), ties.begin(), ties.end());
  return all;
}

}  // namespace planar_vslam
