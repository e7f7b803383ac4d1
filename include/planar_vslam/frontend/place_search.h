#pragma once
// Where a frame was taken, without trusting the pose of the one before: at the start in a known map, after a slip while
// blind, after the robot was kidnapped. Keyframes that may show the same are tried by descriptors and PnP (place.h).
#include <optional>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/recognition/place.h"
#include "planar_vslam/recognition/place_index.h"

namespace planar_vslam {

// What is known beforehand of the place a frame was taken at.
struct PlaceExpectation {
  std::optional<Rigid3> T_map_base;  // about there; nothing: anywhere in the map
  std::optional<Rigid3> T_last_now;  // m, odometry since the frame before; nothing without odometry or scale
};

class PlaceSearch {
 public:
  // `min_inliers` make a pose.
  explicit PlaceSearch(int min_inliers) : min_inliers_(min_inliers) {}

  // The first pose that the keyframes which look most like the view give.
  std::optional<Placement> FindAnywhere(const Map& map, const CameraView& view);
  // A pose that several frames in a row have agreed on, this one the last of them: through odometry or, without it, by
  // being near each other. A view that two places explain about equally well is believed at neither.
  std::optional<Placement> FindConfirmed(const Map& map, const CameraView& view, const PlaceExpectation& expected);
  // The robot is found: the next search begins anew.
  void Forget() { hypothesis_.reset(); }
  // Where the last search would put the view, with too few inliers too: evidence for who gathers it while driving.
  const std::vector<Placement>& seen() const { return seen_; }
  void ForgetSeen() { seen_.clear(); }

 private:
  struct Hypothesis {
    Rigid3 T_map_base;
    int confirmations = 0;  // frames in a row
  };

  std::vector<KeyframeId> Resembling(const Map& map, const CameraView& view);
  std::vector<KeyframeId> Candidates(const Map& map, const CameraView& view, const PlaceExpectation& expected,
                                     const std::optional<Hypothesis>& previous);
  // The candidate with the most inliers, unless it has a rival.
  std::optional<Placement> Best(const Map& map, const CameraView& view, const std::vector<KeyframeId>& candidates);

  int min_inliers_;
  PlaceIndex index_;  // brought up to date when it is needed
  std::optional<Hypothesis> hypothesis_;
  std::vector<Placement> seen_;
};

}  // namespace planar_vslam
