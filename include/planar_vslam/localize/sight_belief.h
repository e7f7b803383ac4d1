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
// comes near, at three places, while it leads wherever odometry goes from the first. A part of the room that was not
// mapped may have things of the same kind: so the landmarks that are like nothing else in the map have to tell by
// themselves. And a far wall tells the heading only together with where the robot is along it: the place has to be
// known to some decimetres.
//
// Where odometry says where the robot is expected, its covariance P makes the odds of a place there, d off, less by
// d^T (P + Sigma)^-1 d / 2  and by the log of how many places the covariance covers. Where P is no larger than a place,
// a new view confirms or corrects it as soon as it speaks for it. Where P is larger, or the place is as far beyond the
// 99.9 % ellipse as wheels slip, places have to agree as if the robot were lost. Farther away a place has to show what
// nothing but the place itself shows.
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/localize/floor_votes.h"
#include "planar_vslam/localize/look_alikes.h"

namespace planar_vslam {

struct SightedPlace : SettledPlace {
  Agreement agreement;
  double log_odds = 0.0;
};

class SightBelief {
 public:
  explicit SightBelief(std::shared_ptr<SightMap> map) : map_(std::move(map)) {}

  // The robot moved.
  void Move(const Rigid2& T_before_now);
  // Whether a view would be evidence, after the robot has moved so far since the last one.
  static bool IsNewPlace(const Rigid2& moved);
  // A view from here; places that somebody else suggests are weighed, too. `expected`: where the robot is by odometry
  // from a pose that was known; nothing where it may be anywhere.
  void AddView(const CameraView& view, const std::vector<Rigid2>& suggested,
               const std::optional<SettledPlace>& expected);

  // Best first.
  const std::vector<SightedPlace>& places() const { return places_; }
  // The place that is believed, if one is. Its covariance is that of what the views since the last one that was say by
  // themselves: views that have told before do not tell again.
  const std::optional<SightedPlace>& Believed() const { return believed_; }

 private:
  std::vector<Rigid2> Candidates(const std::vector<Rigid2>& suggested) const;
  SightedPlace Weigh(const SettledPlace& settled, const std::vector<SightView>& views) const;
  void WeighExpected();
  // d^T (P + Sigma)^-1 d; nothing where the robot may be anywhere.
  std::optional<double> OffExpected(const SightedPlace& place) const;
  bool IsExpected(const SightedPlace& place) const;
  // Log odds that it takes to believe in a place.
  double Enough(const SightedPlace& place) const;
  // Whether odometry says where it is, to within a place.
  bool IsTracked() const;
  // Whether it is there if the wheels have slipped, and not if they have not.
  bool HasSlippedTo(const SightedPlace& place) const;
  bool IsNearby(const SightedPlace& place) const { return IsExpected(place) || HasSlippedTo(place); }
  // P, if the wheels have slipped, and d^T (P + Sigma)^-1 d with it.
  Eigen::Matrix3d WithSlip() const;
  double OffIfSlipped(const SightedPlace& place) const;
  // Whether it is the one place the views speak for, as far as they were looked at.
  bool StandsOut(const SightedPlace& best) const;
  // Where it may be, or is not expected: whether the views tell where it is in all directions...
  bool IsPlaced(const SightedPlace& best) const;
  // ...and that it is not at another thing of the same kind. `as_mapped`: the map has looked from there, too.
  bool IsItself(const SightedPlace& best, bool as_mapped) const;
  void Count();

  std::shared_ptr<SightMap> map_;
  std::vector<SightView> views_;
  std::vector<std::vector<LikelyMatch>> matches_;  // of each view
  std::vector<SightedPlace> places_;               // best first
  std::optional<SettledPlace> expected_;           // at the last view
  std::optional<Rigid2> leader_;                   // at the last view, that has stood out
  int stood_out_ = 0;                              // views at which it did while it led
  std::optional<SightedPlace> believed_;
};

}  // namespace planar_vslam
