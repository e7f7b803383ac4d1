#include "planar_vslam/navigate/people_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace planar_vslam {
namespace {

constexpr double kWatchRange = 8.0;     // m
constexpr double kListensAgain = 1.0;   // s
constexpr double kUnseen = 0.5;         // s
constexpr double kOutOfRhythm = 0.4;    // m
constexpr double kForgetsOffset = 1.0;  // s, until what somebody is off their rhythm is down to 1 / e
constexpr float kAvoids = 2.0F;         // a way where somebody walked counts that much more

// As far as it can be told.
bool IsInRhythm(const Trail& trail, const Rhythm& rhythm, const Track& track) {
  const std::optional<Eigen::Vector2d> then = PlaceInRhythm(trail, rhythm, track.time);
  return !then.has_value() || (*then - track.now.position).norm() <= kOutOfRhythm;
}

}  // namespace

std::vector<std::size_t> PeopleWatch::AddSweep(double time, const PlanarScan& scan, const Rigid2& T_map_laser,
                                               const Costmap& costmap) {
  if (options_.foresight <= 0.0 || !costmap.has_map()) return {};
  if (!T_map_laser.translation.allFinite() || !std::isfinite(T_map_laser.angle)) return {};
  if (!recent_.Fits(costmap.map())) {
    Forget();
    recent_.Reset(costmap.map());
  }
  std::vector<Motion> expected;
  std::vector<Eigen::Vector2d> walkers;
  for (const Track& track : tracks_) {
    expected.push_back(ExpectedAt(track, time, costmap));
    // Who stops is out of the rhythm soon, and becomes an obstacle.
    if (track.walks && !InRhythm(track, time, 1).empty()) walkers.push_back(expected.back().position);
  }
  const std::vector<Sighting> sightings = FindSightings(scan, T_map_laser, costmap, recent_, walkers);
  TrackUpdate update = UpdateTracks(tracks_, expected, time, sightings, scan, T_map_laser, &next_id_);
  tracks_ = std::move(update.tracks);
  RecogniseThem();
  trails_ = ExtendTrails(std::move(trails_), tracks_, time, options_.trail_lifetime);
  FindRhythms(time);
  recent_.Add(T_map_laser, scan, kWatchRange);
  std::sort(update.beams.begin(), update.beams.end());
  return update.beams;
}

Motion PeopleWatch::ExpectedAt(const Track& track, double time, const Costmap& costmap) const {
  const double period = time - track.time;
  if (track.time - track.seen > kUnseen) {
    const std::vector<Eigen::Vector2d> places = InRhythm(track, time, 2);
    if (!places.empty()) return {places.front(), (places.back() - places.front()) / Foresight::kPeriod};
  }
  // Of a way that was walked before, the turns alone are taken: nobody's steps fall on it exactly.
  Motion then = ForeseeWay(track.now, track.time, trails_, costmap, period, 1).front();
  then.position = track.now.position + 0.5 * period * (track.now.velocity + then.velocity);
  return then;
}

void PeopleWatch::RecogniseThem() {
  for (const Track& track : tracks_) {
    const auto is_of = [](int id) { return [id](const auto& of) { return of.walker == id; }; };
    if (!track.walks || std::any_of(trails_.begin(), trails_.end(), is_of(track.id))) continue;
    for (Rhythm& rhythm : rhythms_) {
      const auto trail = std::find_if(trails_.begin(), trails_.end(), is_of(rhythm.walker));
      const int old = rhythm.walker;
      const bool followed = std::any_of(tracks_.begin(), tracks_.end(), [old](const Track& t) { return t.id == old; });
      if (trail == trails_.end() || followed) continue;
      const std::optional<Eigen::Vector2d> then = PlaceInRhythm(*trail, rhythm, track.time);
      if (!then.has_value() || (*then - track.now.position).norm() > kOutOfRhythm) continue;
      trail->walker = rhythm.walker = track.id;
      break;
    }
  }
}

void PeopleWatch::Forget() {
  recent_ = {};
  tracks_.clear();
  trails_.clear();
  rhythms_.clear();
}

void PeopleWatch::FindRhythms(double time) {
  if (std::abs(time - listened_) < kListensAgain) return;
  listened_ = time;
  const std::vector<Rhythm> before = std::exchange(rhythms_, {});
  for (const Trail& trail : trails_) {
    const auto old =
        std::find_if(before.begin(), before.end(), [&](const Rhythm& r) { return r.walker == trail.walker; });
    const auto track =
        std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return t.id == trail.walker; });
    const bool in_sight = track != tracks_.end() && track->seen >= time;
    const std::optional<Rhythm> rhythm = in_sight ? RhythmOf(trail) : std::nullopt;
    if (rhythm.has_value()) {
      rhythms_.push_back(*rhythm);
    } else if (old != before.end() && (!in_sight || IsInRhythm(trail, *old, *track))) {
      rhythms_.push_back(*old);  // too little of the last half minute was seen
    }
  }
}

