#pragma once
// The limits of recognising a place. Tracker (a robot that does not know where it is) and loop finder (a map that does
// not know that it is back) ask the same thing and share them; where the two differ, both numbers stand here with the
// reason. None follows from theory unless it says so: they were chosen on the drives of BENCHMARK.md.
#include <cstddef>

#include "planar_vslam/geometry/angles.h"

namespace planar_vslam {

struct PlaceLimits {
  // Which keyframes are tried.
  static constexpr double kReach = 3.0;                                 // m between cameras that may see the same
  static constexpr double kReachAngle = DegreesToRadians(45.0);         // loops: the map's uncertainty comes on top
  static constexpr double kTrackerReachAngle = DegreesToRadians(60.0);  // tracker: nothing comes on top
  static constexpr std::size_t kTried = 3;                              // where the place is roughly known
  static constexpr std::size_t kTriedAnywhere = 8;  // of the whole map, where the best may look alike
  static constexpr int kLikeDistance = 50;  // bits between descriptors of one point, as between images of one place

  // PnP against the landmarks of one keyframe.
  static constexpr double kPnpRatio = 0.75;  // nearest descriptor to second nearest, stricter than with a known pose
  static constexpr int kPnpMatches = 15;     // some more than have to agree
  static constexpr double kPnpError = 4.0;   // px
  static constexpr int kPnpIterations =
      100;  // samples of five: 95 % find a right one where half of the matches are right
  static constexpr double kPnpConfidence = 0.99;
  static constexpr int kMinInliers = 12;  // that fix a pose; tracker.min_inliers_odometry is the same number

  // Landmarks of the place projected into the view.
  static constexpr double kGuessWindow = 10.0;        // px, around a guess: error of PnP from few matches
  static constexpr double kFinalWindow = 4.0;         // px, around the adjusted pose, as tracker.map_search_radius
  static constexpr std::size_t kPlaceKeyframes = 20;  // whose landmarks make up a place, as tracker.local_keyframes

  // What is believed. Buildings repeat themselves.
  static constexpr double kLeastShare = 0.3;  // of the landmarks that should be in view; default of loop.min_share
  static constexpr double kRivalShare = 0.6;  // of the best one's inliers: another place with more makes both doubtful
  static constexpr int kViewsInARow = 3;      // have to agree on the place...
  static constexpr double kAgreeDistance = 0.10;                       // m, ...with each other through odometry or map
  static constexpr double kAgreeAngle = DegreesToRadians(2.0);         // loops: between adjusted keyframes
  static constexpr double kTrackerAgreeAngle = DegreesToRadians(3.0);  // tracker: between frames, PnP's inliers only
};

}  // namespace planar_vslam
