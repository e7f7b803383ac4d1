#include "planar_vslam/pipeline/localization.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/tangent_parts.h"

namespace planar_vslam {
namespace {

constexpr double kBetweenSweeps = 0.3;  // s: a laser turns more slowly than images come

// Features of the image, with twice the keypoints while there is no map: initialisation needs the matches.
FrameFeaturesPtr Extract(OrbExtractor* extractor, const GrayImage& image, bool initializing, int count) {
  constexpr int kInitializationFactor = 2;
  return std::make_shared<const FrameFeatures>(
      extractor->Extract(image, initializing ? kInitializationFactor * count : count));
}

// What odometry predicts, corrected by what was measured: a Kalman update. Where odometry is farther off than it says,
// what it missed is part of its covariance first.
PlanarFix Merged(const PlanarFix& predicted, const PlanarFix& measured) {
  constexpr double kChi2ThreeDof999 = 16.266;  // chi-square, 3 dof, 99.9 %
  const Eigen::Vector3d off = LogSe2(predicted.T_map_base.Inverse() * measured.T_map_base);
  Eigen::Matrix3d P = predicted.covariance;
  const Eigen::Matrix3d innovation = P + measured.covariance;
  if (off.dot(innovation.ldlt().solve(off)) > kChi2ThreeDof999) P += off * off.transpose();
  const Eigen::Matrix3d total = P + measured.covariance;
  const Eigen::Matrix3d gain = total.ldlt().solve(P).transpose();
  const Eigen::Matrix3d reduced = P - gain * P;
  return {predicted.T_map_base * ExpSe2(gain * off), 0.5 * (reduced + reduced.transpose())};
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
  UseSweeps();
}

void Localization::UseSweeps() {
  map_laser_ = options_.laser_localize == LaserLocalize::kAuto ? LaserOf(*map_, options_.scan_match) : MapLaser{};
}

void Localization::StartAt(const Rigid3& T_map_base, const Matrix6d& covariance) {
  tracker_.StartAt(*map_, T_map_base, covariance);
  last_.T_map_base = T_map_base;
  last_.covariance = covariance;
  finder_.reset();
  unconfirmed_ = 0;
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
  const bool grows = slot != KeyframeSlot::kNone;
  const bool found = FindPlace(packet, *frame, grows);
  TrackInput input{packet.image.stamp, frame->features, packet.T_base_camera, frame->step, slot};
  if (found) input.odometry = PlanarMotion{};  // the frame is where it was found
  const bool has_floor = model_.planar.mode != PlanarMode::kOff;
  input.may_jump = !finder_.has_value() || finder_->ByLaser() || !has_floor;
  if (!grows && input.odometry.has_value()) input.fix = FixByLaser(packet, *input.odometry);
  frame->track = tracker_.Track(input, *map_);
  if (found) frame->track.jumped = true;
  WeighView(packet, was_localized, frame);
  const TrackResult& track = frame->track;
  report->times.insert(report->times.end(), track.times.begin(), track.times.end());
  report->metric = map_->metric;
  report->state = track.status;
  if (input.fix.has_value() && input.fix->complete) fixed_ = packet.image.stamp;
  const bool fixed = fixed_.has_value() && SecondsBetween(*fixed_, packet.image.stamp) < kBetweenSweeps;
  if (track.status == TrackingState::kOdometry && fixed) report->state = TrackingState::kTracking;
  const bool declared = found || (was_localized && !grows && report->state == TrackingState::kTracking &&
                                  input.odometry.has_value() && Jumps(track, *input.odometry, packet.image.stamp));
  if (declared) report->state = TrackingState::kRelocalized;
  const bool by_images = track.status == TrackingState::kTracking || track.status == TrackingState::kRelocalized;
  unconfirmed_ = by_images || fixed ? 0 : unconfirmed_ + 1;
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

bool Localization::FindPlace(const FramePacket& packet, const TrackedFrame& frame, bool map_grows) {
  constexpr int kPatience = 20;  // frames during which the robot is taken to be about where odometry says
  const bool lost = unconfirmed_ >= kPatience && !map_grows;
  if (!frame.step.has_value() || !map_->metric || (tracker_.localized() && !lost)) {
    finder_.reset();
    return false;
  }
  if (!finder_.has_value()) {
    std::optional<Rigid2> expected;
    if (tracker_.localized()) expected = ProjectToPlane(last_.T_map_base);
    finder_.emplace(map_laser_.field, expected);
  }
  finder_->Add(packet, frame.step->T_i_j);
  std::optional<PlanarFix> found = finder_->Found();
  if (!found.has_value()) return false;
  if (tracker_.localized() && !finder_->ByLaser()) found = Merged(Predicted(*frame.step), *found);
  Matrix6d covariance = Matrix6d::Zero();
  covariance(kPlanarRows, kPlanarRows) = found->covariance;
  // Until the camera follows from there, the images of the last metres go on to tell.
  std::optional<PlaceFinder> by_sight;
  if (!finder_->ByLaser()) by_sight = std::move(finder_);
  StartAt(Embed3(found->T_map_base), covariance);
  last_.leads_from = packet.image.stamp;
  if (by_sight.has_value()) {
    finder_ = std::move(by_sight);
    unconfirmed_ = kPatience;
  }
  return true;
}

void Localization::WeighView(const FramePacket& packet, bool was_localized, TrackedFrame* frame) {
  if (!finder_.has_value()) return;
  const TrackResult& track = frame->track;
  const bool by_sight = track.status == TrackingState::kTracking || track.status == TrackingState::kRelocalized;
  if (!by_sight) {
    if (finder_->ByLaser() || model_.planar.mode != PlanarMode::kOff)
      finder_->AddView(ViewOf(packet, *frame), *map_, tracker_.seen_places());
  } else if ((!was_localized || track.jumped) && finder_->Contradicts(track.T_map_base)) {
    tracker_.StartUnlocalized();
    frame->track = TrackResult{};
  }
}

PlanarFix Localization::Predicted(const PlanarMotion& step) const {
  const Eigen::Matrix3d adjoint = AdjointSe2(step.T_i_j.Inverse());
  const Eigen::Matrix3d last = last_.covariance(kPlanarRows, kPlanarRows);
  return {ProjectToPlane(last_.T_map_base) * step.T_i_j, adjoint * last * adjoint.transpose() + step.covariance};
}

std::optional<PlanarFix> Localization::FixByLaser(const FramePacket& packet, const PlanarMotion& step) {
  if (!tracker_.localized()) return std::nullopt;
  const PlanarFix predicted = Predicted(step);
  return LaserTracker(map_laser_).Fix(packet, predicted.T_map_base, predicted.covariance);
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
    for (const RecordedFrame& early : early_frames_.TakeBefore(recorded, map_->metric)) trajectory_.Add(early);
  }
  trajectory_.Add(recorded);
  frame->number = trajectory_.size() - 1;
  last_.T_map_base = track.T_map_base;
  last_.covariance = track.covariance;
  last_.stamp = packet.image.stamp;
  if (track.jumped) last_.leads_from = packet.image.stamp;
}

}  // namespace planar_vslam
