#pragma once
// Where people walked, and where they will: who is where somebody walked before goes on as they did then, turns back
// where they turned back. Who is elsewhere goes straight on, and back where an obstacle of the map is in the way.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "planar_vslam/navigate/costmap.h"
#include "planar_vslam/navigate/people_tracks.h"

namespace planar_vslam {

struct Footstep {
  double time = 0.0;  // s
  Motion motion;
};
// One person's steps, in the order of time.
struct Trail {
  int walker = 0;  // the track's id
  std::vector<Footstep> steps;
};

// Trails with the places of those who walk and are seen now; steps older than `lifetime` (s) before `time` are
// forgotten.
std::vector<Trail> ExtendTrails(std::vector<Trail> trails, const std::vector<Track>& tracks, double time,
                                double lifetime);

// Somebody who walks to and fro in a steady time is where they were that time before.
struct Rhythm {
  int walker = 0;       // the track's id
  double period = 0.0;  // s, from a turn to the same one again
};
// Of the walker of a trail, by its last half minute; none: the time is not steady, or was not seen for long enough.
std::optional<Rhythm> RhythmOf(const Trail& trail);
// Where the walker of a trail is at `time` (s), after its last step; none: it was never seen that far on the way.
std::optional<Eigen::Vector2d> PlaceInRhythm(const Trail& trail, const Rhythm& rhythm, double time);

// Where somebody at `now` will be: `count` places, one every `period` (s), the first one after one period. `time` (s)
// is now's.
std::vector<Motion> ForeseeWay(const Motion& now, double time, const std::vector<Trail>& trails, const Costmap& costmap,
                               double period, int count);

}  // namespace planar_vslam
