#include "planar_vslam/backend/map_alignment.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

using Limits = AlignmentLimits;

// A place with the floor's part of what it says.
struct Vote {
  Rigid2 T_known_base, T_other_base;
  double rise = 0.0;  // m, height in the known map beyond that in the other
};

// Whether the transform of one place leads to the other.
bool Agree(const Vote& a, const Vote& b) {
  const Rigid2 T_a_b = a.T_other_base.Inverse() * b.T_other_base;
  const Rigid2 off = (a.T_known_base * T_a_b).Inverse() * b.T_known_base;
  const double tolerance = Limits::kOffset + Limits::kDrift * T_a_b.translation.norm();
  return off.translation.norm() < tolerance && std::abs(off.angle) < Limits::kAngle &&
         std::abs(a.rise - b.rise) < tolerance;
}

bool AreApart(const Vote& a, const Vote& b) {
  const Rigid2 way = a.T_other_base.Inverse() * b.T_other_base;
  return way.translation.norm() > Limits::kApart || std::abs(way.angle) > Limits::kApartAngle;
}

// How many of `chosen` are no two of one spot.
int CountApart(const std::vector<Vote>& votes, const std::vector<std::size_t>& chosen) {
  std::vector<std::size_t> counted;
  for (const std::size_t k : chosen) {
    const bool apart = std::all_of(counted.begin(), counted.end(),
                                   [&](std::size_t other) { return AreApart(votes[k], votes[other]); });
    if (apart) counted.push_back(k);
  }
  return static_cast<int>(counted.size());
}

struct Party {
  std::vector<std::size_t> members;
  int apart = 0;
};

// Those of `among` that the transform of some one of them explains: the most.
Party Largest(const std::vector<Vote>& votes, const std::vector<std::size_t>& among) {
  Party largest;
  for (const std::size_t k : among) {
    Party party;
    for (const std::size_t other : among) {
      if (Agree(votes[k], votes[other])) party.members.push_back(other);
    }
    party.apart = CountApart(votes, party.members);
    const bool larger =
        party.apart != largest.apart ? party.apart > largest.apart : party.members.size() > largest.members.size();
    if (larger) largest = std::move(party);
  }
  return largest;
}

// Least squares over [x, y, angle] at the votes' middle, of places good to 2 cm and 0.3 degrees; where they scatter
// more, so does the result.
void Fit(const std::vector<Vote>& votes, const Party& party, MapAlignment* alignment) {
  constexpr double kPosition = 0.02;  // m, how well a recognised view tells where it was taken
  constexpr double kAngle = DegreesToRadians(0.3);
  const Vote& first = votes[party.members.front()];
  Rigid2 T = first.T_known_base * first.T_other_base.Inverse();
  Eigen::Matrix3d H;
  double cost = 0.0, rise = 0.0;
  for (int iteration = 0; iteration < 5; ++iteration) {
    H.setZero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    cost = rise = 0.0;
    for (const std::size_t k : party.members) {
      // e = [p_known - T p_other, angle]: of a right perturbation d of T, de/dd = -[R, R J p_other; 0, 1]
      const Eigen::Vector2d p = votes[k].T_other_base.translation;
      Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
      J.topLeftCorner<2, 2>() = -T.R() / kPosition;
      J.topRightCorner<2, 1>() = -T.R() * Eigen::Vector2d(-p.y(), p.x()) / kPosition;
      J(2, 2) = -1.0 / kAngle;
      Eigen::Vector3d e;
      e.head<2>() = (votes[k].T_known_base.translation - T * p) / kPosition;
      e.z() = WrapAngle(votes[k].T_known_base.angle - T.angle - votes[k].T_other_base.angle) / kAngle;
      H += J.transpose() * J;
      g += J.transpose() * e;
      cost += e.squaredNorm();
      rise += votes[k].rise;
    }
    T = T * ExpSe2(-H.ldlt().solve(g));
  }
  const double scatter = cost / std::max(1.0, 3.0 * static_cast<double>(party.members.size()) - 3.0);
  // Places of one spot share their error.
  const double repeated = static_cast<double>(party.members.size()) / party.apart;
  alignment->covariance = std::max(1.0, scatter) * repeated * H.inverse();
  alignment->T_known_other = Embed3(T);
  alignment->T_known_other.translation.z() = rise / static_cast<double>(party.members.size());
}

std::string Count(int count) { return std::to_string(count) + (count == 1 ? " place" : " places"); }

}  // namespace

Expected<MapAlignment> Align(const std::vector<SharedPlace>& places) {
  std::vector<Vote> votes;
  std::vector<std::size_t> all;
  for (const SharedPlace& place : places) {
    all.push_back(votes.size());
    votes.push_back({ProjectToPlane(place.T_known_base), ProjectToPlane(place.T_other_base),
                     place.T_known_base.translation.z() - place.T_other_base.translation.z()});
  }
  const Party winner = Largest(votes, all);
  if (winner.apart < Limits::kFewest) {
    return Error{"expected maps that agree in " + Count(Limits::kFewest) + " at least, but of " +
                 Count(CountApart(votes, all)) + " recognised only " + Count(winner.apart) + " agree"};
  }
  std::vector<std::size_t> rest;
  std::set_difference(all.begin(), all.end(), winner.members.begin(), winner.members.end(), std::back_inserter(rest));
  const Party rival = Largest(votes, rest);
  if (rival.apart > Limits::kRivalShare * winner.apart) {
    return Error{Count(winner.apart) + " agree on where one map lies in the other, but " + Count(rival.apart) +
                 " on another way: places that look alike"};
  }
  MapAlignment alignment;
  alignment.places = winner.members;
  alignment.apart = winner.apart;
  Fit(votes, winner, &alignment);
  return alignment;
}

std::optional<std::string> Contradiction(const std::vector<PlaceTest>& tests) {
  // Chosen by looking at drives of five simulated worlds, as AlignmentLimits.
  constexpr int kFewest = 5;           // that tell
  constexpr double kSeenShare = 0.15;  // in another light, and with furniture moved, much is not recognised
  constexpr double kSweepShare = 0.6;  // walls stay
  int should_see = 0, see = 0, with_sweeps = 0, agree = 0;
  for (const PlaceTest& test : tests) {
    should_see += test.should_see ? 1 : 0;
    see += test.should_see && test.sees ? 1 : 0;
    with_sweeps += test.has_sweeps ? 1 : 0;
    agree += test.sweeps_agree ? 1 : 0;
  }
  const auto speaks_against = [](int count, int of, double share) { return of >= kFewest && count < share * of; };
  if (speaks_against(agree, with_sweeps, kSweepShare)) {
    return std::to_string(agree) + " of " + std::to_string(with_sweeps) +
           " laser sweeps agree where the maps would overlap: places that look alike";
  }
  if (speaks_against(see, should_see, kSeenShare)) {
    return std::to_string(see) + " of " + std::to_string(should_see) +
           " views show the other map where the maps would overlap: places that look alike";
  }
  return std::nullopt;
}

}  // namespace planar_vslam
