#pragma once
// Where a robot may be that does not know it and has no laser that tells: places of the map as hypotheses, carried
// along by odometry and weighed by the landmarks that the images of the last metres show.
//
// After each 0.2 m or 10 degrees votes (floor_votes.h) name places, all are laid where most landmarks lie best, and
// weighed: with F of V landmarks found, p = F / V and q the share that chance finds,
//   log odds against "a place the map does not know" = F log(p / q) + (V - F) log((1 - p) / (1 - q)),   p > q.
// Chance is the largest of what is usual (kByChance), of what is found from a place where the robot is turned, and of
// what the map itself shows at another place of what it saw here: rows of benches, look-alike aisles.
//
// One place is believed when its odds exceed those of all places of the map against "unknown", and when no other place
// comes near, three times, at three places, each where odometry leads from the other. Where odometry says where the
// robot is expected, places near there need less, and others show what nothing but the place itself shows.
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/localize/floor_votes.h"

namespace planar_vslam {

struct SightedPlace {
  Rigid2 T_map_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // of a right perturbation [x, y, angle]
  Agreement agreement;
  double log_odds = 0.0;
};

class SightBelief {
 public:
  // `expected`: where the robot is by odometry from a pose that was known; nothing where it may be anywhere.
  SightBelief(std::shared_ptr<const LandmarkTable> table, const std::optional<Rigid2>& expected)
      : table_(std::move(table)), expected_(expected) {}

  // The robot moved.
  void Move(const Rigid2& T_before_now);
  // Whether a view from here would be evidence: the robot has moved since the last one.
  bool WantsView() const;
  // A view from here, of `map`, which the table is of; places that somebody else suggests are weighed, too.
  void AddView(const CameraView& view, const Map& map, const std::vector<Rigid2>& suggested);

  // Best first.
  const std::vector<SightedPlace>& places() const { return places_; }
  // The place that is believed, if one is.
  const std::optional<SightedPlace>& Believed() const { return believed_; }
  // The robot is taken to be there from now on.
  void Expect(const Rigid2& T_map_base) { expected_ = T_map_base; }

 private:
  std::vector<Rigid2> Candidates(const std::vector<Rigid2>& suggested) const;
  SightedPlace Weigh(const Rigid2& guess, const std::vector<SightView>& views) const;
  bool IsExpected(const Rigid2& T_map_base) const;
  // Whether it is the one place the views speak for, as far as they were looked at.
  bool StandsOut(const SightedPlace& best, const Map& map) const;
  void Count(const Map& map);

  std::shared_ptr<const LandmarkTable> table_;
  std::vector<SightView> views_;
  std::vector<std::vector<LikelyMatch>> matches_;  // of each view
  std::vector<SightedPlace> places_;               // best first
  std::optional<Rigid2> expected_;
  std::optional<Rigid2> leader_;  // that stood out at the last view
  int stood_out_ = 0;             // views in a row at which it did
  std::optional<SightedPlace> believed_;
};

// The largest share of what the map saw around `T_map_base` that it shows at another place, too. `views` say where it
// is asked.
double LookAlikeShare(const LandmarkTable& table, const Map& map, const Rigid2& T_map_base,
                      const std::vector<SightView>& views);

}  // namespace planar_vslam
