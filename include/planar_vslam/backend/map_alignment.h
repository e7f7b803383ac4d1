#pragma once
// Where one map lies in another, by the places both hold (shared_places.h). Every place says
//   T_known_other = T_known_base T_other_base^-1,
// and on the floor one such transform has to explain several places, some way apart, and more than any other explains:
// buildings repeat themselves, and a wrong transform is worse than none. Maps drift, so places agree where one's
// transform leads to the other up to a share of the way between them.
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/backend/shared_places.h"
#include "planar_vslam/geometry/expected.h"

namespace planar_vslam {

struct MapAlignment {
  Rigid3 T_known_other;             // a turn about z, and a shift
  Eigen::Matrix3d covariance;       // of a right perturbation [x, y, angle], from how the places scatter
  std::vector<std::size_t> places;  // that agree, indices of what was given, ascending
  int apart = 0;                    // of them, those that stand for themselves: no two of one spot
};

// Distances and angles were chosen by looking at drives of five simulated worlds.
struct AlignmentLimits {
  static constexpr int kFewest = 3;      // places apart from each other; one more than chance puts in a row
  static constexpr double kApart = 0.5;  // m...
  static constexpr double kApartAngle = DegreesToRadians(20.0);  // ...or so much turned: another view
  static constexpr double kRivalShare = 0.6;  // of them, that another transform may explain; as PlaceLimits has it
  static constexpr double kOffset = 0.2;      // m, that two places of one transform may differ...
  static constexpr double kDrift = 0.03;      // ...and of the way between them
  static constexpr double kAngle = DegreesToRadians(4.0);
};

// Error: how many places agree, and why that is too few.
Expected<MapAlignment> Align(const std::vector<SharedPlace>& places);

// Most of those that should be seen are, and most sweeps agree. Otherwise what speaks against the alignment.
std::optional<std::string> Contradiction(const std::vector<PlaceTest>& tests);

}  // namespace planar_vslam
