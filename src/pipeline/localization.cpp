#include "planar_vslam/pipeline/localization.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/map/map_union.h"

namespace planar_vslam {
namespace {

// Features of the image, with twice the keypoints while there is no map: initialisation needs the matches.
FrameFeaturesPtr Extract(OrbExtractor* extractor, const GrayImage& image, bool initializing, int count) {
  constexpr int kInitializationFactor = 2;
  return std::make_shared<const FrameFeatures>(
      extractor->Extract(image, initializing ? kInitializationFactor * count : count));
}

}  // namespace

Localization::Localization(const PipelineOptions& options, const MeasurementModel& model, Schedule schedule,
                           std::size_t trajectory_frames)
    : model_(model),
      images_{options.orb.feature_count, OrbExtractor(options.orb, model.camera),
              ImageTiming(options.image_timing, model.camera)},
      beginning_{Initializer(options.initializer, model, options.orb.ScaleFactors()), EarlyFrames(trajectory_frames),
                 nullptr, std::nullopt},
      tracker_({model.camera, model.odometry_noise, model.planar, options.tracker, model.pixel_sigma}),
      known_{nullptr, std::nullopt, WheelNoise{}, options.mount},
      trajectory_(trajectory_frames),
      relocalizer_({options.laser_localize, options.scan_match, options.systematic,
                    model.planar.mode != PlanarMode::kOff, schedule}),
      laser_slip_(options.scan_match) {}

void Localization::StartIn(std::shared_ptr<const Map> map) {
  known_.map = std::move(map);
  tracker_.StartUnlocalized();
  slew_.Forget();
  UseSweeps();
}

void Localization::StartAt(const Rigid3& T_map_base, const Matrix6d& covariance) {
  relocalizer_.OnGivenPose();
  slew_.Forget();
  GoOnFrom(T_map_base, covariance);
  last_.leads_from = Timestamp{last_.stamp.nanoseconds + 1};
}

void Localization::GoOnFrom(const Rigid3& T_map_base, const Matrix6d& covariance) {
  tracker_.StartAt(*known_.map, T_map_base, covariance);
  last_.T_map_base = T_map_base;
  last_.covariance = covariance;
}

void Localization::Follow(const MapChange& change) {
  if (change.image_offset.has_value()) FollowImages(change);
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
  last_.T_map_base = tracker_.LastPose(*known_.map).value_or(last_.T_map_base);
  if (change.accuracy.has_value()) known_.accuracy = change.accuracy;
  if (change.wheels.has_value()) known_.wheel_noise = change.wheels->noise;
}

// Before the map is taken over: shifts are from what its images had.
void Localization::FollowImages(const MapChange& change) {
  const double offset = *change.image_offset;
  if (const std::optional<KeyframeId> reference = tracker_.reference()) {
    tracker_.OnImageOffset(*change.map, trajectory_.ShiftOf(*known_.map, *reference, offset),
                           trajectory_.ShiftOfLast(offset));
  }
  trajectory_.OnImageOffset(*known_.map, offset);
}

TrackedFrame Localization::Locate(const FramePacket& packet, KeyframeSlot slot, FrameReport* report,
                                  std::shared_ptr<const Map>* new_map, FrameFeaturesPtr features) {
  TrackedFrame frame;
  frame.features = std::move(features);
  if (frame.features == nullptr) {
    const Stopwatch extracting;
    frame.features = images_.timing.Straightened(
        Extract(&images_.extractor, packet.image.image, known_.map == nullptr, images_.feature_count), packet);
    report->times.push_back({"frame.extract", extracting.Milliseconds()});
  }
  if (!packet.odometry.empty()) {
    frame.step = Noisier(Preintegrate(packet.odometry, model_.odometry_noise), known_.wheel_noise);
    if (slot != KeyframeSlot::kNone) CheckSlip(packet, &*frame.step, report);
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

void Localization::CheckSlip(const FramePacket& packet, PlanarMotion* step, FrameReport* report) {
  const Stopwatch checking;
  const std::optional<PlanarMotion> slipped = laser_slip_.Check(packet, *step, last_.blind && known_.map->metric);
  if (last_.blind) report->times.push_back({"frame.check_slip", checking.Milliseconds()});
  if (!slipped.has_value()) return;
  *step = *slipped;
  report->odometry_rejected = true;
}

std::shared_ptr<const Map> Localization::Initialize(const FramePacket& packet, TrackedFrame* frame,
                                                    FrameReport* report) {
  const ImageMoment moment = MomentOf(packet);
  beginning_.early.Add({packet.image.stamp, packet.T_base_camera, frame->step, moment});
  InitializerReport initial =
      beginning_.initializer.Add({packet.image.stamp, frame->features, packet.T_base_camera, frame->step, moment});
  report->waiting_for = initial.waiting_for;
  if (!initial.map.has_value()) return nullptr;
  if (beginning_.below != nullptr) initial.map = RenumberedAbove(*beginning_.below, *initial.map);
  beginning_.below.reset();
  if (beginning_.T_map_base.has_value() && initial.map->metric) {
    const Rigid2 T_own_base = ProjectToPlane(std::prev(initial.map->keyframes.end())->second.T_map_base);
    const Rigid2 T_new_own = ProjectToPlane(*beginning_.T_map_base) * T_own_base.Inverse();
    initial.map = Apply(std::move(*initial.map), {TransformMap{1.0, Embed3(T_new_own)}});
  }
  known_.map = std::make_shared<const Map>(std::move(*initial.map));
  const auto& [id, keyframe] = *std::prev(known_.map->keyframes.end());
  tracker_.Start(*known_.map, id);
  for (const RecordedFrame& early : beginning_.early.TakeForNewMap(*known_.map)) trajectory_.Add(early);
  frame->number = trajectory_.size() - 1;
  last_.T_map_base = keyframe.T_map_base;
  last_.stamp = packet.image.stamp;
  report->state = TrackingState::kTracking;
  report->keyframe = true;
  report->T_map_base = keyframe.T_map_base;
  report->covariance =
      LiftedCovariance(keyframe.odometry_link.has_value() ? keyframe.odometry_link->motion : PlanarMotion{},
                       model_.odometry_noise) +
      CovarianceOfMapAt(keyframe.T_map_base, *known_.map, known_.accuracy, known_.mount);
  report->metric = known_.map->metric;
  report->inliers = static_cast<int>(known_.map->landmarks.size());
  return known_.map;
}

void Localization::Track(const FramePacket& packet, KeyframeSlot slot, TrackedFrame* frame, FrameReport* report) {
  const bool was_localized = tracker_.localized();
  const bool grows = slot != KeyframeSlot::kNone;
  bool found = FindPlace(packet, *frame, grows);
  TrackInput input{packet.image.stamp, frame->features, packet.T_base_camera, frame->step, slot};
  if (found) input.odometry = PlanarMotion{};  // the frame is where it was found
  input.may_jump = relocalizer_.ViewMayJump();
  if (!grows && input.odometry.has_value() && tracker_.localized())
    input.fix = relocalizer_.FixByLaser(packet, Moved(*LastFix(), *input.odometry));
  frame->track = tracker_.Track(input, *known_.map);
  if (!was_localized && !grows) found = SettleByLaser(packet, &input, frame) || found;
  if (found) frame->track.jumped = true;
  WeighView(packet, was_localized, frame);
  const TrackResult& track = frame->track;
  report->times.insert(report->times.end(), track.times.begin(), track.times.end());
  report->metric = known_.map->metric;
  report->state = track.status;
  const bool by_camera = track.status == TrackingState::kTracking || track.status == TrackingState::kRelocalized;
  relocalizer_.Note(packet.image.stamp, by_camera, input.fix.has_value() && input.fix->complete);
  if (track.status == TrackingState::kOdometry && (found || relocalizer_.IsFixed(packet.image.stamp)))
    report->state = TrackingState::kTracking;
  if (found && !was_localized) report->state = TrackingState::kRelocalized;
  report->inliers = track.inliers;
  frame->by_view_alone = track.status == TrackingState::kTracking && !track.jumped && !input.fix.has_value();
  if (by_camera) images_.timing.Watch(packet, *frame->features, track, *known_.map);
  report->covariance =
      track.covariance + CovarianceOfMapAt(track.T_map_base, *known_.map, known_.accuracy, known_.mount);
  report->covariance(kPlanarRows, kPlanarRows) += relocalizer_.Drift() + images_.timing.ClockCovariance(packet);
  report->odometry_rejected = report->odometry_rejected || track.odometry_rejected;
  if (!tracker_.localized()) {
    report->state = TrackingState::kInitializing;
    report->waiting_for = "a view that the saved map knows";
  }
  if (!was_localized) {
    beginning_.early.Add({packet.image.stamp, packet.T_base_camera, frame->step, MomentOf(packet)});
  }
  if (track.status == TrackingState::kLost) {
    slew_.Forget();
    return;
  }
  Record(packet, was_localized, frame);
  report->T_map_base = track.T_map_base;
  if (grows) {
    slew_.Forget();
  } else {
    Slew(frame->step, report);
  }
}

bool Localization::SettleByLaser(const FramePacket& packet, TrackInput* input, TrackedFrame* frame) {
  constexpr double kPosition = 0.10;  // m, standard deviation: much of what is in view may stand elsewhere
  constexpr double kAngle = DegreesToRadians(2.0);
  const bool by_camera = frame->track.status == TrackingState::kRelocalized && !input->fix.has_value();
  if (!by_camera || !input->odometry.has_value() || relocalizer_.Contradicts(frame->track.T_map_base)) return false;
  PlanarFix seen{ProjectToPlane(frame->track.T_map_base)};
  seen.covariance = Eigen::Vector3d(kPosition, kPosition, kAngle).cwiseAbs2().asDiagonal();
  const std::optional<PlanarFix> fix = relocalizer_.FixByLaser(packet, seen);
  if (!fix.has_value() || !fix->complete) return false;
  Matrix6d covariance = Matrix6d::Zero();
  covariance(kPlanarRows, kPlanarRows) = seen.covariance;
  GoOnFrom(frame->track.T_map_base, covariance);
  input->odometry = PlanarMotion{};
  input->fix = fix;
  frame->track = tracker_.Track(*input, *known_.map);
  return true;
}

void Localization::Slew(const std::optional<PlanarMotion>& step, FrameReport* report) {
  std::optional<Rigid2> moved;
  if (report->metric && step.has_value()) moved = step->T_i_j;
  const PoseSlew::Published pose = slew_.Publish({*report->T_map_base, report->covariance}, moved, report->stamp);
  report->T_map_base = pose.T_map_base;
  report->covariance = pose.covariance;
  if (pose.jumped) report->state = TrackingState::kRelocalized;
}

bool Localization::FindPlace(const FramePacket& packet, const TrackedFrame& frame, bool map_grows) {
  PlaceQuery query{packet, known_.map, frame.step, std::nullopt, map_grows};
  query.last = LastFix();
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
    std::optional<PlanarFix> predicted;
    if (tracker_.localized())
      predicted = PlanarFix{ProjectToPlane(track.T_map_base), track.covariance(kPlanarRows, kPlanarRows)};
    relocalizer_.AddView(ViewOf(packet, *frame), tracker_.seen_places(), predicted);
  } else if ((!was_localized || track.jumped) && relocalizer_.Contradicts(track.T_map_base)) {
    tracker_.StartUnlocalized();
    frame->track = TrackResult{};
  }
}

std::optional<PlanarFix> Localization::LastFix() const {
  if (!tracker_.localized()) return std::nullopt;
  return PlanarFix{ProjectToPlane(last_.T_map_base), last_.covariance(kPlanarRows, kPlanarRows)};
}

CameraView Localization::ViewOf(const FramePacket& packet, const TrackedFrame& frame) const {
  return {frame.features, packet.T_base_camera, model_.camera, model_.planar, model_.pixel_sigma};
}

void Localization::Record(const FramePacket& packet, bool was_localized, TrackedFrame* frame) {
  const TrackResult& track = frame->track;
  const RecordedFrame recorded{packet.image.stamp,
                               track.reference,
                               track.T_ref_base,
                               packet.T_base_camera,
                               track.status == TrackingState::kOdometry,
                               MomentOf(packet)};
  if (!was_localized) {
    for (const RecordedFrame& early : beginning_.early.TakeBefore(recorded, known_.map->metric)) trajectory_.Add(early);
  }
  trajectory_.Add(recorded);
  frame->number = trajectory_.size() - 1;
  last_.T_map_base = track.T_map_base;
  last_.covariance = track.covariance;
  last_.stamp = packet.image.stamp;
  last_.blind = track.status == TrackingState::kOdometry;
  if (track.jumped) last_.leads_from = packet.image.stamp;
}

}  // namespace planar_vslam