std::vector<Eigen::Vector2d> PeopleWatch::InRhythm(const Track& track, double time, int count) const {
  const auto rhythm =
      std::find_if(rhythms_.begin(), rhythms_.end(), [&](const Rhythm& r) { return r.walker == track.id; });
  const auto trail = std::find_if(trails_.begin(), trails_.end(), [&](const Trail& t) { return t.walker == track.id; });
  if (rhythm == rhythms_.end() || trail == trails_.end()) return {};
  if (!IsInRhythm(*trail, *rhythm, track)) return {};
  const Eigen::Vector2d then = PlaceInRhythm(*trail, *rhythm, track.time).value_or(track.now.position);
  std::vector<Eigen::Vector2d> places;
  for (int k = 0; k < count; ++k) {
    const std::optional<Eigen::Vector2d> place = PlaceInRhythm(*trail, *rhythm, time + k * Foresight::kPeriod);
    if (!place.has_value()) return {};
    // What it is off its way now it soon is no longer.
    const double kept = std::exp(-k * Foresight::kPeriod / kForgetsOffset);
    places.emplace_back(*place + kept * (track.now.position - then));
  }
  return places;
}

Foresight PeopleWatch::ForeseeFrom(double time, double seconds, const Costmap& costmap) const {
  Foresight foresight;
  const int count = static_cast<int>(std::lround(seconds / Foresight::kPeriod)) + 1;
  for (const Track& track : tracks_) {
    if (!track.walks) continue;
    std::vector<Eigen::Vector2d> in_rhythm = InRhythm(track, time, count);
    if (!in_rhythm.empty()) {
      foresight.people.push_back(std::move(in_rhythm));
      continue;
    }
    foresight.steady = false;
    const double age = std::clamp(time - track.time, 0.0, Foresight::kPeriod);
    const auto way = ForeseeWay(track.now, track.time, trails_, costmap, Foresight::kPeriod, count);
    std::vector<Eigen::Vector2d> places;
    Eigen::Vector2d last = track.now.position;
    for (const Motion& motion : way) {
      places.emplace_back(last + age / Foresight::kPeriod * (motion.position - last));
      last = motion.position;
    }
    foresight.people.push_back(std::move(places));
  }
  return foresight;
}

double PeopleWatch::Reach() const {
  return options_.robot_radius + options_.person_radius + options_.person_margin + 0.1;
}

bool PeopleWatch::IsWalked(const Eigen::Vector2d& p_map) const {
  const double reach = Reach() * Reach();
  for (const Trail& trail : trails_) {
    for (const Footstep& step : trail.steps) {
      if ((step.motion.position - p_map).squaredNorm() < reach) return true;
    }
  }
  return false;
}

std::vector<float> PeopleWatch::CostOfWays(double time, const Costmap& costmap) const {
  std::vector<Eigen::Vector2d> places;
  for (const Trail& trail : trails_) {
    for (const Footstep& step : trail.steps) places.push_back(step.motion.position);
  }
  for (const auto& way : ForeseeFrom(time, options_.foresight, costmap).people)
    places.insert(places.end(), way.begin(), way.end());
  std::vector<float> cost;
  for (const Eigen::Vector2d& place : places) Stamp(costmap, place, &cost);
  return cost;
}

void PeopleWatch::Stamp(const Costmap& costmap, const Eigen::Vector2d& place, std::vector<float>* cost) const {
  const OccupancyGrid2d& map = costmap.map();
  const int reach = static_cast<int>(std::ceil(Reach() / map.resolution)), cell = costmap.CellOf(place);
  if (cell < 0) return;
  cost->resize(map.cells.size(), 0.0F);
  const int x0 = std::max(0, cell % map.width - reach), x1 = std::min(map.width - 1, cell % map.width + reach);
  const int y0 = std::max(0, cell / map.width - reach), y1 = std::min(map.height - 1, cell / map.width + reach);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const int u = x - cell % map.width, v = y - cell / map.width;
      if (u * u + v * v <= reach * reach) (*cost)[static_cast<std::size_t>(y * map.width + x)] = kAvoids;
    }
  }
}

}  // namespace planar_vslam
