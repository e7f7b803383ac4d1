#include "planar_vslam/pipeline/localization.h"

#include <utility>

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
      early_frames_(trajectory_frames) {}

void Localization::StartIn(std::shared_ptr<const Map> map) {
  map_ = std::move(map);
  tracker_.StartUnlocalized();
}

void Localization::StartAt(const Rigid3& T_map_base, const Matrix6d& covariance) {
  tracker_.StartAt(*map_, T_map_base, covariance);
  last_.T_map_base = T_map_base;
  last_.leads_from = Timestamp{last_.stamp.nanoseconds + 1};
}

void Localization::Follow(const MapChange& change) {
  map_ = change.map;
  trajectory_.OnCulled(change.keyframes_culled);
  if (change.keyframe.has_value()) {
    trajectory_.Reanchor(change.keyframe->stamp, change.keyframe->id);
    // One that was proposed before a jump is no reference after it.
    if (!(change.keyframe->stamp < last_.leads_from)) {
      tracker_.OnKeyframe(*map_, change.keyframe->id,
                          change.keyframe->T_map_base_proposed.Inverse() * last_.T_map_base);
    }
  }
  if (change.scaled.has_value()) {
    trajectory_.OnScaled(*map_, change.scaled->applied);
    tracker_.OnMapScaled(*map_, change.scaled->applied);
  }
  if (change.accuracy.has_value()) accuracy_ = change.accuracy;
}

TrackedFrame Localization::Locate(const FramePacket& packet, KeyframeSlot slot, FrameReport* report,
                                  std::shared_ptr<const Map>* new_map) {
  TrackedFrame frame;
  const Stopwatch extracting;
  frame.features = Extract(&extractor_, packet.image.image, map_ == nullptr, options_.orb.feature_count);
  report->times.push_back({"frame.extract", extracting.Milliseconds()});
  if (!packet.odometry.empty()) frame.step = Preintegrate(packet.odometry, model_.odometry_noise);
  const Stopwatch tracking;
  if (map_ == nullptr && new_map == nullptr) {
    report->waiting_for = "a map to localize in";
  } else if (map_ == nullptr) {
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
  map_ = std::make_shared<const Map>(std::move(*initial.map));
  const auto& [id, keyframe] = *std::prev(map_->keyframes.end());
  tracker_.Start(*map_, id);
  for (const RecordedFrame& early : early_frames_.TakeForNewMap(*map_)) trajectory_.Add(early);
  frame->number = trajectory_.size() - 1;
  last_.T_map_base = keyframe.T_map_base;
  last_.stamp = packet.image.stamp;
  report->state = TrackingState::kTracking;
  report->keyframe = true;
  report->T_map_base = keyframe.T_map_base;
  report->covariance =
      LiftedCovariance(keyframe.odometry_link.has_value() ? keyframe.odometry_link->motion : PlanarMotion{},
                       model_.odometry_noise) +
      CovarianceOfMapAt(keyframe.T_map_base, *map_, accuracy_, options_.mount);
  report->metric = map_->metric;
  report->inliers = static_cast<int>(map_->landmarks.size());
  return map_;
}

void Localization::Track(const FramePacket& packet, KeyframeSlot slot, TrackedFrame* frame, FrameReport* report) {
  const bool was_localized = tracker_.localized();
  frame->track = tracker_.Track({packet.image.stamp, frame->features, packet.T_base_camera, frame->step, slot}, *map_);
  const TrackResult& track = frame->track;
  report->times.insert(report->times.end(), track.times.begin(), track.times.end());
  report->metric = map_->metric;
  report->state = track.status;
  report->inliers = track.inliers;
  report->covariance = track.covariance + CovarianceOfMapAt(track.T_map_base, *map_, accuracy_, options_.mount);
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

void Localization::Record(const FramePacket& packet, bool was_localized, TrackedFrame* frame) {
  const TrackResult& track = frame->track;
  const RecordedFrame recorded{packet.image.stamp, track.reference, track.T_ref_base, packet.T_base_camera,
                               track.status == TrackingState::kOdometry};
  if (!was_localized) {
    for (const RecordedFrame& early : early_frames_.TakeBefore(recorded, map_->metric)) trajectory_.Add(early);
  }
  trajectory_.Add(recorded);
  frame->number = trajectory_.size() - 1;
  last_.T_map_base = track.T_map_base;
  last_.stamp = packet.image.stamp;
  if (track.jumped) last_.leads_from = packet.image.stamp;
}

}  // namespace planar_vslam
