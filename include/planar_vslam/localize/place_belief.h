#pragma once
// Where a robot may be that does not know it: places of the map as hypotheses, carried along by odometry and weighed by
// what laser and camera see meanwhile. Log odds of a hypothesis against "a place the map does not know":
//   laser  the mean odds (likelihood_field.h) of all points seen over the last metres, times their number, over
//          kCorrelated: neighbouring points lie on one surface
//   sight  what views show of the landmarks that should be in view (sight_odds.h). Views of the same things repeat what
//          they tell: the mean of all views, times 1 + a fifth of their number beyond the first, a view each 0.2 m
// After every sweep the whole map is searched anew for the places that explain all sweeps of the last metres, so that
// no hypothesis has to survive from the beginning.
//
// One is believed when its odds exceed kBelieved against "unknown" and against every other place, twice in a row, after
// evidence from two places, or once where laser and camera both speak for it. Beforehand "unknown" is as likely as all
// places of the map together. How well another place of the map explains the same points tells how well chance does, in
// this map, with these points: a room that the map does not know has many places that fit equally badly.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/localize/likelihood_field.h"
#include "planar_vslam/localize/pose_search.h"

namespace planar_vslam {

struct PlaceHypothesis {
  Rigid2 T_map_base;
  double laser = 0.0;    // log odds by the laser
  double seen = 0.0;     // ...and by the camera: the sum over views...
  int views = 0;         // ...and their number
  double fit = 0.0;      // mean odds of a point
  double crossed = 0.0;  // share of beams that would have gone through a mapped surface

  double sight() const { return views == 0 ? 0.0 : seen * (kNewInView + (1.0 - kNewInView) / views); }
  double log_odds() const { return laser + sight(); }

  static constexpr double kNewInView = 0.2;  // of a view, 0.2 m after the last one: things stay in view for a metre
};

class PlaceBelief {
 public:
  // Believes nothing where `field` is null or empty. Where `elsewhere`, odometry says where the robot is: that it is
  // anywhere else is unlikely beforehand.
  explicit PlaceBelief(std::shared_ptr<const LikelihoodField> field, bool elsewhere = false)
      : field_(std::move(field)), elsewhere_(elsewhere) {}

  // The robot moved.
  void Move(const Rigid2& T_before_now);
  // A sweep taken where the base was at `T_now_base`. Returns whether it was taken at a new place: others count
  // nothing.
  bool AddSweep(const PlanarScan& scan, const Rigid3& T_base_laser, const Rigid2& T_now_base);
  // Whether a view from here would be evidence: the robot has moved since the last one.
  bool WantsView() const;
  // What the view from here says of the robot's being at these places: log odds. To be called where WantsView().
  struct SeenPlace {
    Rigid2 T_map_base;
    double log_odds = 0.0;
  };
  void AddView(const std::vector<SeenPlace>& seen);

  // Best first.
  const std::vector<PlaceHypothesis>& hypotheses() const { return hypotheses_; }
  // The place that is believed, if one is.
  std::optional<Rigid2> Believed() const;
  // Whether the laser has seen enough to believe or refute a place by.
  bool SeesEnough() const;
  // Whether the laser refutes that the robot is there. Never where it sees too little.
  bool Contradicts(const Rigid2& T_map_base) const;

 private:
  // A sweep, in the base as it is now.
  struct Seen {
    Rigid2 T_now_base;
    Eigen::Vector2d laser;  // in the base at the sweep
    std::vector<Eigen::Vector2d> points;
  };
  bool HasField() const { return field_ != nullptr && !field_->empty(); }
  void Search();
  void Rank();
  void WeighByLaser(PlaceHypothesis* hypothesis) const;
  double Crossed(const Rigid2& T_map_base) const;
  double PlacesOfMap() const;
  bool LeaderStandsOut() const;

  std::shared_ptr<const LikelihoodField> field_;
  bool elsewhere_;
  std::vector<Seen> sweeps_;
  std::vector<Eigen::Vector2d> points_;      // of all sweeps, in the base now, thinned
  std::optional<Rigid2> T_now_last_view_;    // nothing before the first
  std::vector<PlaceHypothesis> hypotheses_;  // best first
  std::optional<Rigid2> leader_;             // that stood out at the last evidence
  int stood_out_ = 0;                        // places in a row at which it did
  std::optional<Rigid2> T_now_counted_;      // the last of them
};

}  // namespace planar_vslam
