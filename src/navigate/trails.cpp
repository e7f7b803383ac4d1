#include "planar_vslam/navigate/trails.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace planar_vslam {
namespace {

constexpr double kStepPeriod = 0.2;     // s between two steps that are kept
constexpr double kGap = 1.0;            // s out of sight: what was walked meanwhile is not known
constexpr double kLongAgo = 1.0;        // s: steps since then are those that are being made
constexpr double kBeside = 0.4;         // m from an old step,
constexpr double kUnlike = 0.5;         // m/s and of another velocity: not the same way
constexpr double kForgetsOffset = 2.0;  // s, until what somebody is beside the old way is down to 1 / e
// Of people who walk to and fro.
constexpr double kShortestPeriod = 3.0, kLongestPeriod = 30.0, kPeriodStep = 0.1;  // s
constexpr double kRecent = 25.0;                                                   // s whose steps are compared
constexpr double kCompared = 0.6;                                                  // of a period, at least
constexpr double kUnsteady = 0.25;  // m between places of two passes: not the same way in the same time
constexpr int kPasses = 3;          // that are averaged
constexpr double kBody = 0.2;       // m: people pass obstacles so closely

// A place on an old way: between steps[index] and the next one.
struct Place {
  const Trail* trail = nullptr;
  std::size_t index = 0;
  double share = 0.0;
};

Footstep Between(const Footstep& a, const Footstep& b, double share) {
  return {a.time + share * (b.time - a.time),
          {a.motion.position + share * (b.motion.position - a.motion.position),
           a.motion.velocity + share * (b.motion.velocity - a.motion.velocity)}};
}

Footstep StepAt(const Place& place) {
  return Between(place.trail->steps[place.index], place.trail->steps[place.index + 1], place.share);
}

// How unlike a motion and an old step are: 0 the same, from 1 on another way.
double Unlikeness(const Motion& motion, const Motion& old) {
  return std::max((motion.position - old.position).norm() / kBeside, (motion.velocity - old.velocity).norm() / kUnlike);
}

// The old way that is most like the motion; where some are nearly as like, the newest.
std::optional<Place> FindPlace(const Motion& motion, double before, const std::vector<Trail>& trails) {
  std::optional<Place> best;
  double least = 1.0;
  for (const Trail& trail : trails) {
    for (std::size_t i = 0; i + 1 < trail.steps.size() && trail.steps[i + 1].time < before; ++i) {
      const Footstep &a = trail.steps[i], &b = trail.steps[i + 1];
      if (b.time - a.time > kGap || (a.motion.position - motion.position).norm() > 2.0 * kBeside) continue;
      const Eigen::Vector2d way = b.motion.position - a.motion.position;
      const double along = way.dot(motion.position - a.motion.position) / std::max(1e-9, way.squaredNorm());
      const Place place{&trail, i, std::clamp(along, 0.0, 1.0)};
      const double unlikeness = Unlikeness(motion, StepAt(place).motion);
      if (unlikeness >= least) continue;
      least = unlikeness;
      best = place;
    }
  }
  return best;
}

// `seconds` later on an old way, as far as it was seen.
std::optional<Footstep> Later(const Place& place, double seconds) {
  const std::vector<Footstep>& steps = place.trail->steps;
  const double time = StepAt(place).time + seconds;
  std::size_t i = place.index;
  while (i + 1 < steps.size() && steps[i + 1].time < time) {
    if (steps[i + 1].time - steps[i].time > kGap) return std::nullopt;
    ++i;
  }
  if (i + 1 >= steps.size() || steps[i + 1].time - steps[i].time > kGap) return std::nullopt;
  return Between(steps[i], steps[i + 1], (time - steps[i].time) / (steps[i + 1].time - steps[i].time));
}

// At a time (s); none where it was not seen.
std::optional<Eigen::Vector2d> PlaceAt(const Trail& trail, double time) {
  const auto later = std::lower_bound(trail.steps.begin(), trail.steps.end(), time,
                                      [](const Footstep& step, double t) { return step.time < t; });
  if (later == trail.steps.begin() || later == trail.steps.end()) return std::nullopt;
  const Footstep &a = *std::prev(later), &b = *later;
  if (b.time - a.time > kGap) return std::nullopt;
  return Between(a, b, (time - a.time) / (b.time - a.time)).motion.position;
}

// Root mean square distance (m) of the last steps from where the walker was `period` (s) before; infinity where too few
// of them were seen both times.
double Unsteadiness(const Trail& trail, double period) {
  const double now = trail.steps.back().time, first = std::max(trail.steps.front().time + period, now - kRecent);
  if (now - first < kCompared * period) return std::numeric_limits<double>::infinity();
  double sum = 0.0;
  int count = 0, steps = 0;
  for (auto step = trail.steps.rbegin(); step != trail.steps.rend() && step->time >= first; ++step) {
    const std::optional<Eigen::Vector2d> before = PlaceAt(trail, step->time - period);
    ++steps;
    if (!before.has_value()) continue;
    sum += (*before - step->motion.position).squaredNorm();
    ++count;
  }
  const bool enough = count >= 20 && 2 * count >= steps;
  return enough ? std::sqrt(sum / count) : std::numeric_limits<double>::infinity();
}

Motion StraightOn(const Motion& motion, const Costmap& costmap, double period) {
  Motion next{motion.position + period * motion.velocity, motion.velocity};
  const bool leaves_free_space =
      costmap.DistanceToMap(next.position) < kBody && costmap.DistanceToMap(motion.position) >= kBody;
  return leaves_free_space ? Motion{motion.position - period * motion.velocity, -motion.velocity} : next;
}

}  // namespace

