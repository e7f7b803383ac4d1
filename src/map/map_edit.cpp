#include "planar_vslam/map/map_edit.h"

#include <algorithm>
#include <utility>

#include "derived_fields.h"
#include "indexes.h"
#include "planar_vslam/geometry/check.h"
#include "sweeps.h"

namespace planar_vslam {
namespace {

void SortUnique(std::vector<LandmarkId>* ids) {
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

auto ObservationFrom(std::vector<Observation>* observations, KeyframeId keyframe) {
  return std::lower_bound(observations->begin(), observations->end(), keyframe,
                          [](const Observation& o, KeyframeId id) { return o.keyframe < id; });
}

// Carries steps out one after the other. References are in step after each of them; derived fields and the removal of
// landmarks from the IdMap wait for Finish(). Until then a landmark without observations counts as gone.
class Editor {
 public:
  explicit Editor(Map map) : map_(std::move(map)), first_new_landmark_(map_.next_landmark_id) {}

  void operator()(const AddKeyframe& step);
  void operator()(const AddLandmark& step);
  void operator()(const AddObservation& step);
  void operator()(const EraseObservation& step);
  void operator()(const EraseLandmarks& step);
  void operator()(const EraseKeyframe& step);
  void operator()(const MergeLandmarks& step);
  void operator()(const AddSweeps& step);
  void operator()(const AddLaserLinks& step);
  void operator()(const EraseOdometryLink& step);
  void operator()(const CorrectOdometryLinks& step);
  void operator()(const SetKeyframePose& step);
  void operator()(const SetImageOffset& step);
  void operator()(const SetOffFloor& step);
  void operator()(const SetLandmarkPosition& step);
  void operator()(const CountSightings& step);
  void operator()(const TransformMap& step);
  void operator()(const SetMetric& step) { map_.metric = step.metric; }

  Map Finish() &&;

 private:
  Landmark* FindLandmark(LandmarkId id);
  // Both directions of one reference. False, and nothing done, where the keypoint is taken, the keyframe already
  // observes the landmark or does not exist.
  bool Connect(LandmarkId id, Landmark* landmark, const Observation& observation);
  void Disconnect(LandmarkId id, KeyframeId keyframe);
  void FreeKeypoint(const Observation& observation);
  void EraseLandmark(LandmarkId id, Landmark* landmark);
  void RehomeSweeps(KeyframeId erased_id, const Keyframe& erased);
  void BridgeLaser(KeyframeId erased_id, const std::vector<MotionLink>& erased_links, KeyframeId later);
  void AddLaserLink(KeyframeId id, Keyframe* keyframe, const MotionLink& link);
  void BridgeOdometry(KeyframeId erased_id, const std::optional<MotionLink>& erased_link, KeyframeId later);
  void EraseThinLandmarks();
  void UpdateDerivedFields();

  Map map_;
  const std::uint32_t first_new_landmark_;  // ids from here on were created in this edit
  std::vector<LandmarkId> gone_;            // without observations, to be taken out of the map
  std::vector<LandmarkId> thinned_;         // lost an observation
  std::vector<LandmarkId> reobserved_;      // observations changed: all derived fields
  std::vector<LandmarkId> moved_;           // they or their cameras moved: view direction and distances
};

Landmark* Editor::FindLandmark(LandmarkId id) {
  const Landmark* landmark = map_.landmarks.Find(id);
  return landmark != nullptr && !landmark->observations.empty() ? &map_.landmarks.Edit(id) : nullptr;
}

bool Editor::Connect(LandmarkId id, Landmark* landmark, const Observation& observation) {
  const Keyframe* keyframe = map_.keyframes.Find(observation.keyframe);
  if (keyframe == nullptr) return false;
  PV_CHECK(observation.keypoint < keyframe->landmarks.size(), "keyframe " << observation.keyframe.value
                                                                          << " keypoint=" << observation.keypoint
                                                                          << " of " << keyframe->landmarks.size());
  const auto at = ObservationFrom(&landmark->observations, observation.keyframe);
  if (keyframe->landmarks[observation.keypoint].valid() ||
      (at != landmark->observations.end() && at->keyframe == observation.keyframe))
    return false;
  landmark->observations.insert(at, observation);
  map_.keyframes.Edit(observation.keyframe).landmarks[observation.keypoint] = id;
  reobserved_.push_back(id);
  return true;
}

void Editor::FreeKeypoint(const Observation& observation) {
  map_.keyframes.Edit(observation.keyframe).landmarks[observation.keypoint] = LandmarkId{};
}

void Editor::Disconnect(LandmarkId id, KeyframeId keyframe) {
  Landmark* landmark = FindLandmark(id);
  if (landmark == nullptr) return;
  const auto at = ObservationFrom(&landmark->observations, keyframe);
  if (at == landmark->observations.end() || at->keyframe != keyframe) return;
  FreeKeypoint(*at);
  landmark->observations.erase(at);
  if (landmark->observations.empty()) {
    gone_.push_back(id);
  } else {
    thinned_.push_back(id);
    reobserved_.push_back(id);
  }
}

void Editor::EraseLandmark(LandmarkId id, Landmark* landmark) {
  for (const Observation& o : landmark->observations) FreeKeypoint(o);
  landmark->observations.clear();
  gone_.push_back(id);
}

void Editor::operator()(const AddKeyframe& step) {
  PV_CHECK(step.id.valid() && step.id.value >= map_.next_keyframe_id,
           "id=" << step.id.value << " next=" << map_.next_keyframe_id);
  map_.next_keyframe_id = step.id.value + 1;

  Keyframe& keyframe = map_.keyframes.Insert(step.id, step.keyframe);
  PV_CHECK(keyframe.features != nullptr && keyframe.landmarks.size() == keyframe.features->keypoints.size(),
           "keyframe " << step.id.value << " needs features and one landmark entry per keypoint, has "
                       << keyframe.landmarks.size());
  if (keyframe.odometry_link) {
    const KeyframeId from = keyframe.odometry_link->from;
    PV_CHECK(from < step.id, "id=" << step.id.value << " from=" << from.value);
    if (!map_.keyframes.Contains(from)) keyframe.odometry_link.reset();
    IndexLink(&map_, from, step.id);
  }
  keyframe.linked_by.clear();
  IndexPlace(&map_, step.id);
  keyframe.laser_links.clear();
  for (const MotionLink& link : step.keyframe.laser_links) AddLaserLink(step.id, &keyframe, link);

  const auto count = static_cast<std::uint32_t>(keyframe.landmarks.size());
  keyframe.landmarks.assign(count, LandmarkId{});
  for (std::uint32_t keypoint = 0; keypoint < count; ++keypoint) {
    const LandmarkId id = step.keyframe.landmarks[keypoint];
    if (Landmark* landmark = FindLandmark(id)) Connect(id, landmark, {step.id, keypoint});
  }
}

void Editor::operator()(const AddLandmark& step) {
  PV_CHECK(step.id.valid() && step.id.value >= map_.next_landmark_id,
           "id=" << step.id.value << " next=" << map_.next_landmark_id);
  PV_CHECK(!step.landmark.observations.empty(), "landmark " << step.id.value << " has no observations");
  map_.next_landmark_id = step.id.value + 1;

  Landmark& landmark = map_.landmarks.Insert(step.id, step.landmark);
  landmark.observations.clear();
  for (const Observation& o : step.landmark.observations) {
    const bool connected = Connect(step.id, &landmark, o);
    PV_CHECK(connected, "landmark " << step.id.value << " keyframe " << o.keyframe.value << " keypoint " << o.keypoint
                                    << ": expected an existing keyframe, once, and a free keypoint");
  }
}

void Editor::operator()(const AddObservation& step) {
  if (Landmark* landmark = FindLandmark(step.landmark)) Connect(step.landmark, landmark, step.observation);
}

void Editor::operator()(const EraseObservation& step) { Disconnect(step.landmark, step.keyframe); }

void Editor::operator()(const EraseLandmarks& step) {
  for (const LandmarkId id : step.ids) {
    if (Landmark* landmark = FindLandmark(id)) EraseLandmark(id, landmark);
  }
}

void Editor::operator()(const EraseKeyframe& step) {
  if (!map_.keyframes.Contains(step.id)) return;
  const Keyframe erased = map_.keyframes.At(step.id);  // a copy: the one in the map changes under our hands
  for (const LandmarkId id : erased.landmarks) {
    if (id.valid()) Disconnect(id, step.id);
  }
  for (const KeyframeId later : erased.linked_by) {
    BridgeOdometry(step.id, erased.odometry_link, later);
    BridgeLaser(step.id, erased.laser_links, later);
  }
  RehomeSweeps(step.id, erased);
  DropPlace(&map_, step.id);
  map_.keyframes.Erase({step.id});
  for (const KeyframeId from : LinkedFrom(erased)) IndexLink(&map_, from, step.id);
}

void Editor::BridgeLaser(KeyframeId erased_id, const std::vector<MotionLink>& erased_links, KeyframeId later) {
  Keyframe& keyframe = map_.keyframes.Edit(later);
  std::vector<MotionLink>& links = keyframe.laser_links;
  const auto link = std::find_if(links.begin(), links.end(), [&](const auto& l) { return l.from == erased_id; });
  if (link == links.end()) return;
  const PlanarMotion from_erased = link->motion;
  links.erase(link);
  if (erased_links.empty()) return;
  const MotionLink& nearest = erased_links.back();  // ascending: the latest, whose way is the shortest
  AddLaserLink(later, &keyframe, {nearest.from, Compose(nearest.motion, from_erased)});
}

void Editor::AddLaserLink(KeyframeId id, Keyframe* keyframe, const MotionLink& link) {
  if (!(link.from < id) || !map_.keyframes.Contains(link.from)) return;
  std::vector<MotionLink>& links = keyframe->laser_links;
  const auto at = std::lower_bound(links.begin(), links.end(), link.from,
                                   [](const MotionLink& l, KeyframeId from) { return l.from < from; });
  if (at == links.end() || at->from != link.from) links.insert(at, link);
  IndexLink(&map_, link.from, id);
}

void Editor::RehomeSweeps(KeyframeId erased_id, const Keyframe& erased) {
  if (map_.keyframes.size() < 2) return;
  const std::vector<LaserSweep> sweeps = ThinSweeps(&map_, erased_id);
  if (sweeps.empty()) return;
  Keyframe& home = map_.keyframes.Edit(HomeForSweeps(map_, erased_id));
  const Rigid2 T_home_from = ProjectToPlane(home.T_map_base).Inverse() * ProjectToPlane(erased.T_map_base);
  for (LaserSweep sweep : sweeps) {
    sweep.T_keyframe_base = T_home_from * sweep.T_keyframe_base;
    home.sweeps.push_back(std::move(sweep));
  }
}

void Editor::BridgeOdometry(KeyframeId erased_id, const std::optional<MotionLink>& erased_link, KeyframeId later) {
  std::optional<MotionLink>& link = map_.keyframes.Edit(later).odometry_link;
  if (!link || link->from != erased_id) return;
  if (erased_link) {
    link = MotionLink{erased_link->from, Compose(erased_link->motion, link->motion)};
    IndexLink(&map_, erased_link->from, later);
  } else {
    link.reset();
  }
}

void Editor::operator()(const MergeLandmarks& step) {
  Landmark* from = FindLandmark(step.from);
  Landmark* into = FindLandmark(step.into);
  if (from == nullptr || into == nullptr || from == into) return;
  const std::vector<Observation> observations = from->observations;
  EraseLandmark(step.from, from);
  for (const Observation& o : observations) Connect(step.into, into, o);
  into->predicted_visible += from->predicted_visible;
  into->found += from->found;
}

void Editor::operator()(const AddSweeps& step) {
  Keyframe* keyframe = map_.keyframes.FindToEdit(step.keyframe);
  if (keyframe == nullptr) return;
  for (const LaserSweep& sweep : step.sweeps) PV_CHECK(sweep.scan != nullptr, "keyframe " << step.keyframe.value);
  keyframe->sweeps.insert(keyframe->sweeps.end(), step.sweeps.begin(), step.sweeps.end());
}

void Editor::operator()(const AddLaserLinks& step) {
  Keyframe* keyframe = map_.keyframes.FindToEdit(step.keyframe);
  if (keyframe == nullptr) return;
  for (const MotionLink& link : step.links) AddLaserLink(step.keyframe, keyframe, link);
}

void Editor::operator()(const EraseOdometryLink& step) {
  const Keyframe* keyframe = map_.keyframes.Find(step.keyframe);
  if (keyframe == nullptr || !keyframe->odometry_link.has_value()) return;
  const KeyframeId from = keyframe->odometry_link->from;
  map_.keyframes.Edit(step.keyframe).odometry_link.reset();
  IndexLink(&map_, from, step.keyframe);
}

void Editor::operator()(const CorrectOdometryLinks& step) {
  const Eigen::Vector3d factors(step.length, step.length, step.turn);
  std::vector<KeyframeId> linked;
  for (auto it = map_.keyframes.From(step.first); it != map_.keyframes.end(); ++it) {
    if (it->second.odometry_link.has_value()) linked.push_back(it->first);
  }
  for (const KeyframeId id : linked) {
    PlanarMotion& motion = map_.keyframes.Edit(id).odometry_link->motion;
    motion = Noisier(std::move(motion), step.noise);
    motion.T_i_j = ExpSe2(factors.cwiseProduct(LogSe2(motion.T_i_j)));
    motion.distance *= step.length;
    motion.turn *= step.turn;
  }
}

void Editor::operator()(const SetKeyframePose& step) {
  Keyframe* keyframe = map_.keyframes.FindToEdit(step.id);
  if (keyframe == nullptr) return;
  const Rigid3 T_map_base_before = keyframe->T_map_base, T_map_camera_before = keyframe->T_map_camera();
  keyframe->T_map_base = step.T_map_base;
  IndexMove(&map_, step.id, T_map_base_before, T_map_camera_before);
  for (const LandmarkId id : keyframe->landmarks) {
    if (id.valid()) moved_.push_back(id);
  }
}

void Editor::operator()(const SetImageOffset& step) {
  for (const KeyframeId id : map_.keyframes.Ids()) {
    const ImageMoment& moment = map_.keyframes.At(id).moment;
    if (moment.velocity.isZero(0.0) || moment.offset == step.offset) continue;
    Keyframe& keyframe = map_.keyframes.Edit(id);
    const Rigid3 T_map_base_before = keyframe.T_map_base, T_map_camera = keyframe.T_map_camera();
    const Rigid3 shift = MountShift(keyframe.moment, step.offset);
    keyframe.T_base_camera = shift * keyframe.T_base_camera;
    keyframe.T_map_base = T_map_base_before * shift.Inverse();
    keyframe.moment.offset = step.offset;
    IndexMove(&map_, id, T_map_base_before, T_map_camera);
    for (const LandmarkId landmark : keyframe.landmarks) {  // the camera stays but for rounding
      if (landmark.valid()) moved_.push_back(landmark);
    }
  }
}

void Editor::operator()(const SetOffFloor& step) {
  for (const KeyframeId id : step.ids) {
    if (Keyframe* keyframe = map_.keyframes.FindToEdit(id)) keyframe->on_floor = false;
  }
}

void Editor::operator()(const SetLandmarkPosition& step) {
  Landmark* landmark = FindLandmark(step.id);
  if (landmark == nullptr) return;
  landmark->p_map = step.p_map;
  moved_.push_back(step.id);
}

void Editor::operator()(const CountSightings& step) {
  for (const LandmarkId id : step.predicted_visible) {
    if (Landmark* landmark = FindLandmark(id)) ++landmark->predicted_visible;
  }
  for (const LandmarkId id : step.found) {
    if (Landmark* landmark = FindLandmark(id)) ++landmark->found;
  }
}

void Editor::operator()(const TransformMap& step) {
  for (const KeyframeId id : map_.keyframes.Ids()) {
    Keyframe& keyframe = map_.keyframes.Edit(id);
    Rigid3 T_map_camera = keyframe.T_map_camera();
    T_map_camera.translation *= step.scale;
    keyframe.T_map_base = step.T_new_old * T_map_camera * keyframe.T_base_camera.Inverse();
  }
  for (const LandmarkId id : map_.landmarks.Ids()) {
    Landmark& landmark = map_.landmarks.Edit(id);
    landmark.p_map = step.T_new_old * Eigen::Vector3d(step.scale * landmark.p_map);
    moved_.push_back(id);
  }
  IndexPlaces(&map_);
}

void Editor::EraseThinLandmarks() {
  constexpr std::size_t kMinObservations = 2;  // a point on a single ray has no depth
  for (const LandmarkId id : thinned_) {
    const Landmark* landmark = map_.landmarks.Find(id);
    if (landmark == nullptr || landmark->observations.empty() || id.value >= first_new_landmark_) continue;
    if (landmark->observations.size() < kMinObservations) EraseLandmark(id, &map_.landmarks.Edit(id));
  }
}

void Editor::UpdateDerivedFields() {
  if (reobserved_.empty() && moved_.empty()) return;
  DerivedFields derived(map_);
  SortUnique(&reobserved_);
  for (const LandmarkId id : reobserved_) {
    if (Landmark* landmark = map_.landmarks.FindToEdit(id)) derived.UpdateDescriptor(landmark);
  }
  moved_.insert(moved_.end(), reobserved_.begin(), reobserved_.end());
  SortUnique(&moved_);
  for (const LandmarkId id : moved_) {
    if (Landmark* landmark = map_.landmarks.FindToEdit(id)) derived.UpdateGeometry(landmark);
  }
}

Map Editor::Finish() && {
  EraseThinLandmarks();
  if (!gone_.empty()) {
    std::sort(gone_.begin(), gone_.end());
    map_.landmarks.Erase(gone_);
  }
  UpdateDerivedFields();
  return std::move(map_);
}

}  // namespace

Map Apply(Map map, const MapEdit& edit) {
  Editor editor(std::move(map));
  for (const MapEditStep& step : edit) std::visit(editor, step);
  return std::move(editor).Finish();
}

}  // namespace planar_vslam
