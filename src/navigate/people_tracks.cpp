#include "planar_vslam/navigate/people_tracks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

constexpr double kFarthest = 8.0;   // m: beyond, a leg is two returns
constexpr double kLeg = 0.7;        // m: what is longer is no part of a body at a laser's height
constexpr double kHalfALeg = 0.06;  // m from what the laser sees of one to its middle
constexpr double kStride = 0.6;     // m from one leg to the other
constexpr double kOfABody = 0.35;   // m from somebody's middle to a leg of theirs
constexpr double kPerson = 1.0;     // m: what is longer is no person
// From the map's obstacles, for noise of the pose: m, and a metre of range more, which is its heading.
constexpr double kBesideTheMap = 0.1, kBesideFarAway = 0.025;
constexpr double kAllMoves = 0.15;  // share of all beams: so much moves when it is the pose that does

// Following, by a filter of fixed gains once it has seen enough (Bar-Shalom, Li and Kirubarajan, 2001, section 6.5):
// for 0.07 m of noise, which is legs that cover each other, and 0.8 m/s^2. Before that, the gains of a line through
// all.
constexpr double kGain = 0.4, kSpeedGain = 0.09;
constexpr double kGate = 0.5, kGateNew = 0.35;              // m
constexpr double kGateGrows = 0.4, kWidestGate = 2.0;       // m/s of being out of sight, m
constexpr double kWalked = 0.35, kSlowest = 0.25;           // m from where it was seen first, m/s
constexpr int kEnough = 5;                                  // sightings
constexpr double kLongestMissed = 0.6;                      // s: the laser sees that nobody is there
constexpr double kOutOfSight = 8.0, kNewOutOfSight = 0.15;  // s

struct Part {
  Eigen::Vector2d centre;  // map, m
  std::vector<std::size_t> beams;
};

struct Returns {
  std::vector<Part> parts;                  // that move
  std::size_t unexplained = 0, moving = 0;  // returns
};

class PartFinder {
 public:
  PartFinder(const PlanarScan& scan, const Rigid2& T_map_laser, const Costmap& costmap, const RecentSpace& recent,
             const std::vector<Eigen::Vector2d>& walkers)
      : scan_(scan), T_map_laser_(T_map_laser), costmap_(costmap), recent_(recent), walkers_(walkers) {}

  Returns Find() {
    for (std::size_t i = 0; i < scan_.ranges.size(); ++i) {
      const double range = static_cast<double>(scan_.ranges[i]);
      if (!(range >= scan_.range_min && range < scan_.range_max && range <= kFarthest)) {
        Close();
        continue;
      }
      const double angle = scan_.angle_min + static_cast<double>(i) * scan_.angle_increment;
      const Eigen::Vector2d p = T_map_laser_ * (range * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
      if (costmap_.DistanceToMap(p) <= kBesideTheMap + kBesideFarAway * range) {
        Close();
        continue;
      }
      const double gap = 0.08 + 2.5 * range * scan_.angle_increment;  // m between returns of one thing
      if (!beams_.empty() && (p - points_.back()).norm() > gap) Close();
      points_.push_back(p);
      beams_.push_back(i);
    }
    Close();
    return std::move(returns_);
  }

 private:
  // Ends the thing whose returns were gathered.
  void Close() {
    if (!beams_.empty()) {
      const auto moving =
          std::count_if(points_.begin(), points_.end(), [&](const Eigen::Vector2d& p) { return recent_.WasFree(p); });
      returns_.unexplained += points_.size();
      returns_.moving += static_cast<std::size_t>(moving);
      const bool small = (points_.front() - points_.back()).norm() <= kLeg;
      const Part part = Gathered();
      const bool moves = 2 * static_cast<std::size_t>(moving) >= points_.size() || IsOfAWalker(part.centre);
      if (small && moves) returns_.parts.push_back(part);
    }
    points_.clear();
    beams_.clear();
  }

  bool IsOfAWalker(const Eigen::Vector2d& p_map) const {
    return std::any_of(walkers_.begin(), walkers_.end(),
                       [&p_map](const Eigen::Vector2d& walker) { return (walker - p_map).norm() <= kOfABody; });
  }

  Part Gathered() const {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : points_) mean += p / static_cast<double>(points_.size());
    return {mean + kHalfALeg * (mean - T_map_laser_.translation).normalized(), beams_};
  }

  const PlanarScan& scan_;
  const Rigid2& T_map_laser_;
  const Costmap& costmap_;
  const RecentSpace& recent_;
  const std::vector<Eigen::Vector2d>& walkers_;
  std::vector<Eigen::Vector2d> points_;
  std::vector<std::size_t> beams_;
  Returns returns_;
};

