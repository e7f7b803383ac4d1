#pragma once
// Pose of every frame: odometry prediction, search by projection, local map, robust pose-only optimisation. When vision
// fails on a metric map the pose is the odometry prediction with growing covariance, and every further frame first
// tries to re-match the map projected around that prediction.
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/frontend/place_search.h"
#include "planar_vslam/frontend/tracking_state.h"
#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/stopwatch.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/planar/floor_monitor.h"
#include "planar_vslam/planar/odometry_noise.h"
#include "planar_vslam/planar/planar_prior.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/recognition/projection_search.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

struct TrackerOptions {
  double frame_search_radius = 15.0;
  double map_search_radius = 4.0;
  double rematch_radius_max = 40.0;
  int min_inliers = 25;
  int min_inliers_odometry = 12;
  int min_inliers_rematch = 20;
  int local_keyframes = 20;
  double nearby_distance = 2.0;
  double nearby_angle = DegreesToRadians(40.0);
  double keyframe_ratio = 0.75;
  int keyframe_rich_view = 150;
  double keyframe_rich_ratio = 0.63;
  double keyframe_distance = 0.12;
  double keyframe_angle = DegreesToRadians(12.0);
  int keyframe_min_gap = 2;
  int keyframe_min_features = 60;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("frame_search_radius", o.frame_search_radius, unit::kPixels, bound::Positive(),
      "landmarks of the last image around the prediction");
    v("map_search_radius", o.map_search_radius, unit::kPixels, bound::Positive(),
      "local map around the first estimate");
    v("rematch_radius_max", o.rematch_radius_max, unit::kPixels, bound::Positive(),
      "cap of the search while on odometry");
    v("min_inliers", o.min_inliers, unit::kNone, bound::AtLeast("min_inliers_odometry", o.min_inliers_odometry),
      "matches a pose from vision alone needs");
    v("min_inliers_odometry", o.min_inliers_odometry, unit::kNone, bound::AtLeast(1),
      "matches when odometry takes part and agrees");
    v("min_inliers_rematch", o.min_inliers_rematch, unit::kNone, bound::AtLeast(1),
      "matches to leave the odometry state");
    v("local_keyframes", o.local_keyframes, unit::kNone, bound::AtLeast(1), "in the local map");
    v("nearby_distance", o.nearby_distance, unit::kMeters, bound::AtLeast(0.0),
      "keyframes this near join the local map of a metric map...");
    v("nearby_angle_deg", o.nearby_angle, unit::kDegrees, bound::FromTo(0.0, 180.0),
      "...when they look this much the same way");
    v("keyframe_ratio", o.keyframe_ratio, unit::kNone, bound::Between(0.0, 1.0),
      "new keyframe when fewer than this share of the reference's landmarks remain...");
    v("keyframe_rich_view", o.keyframe_rich_view, unit::kNone, bound::AtLeast(0),
      "...where as many landmarks in view are seen by three keyframes...", Origin::kFitted);
    v("keyframe_rich_ratio", o.keyframe_rich_ratio, unit::kNone, bound::Between(0.0, 1.0),
      "...fewer than this share: halls need fresh landmarks sooner than laboratories...", Origin::kFitted);
    v("keyframe_distance", o.keyframe_distance, unit::kNone, bound::Positive(),
      "...or the camera moved this share of the median depth...");
    v("keyframe_angle_deg", o.keyframe_angle, unit::kDegrees, bound::Positive(), "...or turned this much");
    v("keyframe_min_gap", o.keyframe_min_gap, unit::kNone, bound::AtLeast(1), "images between keyframes");
    v("keyframe_min_features", o.keyframe_min_features, unit::kNone, bound::AtLeast(0),
      "keypoints a keyframe on odometry alone needs");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

struct TrackerContext {
  CameraModel camera;
  OdometryNoise odometry_noise;
  PlanarPriorOptions planar;
  TrackerOptions options;
  double pixel_sigma = 1.0;  // px, of a keypoint at full resolution
};

// Whether a frame may become a keyframe.
enum class KeyframeSlot {
  kNone,   // the map does not grow
  kTaken,  // the keyframe before is still being mapped
  kFree,
};

// The pose of the base on the floor as something else than odometry and camera measured it: the laser, in a saved map.
struct PlanarFix {
  Rigid2 T_map_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // of a right perturbation [x, y, angle]
  bool complete = false;                                     // all three are known: it stands against the camera
};

struct TrackInput {
  Timestamp stamp;
  FrameFeaturesPtr features;
  Rigid3 T_base_camera;
  std::optional<PlanarMotion> odometry;  // since the last tracked frame
  KeyframeSlot slot = KeyframeSlot::kFree;
  std::optional<PlanarFix> fix{};  // of the base at this frame
  bool may_jump = true;            // whether the first pose, or one far from the prediction, may be told by this search
};

struct TrackResult {
  TrackingState status = TrackingState::kLost;
  Rigid3 T_map_base;
  Matrix6d covariance = Matrix6d::Identity();  // of a right perturbation [translation, rotation]
  KeyframeId reference;                        // keyframe the pose is relative to
  Rigid3 T_ref_base;
  int inliers = 0;
  bool tilted = false;             // more than floors do (a sill, a ramp): only x, y and yaw of odometry took part
  bool odometry_rejected = false;  // vision and odometry disagreed (slip): odometry did not take part
  Eigen::Vector3d slip =
      Eigen::Vector3d::Zero();  // then, what odometry missed: right tangent [x, y, angle] of its pose
  bool wants_keyframe = false;  // and may
  bool keyframe_waits = false;  // would want, were the slot not taken
  bool jumped = false;          // found far from where the frames before led: no motion leads here from them
  bool on_floor = true;         // whether the floor prior took part
  std::optional<Timestamp> off_floor_since;  // the floor was left, as this frame tells, then (floor_monitor.h)
  FrameMatches matches;                      // inliers only
  StageTimes times;                          // "track.match", "track.pose", "track.place_search"
};

// A pose of the base and its covariance (of a right perturbation [translation, rotation]).
struct PoseBelief {
  Rigid3 T_ref_base;
  Matrix6d covariance = Matrix6d::Zero();
};

// Where a way by odometry alone begins, and what odometry measured since: at the last keyframe, or where it was wrong.
// The landmarks around a keyframe that was placed by its view are as far off as it is: it has no covariance of its own.
struct OdometryAnchor {
  PoseBelief start;
  PlanarMotion since;
};

// Up to which keyframe view and odometry agreed on the scale of the map: over a way on which half of it would be
// noticed. Keyframes that were placed while they did not confirm each other whatever is wrong with them.
class ScaleAgreement {
 public:
  ScaleAgreement() = default;
  explicit ScaleAgreement(KeyframeId until) : until_(until), waiting_(until) {}
  KeyframeId until() const { return until_; }
  void Add(double way, KeyframeId newest);  // m by odometry, of frames that agree
  void Disagree(KeyframeId newest);

