#include "planar_vslam/backend/map_correction.h"

#include <algorithm>
#include <utility>

namespace planar_vslam {
namespace {

// How each keyframe moves, as a motion of the map frame. Knows also keyframes that are gone by now.
class KeyframeMotions {
 public:
  KeyframeMotions(const Map& now, const std::vector<CorrectedKeyframe>& corrected) {
    const std::uint32_t count = std::max(now.next_keyframe_id, corrected.empty() ? 0U : corrected.back().id.value + 1);
    T_new_old_.resize(count);
    for (const CorrectedKeyframe& k : corrected) T_new_old_[k.id.value] = k.T_map_after * k.T_map_before.Inverse();
    const Rigid3 newest = corrected.empty() ? Rigid3() : *T_new_old_[corrected.back().id.value];
    for (const auto& [id, keyframe] : now.keyframes) {
      if (Knows(id)) continue;
      // Links lead to earlier keyframes, which have been through here.
      T_new_old_[id.value] =
          keyframe.odometry_link.has_value() ? Of(keyframe.odometry_link->from) : OfWhatItSees(now, id, newest);
    }
  }

  bool Knows(KeyframeId id) const { return id.value < T_new_old_.size() && T_new_old_[id.value].has_value(); }
  const Rigid3& Of(KeyframeId id) const { return *T_new_old_[id.value]; }
  const Rigid3& Of(const Landmark& landmark) const {
    return Of(Knows(landmark.created_by) ? landmark.created_by : landmark.observations.front().keyframe);
  }

 private:
  // Of the known keyframe that sees most of the same.
  Rigid3 OfWhatItSees(const Map& now, KeyframeId id, const Rigid3& otherwise) const {
    for (const CovisibleKeyframe& c : CovisibleKeyframes(now, id, 1)) {
      if (Knows(c.id)) return Of(c.id);
    }
    return otherwise;
  }

  std::vector<std::optional<Rigid3>> T_new_old_;  // by id
};

// A link of a keyframe that has been culled since is part of the link of the keyframe after it.
MapEditStep InMapAsItIs(const Map& now, const MapEditStep& step) {
  const auto* erase = std::get_if<EraseOdometryLink>(&step);
  if (erase == nullptr || now.keyframes.Contains(erase->keyframe)) return step;
  for (const auto& [id, keyframe] : now.keyframes) {
    if (!(erase->keyframe < id)) continue;
    const bool spans = keyframe.odometry_link.has_value() && keyframe.odometry_link->from < erase->keyframe;
    return spans ? EraseOdometryLink{id} : *erase;
  }
  return step;
}

}  // namespace

MapCorrection CorrectionBetween(const Map& before, const Map& after, MapEdit structure) {
  MapCorrection correction;
  for (const auto& [id, keyframe] : before.keyframes) {
    const Keyframe* moved = after.keyframes.Find(id);
    if (moved != nullptr) correction.keyframes.push_back({id, keyframe.T_map_base, moved->T_map_base});
  }
  for (const auto& [id, landmark] : before.landmarks) {
    const Landmark* moved = after.landmarks.Find(id);
    if (moved != nullptr) correction.landmarks.push_back({id, landmark.p_map, moved->p_map});
  }
  correction.structure = std::move(structure);
  return correction;
}

Map Rebase(Map now, const MapCorrection& correction) {
  const KeyframeMotions motions(now, correction.keyframes);
  MapEdit edit;
  edit.reserve(now.keyframes.size() + now.landmarks.size() + correction.structure.size());
  for (const auto& [id, keyframe] : now.keyframes) {
    edit.emplace_back(SetKeyframePose{id, motions.Of(id) * keyframe.T_map_base});
  }
  auto corrected = correction.landmarks.begin();
  for (const auto& [id, landmark] : now.landmarks) {
    while (corrected != correction.landmarks.end() && corrected->id < id) ++corrected;
    const Rigid3& T_new_old = motions.Of(landmark);
    const bool in_both = corrected != correction.landmarks.end() && corrected->id == id;
    const Eigen::Vector3d p_map =
        in_both ? Eigen::Vector3d(corrected->p_map_after +
                                  T_new_old.rotation * Eigen::Vector3d(landmark.p_map - corrected->p_map_before))
                : T_new_old * landmark.p_map;
    edit.emplace_back(SetLandmarkPosition{id, p_map});
  }
  for (const MapEditStep& step : correction.structure) edit.push_back(InMapAsItIs(now, step));
  return Apply(std::move(now), edit);
}

}  // namespace planar_vslam
