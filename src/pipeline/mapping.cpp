#include "planar_vslam/pipeline/mapping.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "planar_vslam/pipeline/image_timing.h"

namespace planar_vslam {

Mapping::Mapping(const MapJobsContext& context, std::shared_ptr<const Map> map, Schedule schedule, bool may_link,
                 const WheelErrors& wheels, std::shared_ptr<const Map> known)
    : context_(context),
      session_begin_{map->next_keyframe_id},
      jobs_(context, std::move(map), schedule, wheels, std::move(known)) {
  if (may_link) since_keyframe_ = PlanarMotion{};
}

bool Mapping::Add(const FramePacket& packet, TrackedFrame frame, const TrajectoryRecorder& trajectory) {
  // Where the wheels slipped, the step counts for less.
  if (frame.step.has_value() && since_keyframe_.has_value()) {
    const bool slipped = frame.track.odometry_rejected;
    since_keyframe_ = Compose(*since_keyframe_, slipped ? Inflate(*frame.step, frame.track.slip) : *frame.step);
  } else {
    since_keyframe_.reset();
  }
  CountSightingsOf(frame.track.matches);
  if (!frame.number.has_value()) return false;
  if (frame.track.jumped) {  // odometry did not lead here, and where it led before is refuted
    since_keyframe_.reset();
    sweeps_.DropOnOdometry(trajectory);
  }
  sweeps_.Add(packet, *frame.number);
  if (frame.track.keyframe_waits) jobs_.Hurry();
  if (!frame.track.wants_keyframe || jobs_.busy()) return false;
  Propose(packet, std::move(frame), trajectory);
  return true;
}

void Mapping::CountSightingsOf(const FrameMatches& matches) {
  constexpr std::size_t kEnough = 200'000;  // a robot that stands for hours makes no keyframe to take them
  if (sightings_.predicted_visible.size() >= kEnough) return;
  sightings_.predicted_visible.insert(sightings_.predicted_visible.end(), matches.visible.begin(),
                                      matches.visible.end());
  std::copy_if(matches.landmarks.begin(), matches.landmarks.end(), std::back_inserter(sightings_.found),
               [](LandmarkId id) { return id.valid(); });
}

void Mapping::Propose(const FramePacket& packet, TrackedFrame frame, const TrajectoryRecorder& trajectory) {
  KeyframeProposal proposal;
  proposal.keyframe = {packet.image.stamp,
                       frame.track.T_map_base,
                       packet.T_base_camera,
                       std::move(frame.features),
                       std::move(frame.track.matches.landmarks),
                       {},
                       frame.track.on_floor};
  proposal.keyframe.moment = MomentOf(packet);
  if (since_keyframe_.has_value()) {
    proposal.odometry = OverWholeMotion(*since_keyframe_, context_.mapper.model.odometry_noise);
  }
  proposal.sightings = std::exchange(sightings_, {});
  proposal.off_floor_since = frame.track.off_floor_since;
  proposal.session_begin = session_begin_;
  if (packet.T_odom_base.has_value()) {
    std::optional<LaserSweep> own = sweeps_.TakeLatest(*packet.T_odom_base, packet.image.stamp);
    if (own.has_value()) proposal.keyframe.sweeps.push_back(std::move(*own));
  }
  const bool all_sweeps = frame.track.status != TrackingState::kOdometry;
  proposal.sweeps = sweeps_.Take(*map(), trajectory, all_sweeps);
  since_keyframe_.reset();
  if (!packet.odometry.empty() || packet.T_odom_base.has_value()) since_keyframe_ = PlanarMotion{};
  jobs_.AddKeyframe(std::move(proposal));
}

std::vector<MapChange> Mapping::Collect(bool wait) {
  std::vector<MapChange> all;
  for (std::vector<MapChange> changes = jobs_.Collect(wait); !changes.empty(); changes = jobs_.Collect(wait)) {
    for (MapChange& change : changes) {
      if (change.keyframe.has_value()) TryScaleRecovery(change);
      all.push_back(std::move(change));
    }
  }
  return all;
}

// An unscaled map becomes metric once the sources of scale settle on one: keyframes and points scaled, the map levelled
// to the first base pose, global bundle adjustment. With `scale.keyframes` it is the paper's procedure: N keyframes,
// and scale from odometry between them.
void Mapping::TryScaleRecovery(const MapChange& change) {
  if (change.map->metric || change.map->keyframes.size() < 3) return;
  const MapScale& now = *change.scale;
  const int wanted = context_.scale.keyframes;
  if (wanted > 0) {
    const int have = static_cast<int>(change.map->keyframes.size());
    scale_missing_ = have < wanted ? std::to_string(wanted - have) + " more keyframes for the scale" : "";
    if (!now.track.has_value()) scale_missing_ = "scale: drive on, sideways or forwards";
  } else {
    scale_missing_ = scale_gate_.Missing(now, context_.scale);
  }
  if (!scale_missing_.empty() || jobs_.busy()) return;
  jobs_.MakeMetric(wanted > 0 ? std::log(now.track->scale) : now.fused->log_scale, change.keyframe->stamp);
}

void Mapping::FollowImageOffset(double offset, double worth) {
  if (std::abs(offset - image_offset_) < worth) return;
  image_offset_ = offset;
  jobs_.SetImageOffset(offset);
}

int Mapping::FinalIterations() const {
  constexpr int kFinalIterations = 30;
  return std::max(context_.mapper.model.options.max_iterations, kFinalIterations);
}

void Mapping::AdjustWholeMap() { jobs_.AdjustWholeMap(FinalIterations()); }

Expected<MapChange> Mapping::Finish(const TrajectoryRecorder& trajectory, bool adjust) {
  const std::vector<::planar_vslam::AddSweeps> sweeps = sweeps_.Take(*map(), trajectory, true);
  if (!sweeps.empty()) jobs_.Edit(MapEdit(sweeps.begin(), sweeps.end()));
  if (adjust) return jobs_.AdjustNow(FinalIterations());
  MapChange change;
  change.map = map();
  change.scale = jobs_.FinalScale();
  return change;
}

}  // namespace planar_vslam
