#pragma once
// Several images, joined by odometry, against the landmarks of a map from one place on the floor. The robot stands on
// the floor and its camera on the robot, so three numbers, x, y and heading, place all of them at once.
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/localize/landmark_table.h"
#include "planar_vslam/recognition/place.h"

namespace planar_vslam {

// An image, and where it was taken from where the robot is now.
struct SightView {
  Rigid2 T_now_base;
  CameraView view;
};

// What the images show of the landmarks that they should show.
struct Agreement {
  int visible = 0, found = 0;

  double share() const { return visible == 0 ? 0.0 : static_cast<double>(found) / visible; }
};

// How far a landmark may lie off, px: what the place may be off moves keypoints of all octaves alike, and a keypoint is
// as much less exact as its octave's pixels are larger.
struct SightWindow {
  double by_place = 0.0, by_keypoint = 0.0;  // the latter at octave 0

  double At(double octave_scale) const { return by_place + by_keypoint * octave_scale; }
};

Agreement Compare(const LandmarkTable& table, const Rigid2& T_map_base, const std::vector<SightView>& views,
                  const SightWindow& window);

// The same for landmarks that are like nothing elsewhere in the map, and for those that look steady, which are found
// more often: another thing of the same kind shows the ones that are alike, and not the unique ones. Each landmark
// tells once, however many images it should be in: by the share of them that show it.
struct AgreementByKind {
  struct Count {
    double visible = 0.0, found = 0.0;

    void Add(double share) { visible += 1.0, found += share; }
  };
  Count unique, steady_unique, steady_alike;
};
AgreementByKind CompareByKind(const LandmarkTable& table, const Rigid2& T_map_base, const std::vector<SightView>& views,
                              const SightWindow& window);

// A place, with its covariance: of a right perturbation [x, y, angle].
struct SettledPlace {
  Rigid2 T_map_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  bool with_expected = false;  // what was expected is part of it
};

// The place near `guess`, within some 0.3 m and 5 degrees, where most landmarks lie best. The guess where too few are
// found. Each landmark counts once, however many images show it; one that lies wrong does so in all.
SettledPlace Settle(const LandmarkTable& table, const Rigid2& guess, const std::vector<SightView>& views);
// The same from where the robot is expected, which takes part with its covariance. The same landmarks are in view for
// some metres: `share` of these are the views, which tell as much of what all of them do.
SettledPlace SettleExpected(const LandmarkTable& table, const SettledPlace& expected,
                            const std::vector<SightView>& views, double share);

// The share of landmarks that the images would show by chance, around there: what is found from a place where the robot
// is turned by some degrees, and landmarks lie where they do not belong.
double ShareByChance(const LandmarkTable& table, const Rigid2& T_map_base, const std::vector<SightView>& views);

}  // namespace planar_vslam