// Parts that hang together by strides.
std::vector<std::vector<Part>> GroupsOf(std::vector<Part> parts) {
  std::vector<std::vector<Part>> groups;
  while (!parts.empty()) {
    std::vector<Part> group{std::move(parts.back())};
    parts.pop_back();
    for (std::size_t i = 0; i < group.size(); ++i) {
      const Eigen::Vector2d from = group[i].centre;
      const auto near = [&from](const Part& part) { return (part.centre - from).norm() <= kStride; };
      const auto end = std::stable_partition(parts.begin(), parts.end(), [&](const Part& p) { return !near(p); });
      group.insert(group.end(), std::make_move_iterator(end), std::make_move_iterator(parts.end()));
      parts.erase(end, parts.end());
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

double LengthOf(const std::vector<Part>& group) {
  double longest = 0.0;
  for (const Part& a : group) {
    for (const Part& b : group) longest = std::max(longest, (a.centre - b.centre).norm());
  }
  return longest;
}

Sighting SightingOf(const std::vector<Part>& group) {
  Sighting sighting{Eigen::Vector2d::Zero(), {}};
  for (const Part& part : group) {
    sighting.position += part.centre / static_cast<double>(group.size());
    sighting.beams.insert(sighting.beams.end(), part.beams.begin(), part.beams.end());
  }
  return sighting;
}

// Whether the laser would have met a body there, and met what is behind.
bool SeesThrough(const PlanarScan& scan, const Rigid2& T_map_laser, const Eigen::Vector2d& p_map) {
  constexpr double kCore = 0.15, kBehind = 0.4;  // m, half of a body's width, and behind its middle
  const Eigen::Vector2d p = T_map_laser.Inverse() * p_map;
  const double distance = p.norm(), half = std::atan2(kCore, distance), bearing = std::atan2(p.y(), p.x());
  if (distance > kFarthest) return false;
  bool any = false;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    if (std::abs(WrapAngle(angle - bearing)) > half) continue;
    if (!(static_cast<double>(scan.ranges[i]) > distance + kBehind)) return false;
    any = true;
  }
  return any;
}

Track Followed(const Track& track, const Motion& expected, double time, const Eigen::Vector2d& seen_at) {
  Track next = track;
  const double n = next.sightings + 1.0, period = time - track.time;
  const double gain = std::max(kGain, 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)));
  const double speed_gain = std::max(kSpeedGain, 6.0 / (n * (n + 1.0)));
  const Eigen::Vector2d off = seen_at - expected.position;
  next.now.position = expected.position + std::min(1.0, gain) * off;
  next.now.velocity = expected.velocity;
  if (period > 0.0) next.now.velocity += std::min(1.0, speed_gain) / period * off;
  next.time = next.seen = time;
  next.missed = 0.0;
  ++next.sightings;
  next.walks = next.walks || (next.sightings >= kEnough && (next.now.position - next.born).norm() >= kWalked &&
                              next.now.velocity.norm() >= kSlowest);
  return next;
}

Track Unseen(const Track& track, const Motion& expected, double time, bool seen_through) {
  Track next = track;
  next.now = expected;
  next.time = time;
  if (seen_through) next.missed += time - track.time;
  return next;
}

bool IsKept(const Track& track) {
  const double unseen = track.time - track.seen;
  return track.walks ? track.missed <= kLongestMissed && unseen <= kOutOfSight : unseen <= kNewOutOfSight;
}

}  // namespace

std::vector<Sighting> FindSightings(const PlanarScan& scan, const Rigid2& T_map_laser, const Costmap& costmap,
                                    const RecentSpace& recent, const std::vector<Eigen::Vector2d>& walkers) {
  const Returns returns = PartFinder(scan, T_map_laser, costmap, recent, walkers).Find();
  const double share = static_cast<double>(returns.moving) / static_cast<double>(scan.ranges.size());
  if (share > kAllMoves) return {};
  std::vector<Sighting> sightings;
  for (const std::vector<Part>& group : GroupsOf(returns.parts)) {
    if (LengthOf(group) <= kPerson) sightings.push_back(SightingOf(group));
  }
  return sightings;
}

TrackUpdate UpdateTracks(const std::vector<Track>& tracks, const std::vector<Motion>& expected, double time,
                         const std::vector<Sighting>& sightings, const PlanarScan& scan, const Rigid2& T_map_laser,
                         int* next_id) {
  TrackUpdate update;
  std::vector<bool> taken(sightings.size(), false);
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    std::size_t best = sightings.size();
    // Who comes into sight again may have gone faster or slower meanwhile.
    const double unseen = time - tracks[t].seen;
    double best_distance = tracks[t].walks ? std::min(kWidestGate, kGate + kGateGrows * unseen) : kGateNew;
    for (std::size_t s = 0; s < sightings.size(); ++s) {
      const double distance = (sightings[s].position - expected[t].position).norm();
      if (taken[s] || distance > best_distance) continue;
      best = s;
      best_distance = distance;
    }
    const bool seen = best < sightings.size();
    Track next = seen ? Followed(tracks[t], expected[t], time, sightings[best].position)
                      : Unseen(tracks[t], expected[t], time, SeesThrough(scan, T_map_laser, expected[t].position));
    if (seen) taken[best] = true;
    if (seen && next.walks)
      update.beams.insert(update.beams.end(), sightings[best].beams.begin(), sightings[best].beams.end());
    if (IsKept(next)) update.tracks.push_back(next);
  }
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    if (taken[s]) continue;
    Track track;
    track.id = (*next_id)++;
    track.born = sightings[s].position;
    track.now = {track.born, Eigen::Vector2d::Zero()};
    track.time = track.seen = time;
    track.sightings = 1;
    update.tracks.push_back(track);
  }
  // Those who walk choose first.
  std::stable_partition(update.tracks.begin(), update.tracks.end(), [](const Track& track) { return track.walks; });
  return update;
}

}  // namespace planar_vslam
