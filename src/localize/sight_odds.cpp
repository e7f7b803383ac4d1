#include "planar_vslam/localize/sight_odds.h"

#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kFoundThere = 1.0, kMissedThere = 6.0;
// What chance finds differs from place to place: as much as if it had been measured with so many landmarks. Chosen by
// looking at drives in maps of other rooms.
constexpr double kChanceSpread = 40.0;
constexpr double kChanceFound = 1.0, kChanceLooked = 50.0;  // before anything was looked for

// std::lgamma writes a global sign.
double LogGamma(double x) {
  int sign = 0;
  return lgamma_r(x, &sign);
}

double LogBeta(double a, double b) { return LogGamma(a) + LogGamma(b) - LogGamma(a + b); }

// The log of the beta-binomial probability, without the binomial coefficient.
double LogProbability(const Agreement& seen, double found, double missed) {
  return LogBeta(seen.found + found, seen.visible - seen.found + missed) - LogBeta(found, missed);
}

}  // namespace

double SightLogOdds(const Agreement& at_place, const Agreement& by_chance) {
  if (at_place.visible == 0) return 0.0;
  const double chance = (by_chance.found + kChanceFound) / (by_chance.visible + kChanceLooked);
  return LogProbability(at_place, kFoundThere, kMissedThere) -
         LogProbability(at_place, kChanceSpread * chance, kChanceSpread * (1.0 - chance));
}

}  // namespace planar_vslam
