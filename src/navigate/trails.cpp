#include "planar_vslam/navigate/trails.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace planar_vslam {
namespace {

constexpr double kStepPeriod = 0.2;     // s between two steps that are kept
constexpr double kGap = 1.0;            // s out of sight: what was walked meanwhile is not known
constexpr double kLongAgo = 1.0;        // s: steps since then are those that are being made
constexpr double kBeside = 0.4;         // m from an old step,
constexpr double kUnlike = 0.5;         // m/s and of another velocity: not the same way
constexpr double kForgetsOffset = 2.0;  // s, until what somebody is beside the old way is down to 1 / e
constexpr double kBody = 0.2;           // m: people pass obstacles so closely

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
