#pragma once
// The people around the robot: seen by the laser, followed, and foreseen.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/navigate/foresight.h"
#include "planar_vslam/navigate/people_tracks.h"
#include "planar_vslam/navigate/trails.h"

namespace planar_vslam {

class PeopleWatch {
 public:
  explicit PeopleWatch(const NavigateOptions& options) : options_(options) {}

  // A sweep at `T_map_laser` with the stamp `time` (s). The beams that end at somebody who walks, in order.
  std::vector<std::size_t> AddSweep(double time, const PlanarScan& scan, const Rigid2& T_map_laser,
                                    const Costmap& costmap);
  // The pose in the map jumped, or the map is another one: nothing is where it was.
  void Forget();

  // From `time` (s) on, so many `seconds`. Empty where nobody walks.
  Foresight ForeseeFrom(double time, double seconds, const Costmap& costmap) const;
  // Whether somebody walked so close to a place (map, m) that the robot would be in the way there.
  bool IsWalked(const Eigen::Vector2d& p_map) const;
  // What a cell of the costmap costs more, in its own lengths, for people who walk through it; empty where nobody does.
  std::vector<float> CostOfWays(double time, const Costmap& costmap) const;
  const std::vector<Track>& tracks() const { return tracks_; }

 private:
  double Reach() const;  // m
  void FindRhythms(double time);
  // Who comes into sight again when and where somebody in a rhythm is expected is the same one.
  void RecogniseThem();
  Motion ExpectedAt(const Track& track, double time, const Costmap& costmap) const;
  // Of a track in a rhythm: `count` places from `time` (s) on; empty where it has none.
  std::vector<Eigen::Vector2d> InRhythm(const Track& track, double time, int count) const;
  void Stamp(const Costmap& costmap, const Eigen::Vector2d& place, std::vector<float>* cost) const;

  NavigateOptions options_;
  RecentSpace recent_;
  std::vector<Track> tracks_;
  std::vector<Trail> trails_;
  std::vector<Rhythm> rhythms_;  // of those who have one
  double listened_ = -1.0;       // s, when they were looked for
  int next_id_ = 0;
};

}  // namespace planar_vslam