 private:
  KeyframeId until_{0}, waiting_{0};  // the second becomes the first after enough of the way
  double way_ = 0.0;
};

// What a frame leaves behind for the next one.
//
// The landmarks in view are off by the same in image after image. A filter from frame to frame, in which the pose of
// each is the prior of the next, counts their errors as new ones every time and comes to believe them. So the pose has
// odometry since the anchor for its prior, and one image. The covariance that such a filter would have is kept beside
// it: it is tight, and tells in the very image where odometry and view part.
struct LastFrame {
  KeyframeId reference;
  Rigid3 T_map_ref;  // as last seen, for when the reference has been culled
  Rigid3 T_ref_base;
  Rigid3 T_base_camera;
  Matrix6d covariance = Matrix6d::Zero();
  Matrix6d filtered_covariance = Matrix6d::Zero();
  std::optional<OdometryAnchor> anchor;
  ScaleAgreement agreement;
  std::optional<OdometryAnchor> wanted;  // the anchor as soon as the frame that wants to be is a keyframe
  std::vector<LandmarkId> landmarks;     // matched ones only
  std::optional<Rigid3> velocity;        // T_last_base of the frame before: constant-motion model without odometry
  bool tracked = false;                  // the pose is from vision
  int blind_frames = 0;                  // since the last one whose pose was
  bool given = false;                    // the pose goes back to one that was given, and no view has confirmed it

