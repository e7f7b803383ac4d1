#include "planar_vslam/navigate/people_watch.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kWatchRange = 8.0;  // m
constexpr float kAvoids = 2.0F;      // a way where somebody walked counts that much more

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
  for (const Track& track : tracks_) {
    // Of a way that was walked before, the turns alone are taken: nobody's steps fall on it exactly.
    const double period = time - track.time;
    Motion then = ForeseeWay(track.now, track.time, trails_, costmap, period, 1).front();
    then.position = track.now.position + 0.5 * period * (track.now.velocity + then.velocity);
    expected.push_back(then);
  }
  TrackUpdate update = UpdateTracks(tracks_, expected, time, FindSightings(scan, T_map_laser, costmap, recent_), scan,
                                    T_map_laser, &next_id_);
  tracks_ = std::move(update.tracks);
  trails_ = ExtendTrails(std::move(trails_), tracks_, time, options_.trail_lifetime);
  recent_.Add(T_map_laser, scan, kWatchRange);
  std::sort(update.beams.begin(), update.beams.end());
  return update.beams;
}

void PeopleWatch::Forget() {
  recent_ = {};
  tracks_.clear();
  trails_.clear();
}

Foresight PeopleWatch::ForeseeFrom(double time, const Costmap& costmap) const {
  Foresight foresight;
  const int count = static_cast<int>(std::lround(options_.foresight / Foresight::kPeriod)) + 1;
  for (const Track& track : tracks_) {
    if (!track.walks) continue;
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
  for (const auto& way : ForeseeFrom(time, costmap).people) places.insert(places.end(), way.begin(), way.end());
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
