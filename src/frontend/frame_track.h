#pragma once
// One frame on its way to a pose, for the time of one Tracker::Track: what is predicted of it, and the ways to find
// landmarks of the map from there. Each way leaves pose and matches behind for the next and for result(), and says
// whether they are enough.
#include <optional>

#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/geometry/stopwatch.h"
#include "planar_vslam/planar/floor_monitor.h"
#include "planar_vslam/recognition/place.h"

namespace planar_vslam {

// Keyframes that have seen a landmark which counts as confirmed: one more than it takes to place it.
inline constexpr std::size_t kConfirmed = 3;

struct PosePrediction {
  Rigid3 T_map_base;
  Matrix6d covariance = Matrix6d::Zero();
  bool from_odometry = false;
};

class FrameTrack {
 public:
  // `last` is null where no frame had a pose yet; all must outlive it but `last`, which is read by the constructor and
  // FollowLastFrame only.
  FrameTrack(const TrackerContext& context, const TrackInput& input, const Map& map, const LastFrame* last,
             bool on_floor);

  // Odometry's or, without it or scale, that of the motion so far.
  const PosePrediction& prediction() const { return prediction_; }
  const CameraView& view() const { return view_; }
  std::optional<Rigid3> OdometryStep() const;

  // Whether the laser tells the pose by itself. What the camera says otherwise stands on something that was moved.
  bool IsFixed() const { return input_.fix.has_value() && input_.fix->complete; }

  // Landmarks of the last frame around the prediction; then, at the foot of a ramp, higher or lower in the image; then,
  // after a large slip, around where the motion so far leads.
  bool FollowLastFrame();
  // The map around odometry's prediction, window by its covariance, where vision agrees with it.
  bool SearchAroundPrediction();
  // A pose that vision found by itself: odometry takes no part from here on.
  bool Take(std::optional<Placement> placement);
  // From a first pose: more of the map around it, all adjusted together.
  bool TrackLocalMap();
  // The pose found, solved once more with odometry since `anchor` for its prior in place of the frame before. It stays
  // as it was where odometry has no part in it or contradicts it over that way: wheels that slip a little in each image
  // stay below what a single one can tell. So do landmarks that are too near: then the pose is one to doubt.
  enum class Settled { kFromAnchor, kByItself, kDoubtful };
  Settled SettleFrom(const OdometryAnchor& anchor, const Rigid3& T_map_ref);

  // Farther from the prediction than drift of odometry or map explains: the robot was kidnapped.
  bool IsJump() const;
  // Buildings repeat themselves: a far place that only looks alike shows little of what should be in view there.
  bool IsLookAlike() const;

  // "track.match", "track.pose" and what is added; times of one name add up.
  void AddTime(const char* stage, const Stopwatch& watch) { times_.push_back({stage, watch.Milliseconds()}); }
  const StageTimes& times() const { return times_; }

  // With the pose found, `status` and what is relative to a keyframe left open.
  TrackResult Found() const;
  // With the prediction, where nothing was found.
  TrackResult Predicted() const;
  // That of the pose found before it was settled, or of the prediction.
  const Matrix6d& FilteredCovariance(bool found) const;
  // The pose found, solved once more without the floor, against it. Nothing where no floor takes part in this map.
  std::optional<FloorReading> ReadFloorOf(const TrackResult& found) const;

 private:
  PosePrediction PredictWithoutOdometry() const;
  PosePrediction Predict(const Matrix6d& covariance) const;
  // With the fix, where there is one.
  PosePrediction Fixed(PosePrediction prediction) const;
  bool SearchLastFrame(const Rigid3& T_map_start);
  bool SearchTipped();
  // By how much the landmarks of the last frame stand lower in the image than predicted, px, where most agree on it.
  std::optional<double> FindDrop();
  // `candidates` among the keypoints, from the pose so far; added to the matches.
  void Match(const std::vector<LandmarkId>& candidates, const ProjectionSearchOptions& search);
  bool Optimize();
  // Whether the pose so far is more than odometry explains.
  bool ContradictsOdometry() const;
  // Whether well-separated parts of the image speak for the pose so far, and not one thing, which may have been moved.
  bool IsSpread() const;
  // Whether the step to it is too short to be believed against the wheels.
  bool SaysThatItStands() const;
  // Whether landmarks speak for the pose so far that more than two keyframes have seen while all agreed.
  bool IsConfirmed() const;

  const TrackerContext& context_;
  const TrackInput& input_;
  const Map& map_;
  const LastFrame* last_;
  CameraView view_;
  PosePrediction prediction_;
  PosePrediction told_;       // the prediction with the covariance that was told of the last frame
  PosePrediction used_;       // what takes part in the pose
  bool tipped_ = false;       // ...and of it x, y and yaw only
  bool found_again_ = false;  // by a search for the place, which confirms itself
  TrackResult result_;
  std::optional<PoseOnlyResult> settled_;
  StageTimes times_;
};

}  // namespace planar_vslam