std::vector<Trail> ExtendTrails(std::vector<Trail> trails, const std::vector<Track>& tracks, double time,
                                double lifetime) {
  for (const Track& track : tracks) {
    if (!track.walks || track.seen < time) continue;
    auto trail = std::find_if(trails.begin(), trails.end(), [&](const Trail& t) { return t.walker == track.id; });
    if (trail == trails.end()) trail = trails.insert(trails.end(), Trail{track.id, {}});
    if (!trail->steps.empty() && time - trail->steps.back().time < 0.9 * kStepPeriod) continue;
    trail->steps.push_back({time, track.now});
  }
  for (Trail& trail : trails) {
    const auto kept = std::find_if(trail.steps.begin(), trail.steps.end(),
                                   [&](const Footstep& step) { return step.time >= time - lifetime; });
    trail.steps.erase(trail.steps.begin(), kept);
  }
  trails.erase(std::remove_if(trails.begin(), trails.end(), [](const Trail& t) { return t.steps.empty(); }),
               trails.end());
  return trails;
}

std::optional<Rhythm> RhythmOf(const Trail& trail) {
  if (trail.steps.empty()) return std::nullopt;
  double best = kUnsteady, period = 0.0;
  for (double tried = kShortestPeriod; tried <= kLongestPeriod; tried += kPeriodStep) {
    // Twice the time is as steady: the shorter one counts.
    const double unsteadiness = Unsteadiness(trail, tried);
    if (unsteadiness >= best || (period > 0.0 && tried > 1.5 * period)) continue;
    best = unsteadiness;
    period = tried;
  }
  if (period <= 0.0) return std::nullopt;
  for (double step = 0.5 * kPeriodStep; step > kPeriodStep / 10.0; step *= 0.5) {
    const double shorter = Unsteadiness(trail, period - step), longer = Unsteadiness(trail, period + step);
    if (std::min(shorter, longer) < best) period += shorter < longer ? -step : step;
    best = std::min({best, shorter, longer});
  }
  return Rhythm{trail.walker, period};
}

std::optional<Eigen::Vector2d> PlaceInRhythm(const Trail& trail, const Rhythm& rhythm, double time) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  const double last = trail.steps.back().time, passed = std::ceil((time - last) / rhythm.period);
  for (double before = time - std::max(1.0, passed) * rhythm.period;
       before > trail.steps.front().time && count < kPasses; before -= rhythm.period) {
    const std::optional<Eigen::Vector2d> place = PlaceAt(trail, before);
    if (!place.has_value()) continue;
    sum += *place;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

std::vector<Motion> ForeseeWay(const Motion& now, double time, const std::vector<Trail>& trails, const Costmap& costmap,
                               double period, int count) {
  std::vector<Motion> way;
  Motion motion = now;
  std::optional<Place> place;
  Motion from, taken;  // where the old way was taken up, by that motion
  double since = 0.0;
  while (static_cast<int>(way.size()) < count) {
    since += period;
    std::optional<Footstep> step = place.has_value() ? Later(*place, since) : std::nullopt;
    if (!step.has_value()) {
      place = FindPlace(motion, time - kLongAgo, trails);
      if (place.has_value()) {
        from = StepAt(*place).motion;
        taken = motion;
        since = period;
        step = Later(*place, since);
      }
    }
    if (step.has_value()) {
      const double kept = std::exp(-since / kForgetsOffset);
      motion = {step->motion.position + kept * (taken.position - from.position),
                step->motion.velocity + kept * (taken.velocity - from.velocity)};
    } else {
      motion = StraightOn(motion, costmap, period);
    }
    way.push_back(motion);
  }
  return way;
}

}  // namespace planar_vslam
