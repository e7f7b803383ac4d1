#include "planar_vslam/pipeline/localization.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/tangent_parts.h"

namespace planar_vslam {
namespace {

// Features of the image, with twice the keypoints while there is no map: initialisation needs the matches.
FrameFeaturesPtr Extract(OrbExtractor* extractor, const GrayImage& image, bool initializing, int count) {
  constexpr int kInitializationFactor = 2;
  return std::make_shared<const FrameFeatures>(
      extractor->Extract(image, initializing ? kInitializationFactor * count : count));
}

}  // namespace

Localization::Localization(const PipelineOptions& options, const MeasurementModel& model, std::size_t trajectory_frames)
    : options_(options),
      model_(model),
      extractor_(options.orb, model.camera),
      initializer_(options.initializer, model, options.orb.ScaleFactors()),
      tracker_({model.camera, model.odometry_noise, model.planar, options.tracker, model.pixel_sigma}),
      trajectory_(trajectory_frames),
      early_frames_(trajectory_frames),
      relocalizer_({options.laser_localize, options.scan_match, model.planar.mode != PlanarMode::kOff}) {}

void Localization::StartIn(std::shared_ptr<const Map> map) {
  known_.map = std::move(map);
  tracker_.StartUnlocalized();
  UseSweeps();
}

void Localization::StartAt(const Rigid3& T_map_base, const Matrix6d& covariance) {
  relocalizer_.OnGivenPose();
  GoOnFrom(T_map_base, covariance);
  last_.leads_from = Timestamp{last_.stamp.nanoseconds + 1};
}

void Localization::GoOnFrom(const Rigid3& T_map_base, const Matrix6d& covariance) {
  tracker_.StartAt(*known_.map, T_map_base, covariance);
  last_.T_map_base = T_map_base;
  last_.covariance = covariance;
}

void Localization::Follow(const MapChange& change) {
  known_.map = change.map;
  trajectory_.OnCulled(change.keyframes_culled);
  if (change.keyframe.has_value()) {
    trajectory_.Reanchor(change.keyframe->stamp, change.keyframe->id);
    // One that was proposed before a jump is no reference after it.
    if (!(change.keyframe->stamp < last_.leads_from)) {
      tracker_.OnKeyframe(*known_.map, change.keyframe->id,
                          change.keyframe->T_map_base_proposed.Inverse() * last_.T_map_base);
    }
  }
  if (change.scaled.has_value()) {
    trajectory_.OnScaled(*known_.map, change.scaled->applied);
    tracker_.OnMapScaled(*known_.map, change.scaled->applied);
  }
  if (change.accuracy.has_value()) known_.accuracy = change.accuracy;
  if (change.wheels.has_value()) known_.wheel_noise = change.wheels->noise;
}

TrackedFrame Localization::Locate(const FramePacket& packet, KeyframeSlot slot, FrameReport* report,
                                  std::shared_ptr<const Map>* new_map) {
  TrackedFrame frame;
  const Stopwatch extracting;
  frame.features = Extract(&extractor_, packet.image.image, known_.map == nullptr, options_.orb.feature_count);
  report->times.push_back({"frame.extract", extracting.Milliseconds()});
  if (!packet.odometry.empty()) {
    frame.step = Noisier(Preintegrate(packet.odometry, model_.odometry_noise), known_.wheel_noise);
  }
  const Stopwatch tracking;
  if (known_.map == nullptr && new_map == nullptr) {
    report->waiting_for = "a map to localize in";
  } else if (known_.map == nullptr) {
    *new_map = Initialize(packet, &frame, report);
    report->times.push_back({"frame.initialize", tracking.Milliseconds()});
  } else {
    Track(packet, slot, &frame, report);
    report->times.push_back({"frame.track", tracking.Milliseconds()});
  }
  return frame;
}

std::shared_ptr<const Map> Localization::Initialize(const FramePacket& packet, TrackedFrame* frame,
                                                    FrameReport* report) {
  early_frames_.Add({packet.image.stamp, packet.T_base_camera, frame->step});
  InitializerReport initial =
      initializer_.Add({packet.image.stamp, frame->features, packet.T_base_camera, frame->step});
  report->waiting_for = initial.waiting_for;
  if (!initial.map.has_value()) return nullptr;
  known_.map = std::make_shared<const Map>(std::move(*initial.map));
  const auto& [id, keyframe] = *std::prev(known_.map->keyframes.end());
  tracker_.Start(*known_.map, id);
  for (const RecordedFrame& early : early_frames_.TakeForNewMap(*known_.map)) trajectory_.Add(early);
  frame->number = trajectory_.size() - 1;
  last_.T_map_base = keyframe.T_map_base;
  last_.stamp = packet.image.stamp;
  report->state = TrackingState::kTracking;
  report->keyframe = true;
  report->T_map_base = keyframe.T_map_base;
  report->covariance =
      LiftedCovariance(keyframe.odometry_link.has_value() ? keyframe.odometry_link->motion : PlanarMotion{},
                       model_.odometry_noise) +
      CovarianceOfMapAt(keyframe.T_map_base, *known_.map, known_.accuracy, options_.mount);
  report->metric = known_.map->metric;
  report->inliers = static_cast<int>(known_.map->landmarks.size());
  return known_.map;
}

void Localization::Track(const FramePacket& packet, KeyframeSlot slot, TrackedFrame* frame, FrameReport* report) {
  const bool was_localized = tracker_.localized();
  const bool grows = slot != KeyframeSlot::kNone;
  const bool found = FindPlace(packet, *frame, grows);
  TrackInput input{packet.image.stamp, frame->features, packet.T_base_camera, frame->step, slot};
  if (found) input.odometry = PlanarMotion{};  // the frame is where it was found
  input.may_jump = relocalizer_.ViewMayJump();
  if (!grows && input.odometry.has_value() && tracker_.localized())
    input.fix = relocalizer_.FixByLaser(packet, Moved(LastFix(), *input.odometry));
  frame->track = tracker_.Track(input, *known_.map);
  if (found) frame->track.jumped = true;
  WeighView(packet, was_localized, frame);
  const TrackResult& track = frame->track;
  report->times.insert(report->times.end(), track.times.begin(), track.times.end());
  report->metric = known_.map->metric;
  report->state = track.status;
  const bool by_camera = track.status == TrackingState::kTracking || track.status == TrackingState::kRelocalized;
  relocalizer_.Note(packet.image.stamp, by_camera, input.fix.has_value() && input.fix->complete);
  if (track.status == TrackingState::kOdometry && relocalizer_.IsFixed(packet.image.stamp))
    report->state = TrackingState::kTracking;
  const bool declared = found || (was_localized && !grows && report->state == TrackingState::kTracking &&
                                  input.odometry.has_value() && Jumps(track, *input.odometry, packet.image.stamp));
  if (declared) report->state = TrackingState::kRelocalized;
  report->inliers = track.inliers;
  report->covariance =
      track.covariance + CovarianceOfMapAt(track.T_map_base, *known_.map, known_.accuracy, options_.mount);
  report->odometry_rejected = track.odometry_rejected;
  if (!tracker_.localized()) {
    report->state = TrackingState::kInitializing;
    report->waiting_for = "a view that the saved map knows";
  }
  if (!was_localized) early_frames_.Add({packet.image.stamp, packet.T_base_camera, frame->step});
  if (track.status == TrackingState::kLost) return;
  Record(packet, was_localized, frame);
  report->T_map_base = track.T_map_base;
}

bool Localization::FindPlace(const FramePacket& packet, const TrackedFrame& frame, bool map_grows) {
  PlaceQuery query{packet, *known_.map, frame.step, std::nullopt, map_grows};
  if (tracker_.localized()) query.last = LastFix();
  const std::optional<PlanarFix> found = relocalizer_.Find(query);
  if (!found.has_value()) return false;
  Matrix6d covariance = Matrix6d::Zero();
  covariance(kPlanarRows, kPlanarRows) = found->covariance;
  GoOnFrom(Embed3(found->T_map_base), covariance);
  last_.leads_from = packet.image.stamp;
  return true;
}

void Localization::WeighView(const FramePacket& packet, bool was_localized, TrackedFrame* frame) {
  const TrackResult& track = frame->track;
  const bool by_sight = track.status == TrackingState::kTracking || track.status == TrackingState::kRelocalized;
  if (!by_sight) {
    relocalizer_.AddView(ViewOf(packet, *frame), *known_.map, tracker_.seen_places());
  } else if ((!was_localized || track.jumped) && relocalizer_.Contradicts(track.T_map_base)) {
    tracker_.StartUnlocalized();
    frame->track = TrackResult{};
  }
}

PlanarFix Localization::LastFix() const {
  return {ProjectToPlane(last_.T_map_base), last_.covariance(kPlanarRows, kPlanarRows)};
}

bool Localization::Jumps(const TrackResult& track, const PlanarMotion& step, Timestamp stamp) const {
  constexpr double kPeriod = 0.05;    // s
  constexpr double kDistance = 0.02;  // m in a period
  constexpr double kAngle = DegreesToRadians(1.0);
  const Rigid2 off = (ProjectToPlane(last_.T_map_base) * step.T_i_j).Inverse() * ProjectToPlane(track.T_map_base);
  const double periods = std::max(1.0, SecondsBetween(last_.stamp, stamp) / kPeriod);
  return off.translation.norm() > periods * kDistance || std::abs(off.angle) > periods * kAngle;
}

CameraView Localization::ViewOf(const FramePacket& packet, const TrackedFrame& frame) const {
  return {frame.features, packet.T_base_camera, model_.camera, model_.planar, model_.pixel_sigma};
}

void Localization::Record(const FramePacket& packet, bool was_localized, TrackedFrame* frame) {
  const TrackResult& track = frame->track;
  const RecordedFrame recorded{packet.image.stamp, track.reference, track.T_ref_base, packet.T_base_camera,
                               track.status == TrackingState::kOdometry};
  if (!was_localized) {
    for (const RecordedFrame& early : early_frames_.TakeBefore(recorded, known_.map->metric)) trajectory_.Add(early);
  }
  trajectory_.Add(recorded);
  frame->number = trajectory_.size() - 1;
  last_.T_map_base = track.T_map_base;
  last_.covariance = track.covariance;
  last_.stamp = packet.image.stamp;
  if (track.jumped) last_.leads_from = packet.image.stamp;
}

}  // namespace planar_vslam
