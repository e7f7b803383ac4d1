#pragma once
// People who walk, from the laser: clusters of returns where it was free a moment ago, followed from sweep to sweep.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/navigate/costmap.h"
#include "planar_vslam/navigate/recent_space.h"

namespace planar_vslam {

// Something of a person's size that is where nothing was.
struct Sighting {
  Eigen::Vector2d position;        // map, m, of the body's middle
  std::vector<std::size_t> beams;  // of the sweep
};

// In a sweep of the laser at `T_map_laser`. Returns beside the map's own obstacles do not count, nor those in places
// that were not seen free before, but for those at `walkers`: where people who walk are expected, who may come back to
// where they just were. Nothing where so much moves at once that it is the pose in the map that moved.
std::vector<Sighting> FindSightings(const PlanarScan& scan, const Rigid2& T_map_laser, const Costmap& costmap,
                                    const RecentSpace& recent, const std::vector<Eigen::Vector2d>& walkers = {});

struct Motion {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // map, m
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // m/s
};

struct Track {
  int id = 0;
  Motion now;         // at `time`
  double time = 0.0;  // s, of the last sweep
  double seen = 0.0;  // s, of the last sighting
  int sightings = 0;
  Eigen::Vector2d born = Eigen::Vector2d::Zero();  // map, m, of the first sighting
  double missed = 0.0;                             // s for which the laser saw through where it should be
  bool walks = false;                              // it came far enough to be somebody who walks
};

// Tracks at the stamp of a sweep, `time` (s). `expected` are the motions of `tracks` by then, one each: by what is
// known of their ways. Tracks that are not seen stay at the expected place, until the laser sees through it or until
// they were out of sight for too long. `next_id` goes up with each new track.
struct TrackUpdate {
  std::vector<Track> tracks;
  std::vector<std::size_t> beams;  // of sightings of those who walk
};
TrackUpdate UpdateTracks(const std::vector<Track>& tracks, const std::vector<Motion>& expected, double time,
                         const std::vector<Sighting>& sightings, const PlanarScan& scan, const Rigid2& T_map_laser,
                         int* next_id);

}  // namespace planar_vslam