  Rigid3 ReferencePose(const Map& map) const;
  Rigid3 T_map_base(const Map& map) const { return ReferencePose(map) * T_ref_base; }
  // All that is relative to the reference is from now on relative to another keyframe.
  void ReferTo(KeyframeId other, const Rigid3& T_map_other, const Rigid3& T_other_reference);
};

class FrameTrack;

class Tracker {
 public:
  explicit Tracker(const TrackerContext& context) : context_(context), places_(context.options.min_inliers) {}

  // Starts from a frame whose pose and matches are known: the newest keyframe of a fresh map.
  void Start(const Map& map, KeyframeId keyframe);
  // Starts anywhere in a known map: frames are kLost until several in a row were recognised at one place of it.
  void StartUnlocalized();
  // Starts from a pose in a known map that somebody gives, with its covariance (of a right perturbation [translation,
  // rotation]; height and tilt may be zero). With odometry and scale frames are kOdometry from there until a view
  // confirms or corrects it, kLost without; until then none becomes a keyframe. A pose that no view agrees with is
  // given up after some blind frames: the robot is then looked for in the whole map. `map` has a keyframe.
  void StartAt(const Map& map, const Rigid3& T_map_base, const Matrix6d& covariance);
  bool localized() const { return last_.has_value(); }
  // Where the last frame is in the map as it is now; nothing while frames have no pose.
  std::optional<Rigid3> LastPose(const Map& map) const;
  // Where the search for the place of the last frame would put it, with too few inliers too.
  const std::vector<Placement>& seen_places() const { return places_.seen(); }
  // The map was scaled as a whole: relative motions of the camera scale with it.
  void OnMapScaled(const Map& map, double scale);
  // `map` has another image offset: the mounts shifted (image_moment.h) of the last frame, and of the keyframe that its
  // pose is relative to.
  void OnImageOffset(const Map& map, const Rigid3& reference_shift, const Rigid3& shift);
  // What the pose of the last frame is relative to; nothing while the robot is not localized.
  std::optional<KeyframeId> reference() const;
  // Tells that `keyframe` was made, T_keyframe_last (bases) ago: it becomes the reference.
  void OnKeyframe(const Map& map, KeyframeId keyframe, const Rigid3& T_keyframe_last);

  TrackResult Track(const TrackInput& input, const Map& map);

 private:
  bool FindFirstPose(const Map& map, FrameTrack* frame);
  bool WantsKeyframe(const TrackInput& input, const Map& map, const TrackResult& result) const;
  // The pose becomes relative to this keyframe; no motion leads to it from the frame before.
  void Anchor(const Map& map, KeyframeId reference, const Rigid3& T_map_base);
  // The keyframe that sees most of what this frame sees becomes the reference.
  void Adopt(const Map& map, const TrackResult& result);
  // `anchored`: odometry still goes back to the anchor.
  void Remember(const TrackInput& input, const Map& map, const FrameTrack& frame, bool anchored, TrackResult* result);
  void RememberOdometry(const TrackInput& input, bool anchored, bool wants_keyframe);

  TrackerContext context_;
  std::optional<LastFrame> last_;  // since the robot is localized
  PlaceSearch places_;
  FloorMonitor floor_;
  int frames_since_keyframe_ = 0;
  int reference_landmarks_ = 0;  // tracked in the reference keyframe when it was made
};

}  // namespace planar_vslam
