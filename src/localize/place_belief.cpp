#include "planar_vslam/localize/place_belief.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kPointSize = 0.1;          // m, of a square that counts once in a sweep...
constexpr double kMapPointSize = 0.15;      // ...and in all sweeps together
constexpr std::size_t kSearchPoints = 120;  // that the whole map is searched with: more find the same places
constexpr std::size_t kFewestPoints = 40;   // that a place is believed or refuted by
constexpr double kCorrelated = 6.0;         // points that count as one: surfaces are about a metre long
constexpr std::size_t kPlaces = 6;          // that a search keeps
constexpr double kSearchMargin = 0.8;       // of odds a point, behind the best place

constexpr double kNewPlace = 0.2;  // m, or...
constexpr double kNewHeading = DegreesToRadians(10.0);
constexpr std::size_t kSweeps = 15;  // that are remembered: 3 m, over which odometry is good to the field's sigma

constexpr double kMostOfOneView = 5.0;

// Chosen on the drives of BENCHMARK.md, each against its own map and against those of the other worlds.
constexpr double kBelieved = 6.0;   // log odds: 400 to 1, which also has to hold at the next place
constexpr double kKidnapped = 6.0;  // log odds against: robots are not often carried
// Odds a point. Chosen by looking at seed 1: by the laser alone three of four beams end where they should. In an
// office's map, walls of a hall that it does not know had up to 0.66, right places in changed rooms 0.84 and more.
// Where the camera speaks for it, too, two of three.
constexpr double kLeastFit = 0.75;
constexpr double kLeastFitSeen = 0.55;
constexpr double kMostCrossed = 0.4;  // of beams: table legs are crossed by a fifth of them, at the right place
constexpr double kRefuted = 0.2;      // odds a point
constexpr int kTimes = 2;
// Log odds by sight: 20 to 1. Laser and camera seldom err alike: what both speak for need not wait for the next place,
// so a robot that stands finds itself, too. Chosen by looking at drives in maps of other rooms: places there that the
// laser had named showed 2.5 at most.
constexpr double kSeenToo = 3.0;

bool IsNewPlace(const Rigid2& moved) {
  return moved.translation.norm() >= kNewPlace || std::abs(moved.angle) >= kNewHeading;
}

}  // namespace

void PlaceBelief::Move(const Rigid2& T_before_now) {
  const Rigid2 T_now_before = T_before_now.Inverse();
  for (Seen& seen : sweeps_) seen.T_now_base = T_now_before * seen.T_now_base;
  for (Eigen::Vector2d& p : points_) p = T_now_before * p;
  for (PlaceHypothesis& hypothesis : hypotheses_) hypothesis.T_map_base = hypothesis.T_map_base * T_before_now;
  if (leader_.has_value()) leader_ = *leader_ * T_before_now;
  if (T_now_counted_.has_value()) T_now_counted_ = T_now_before * *T_now_counted_;
  if (T_now_last_view_.has_value()) T_now_last_view_ = T_now_before * *T_now_last_view_;
}

bool PlaceBelief::AddSweep(const PlanarScan& scan, const Rigid3& T_base_laser, const Rigid2& T_now_base) {
  if (!HasField()) return false;
  if (!sweeps_.empty() && !IsNewPlace(sweeps_.back().T_now_base.Inverse() * T_now_base)) return false;
  sweeps_.push_back(
      {T_now_base, T_base_laser.translation.head<2>(), Thinned(PointsOf(scan, T_base_laser), kPointSize)});
  if (sweeps_.size() > kSweeps) sweeps_.erase(sweeps_.begin());
  points_.clear();
  for (auto seen = sweeps_.rbegin(); seen != sweeps_.rend(); ++seen) {
    for (const Eigen::Vector2d& p : seen->points) points_.push_back(seen->T_now_base * p);
  }
  points_ = Thinned(points_, kMapPointSize);
  Search();
  Rank();
  return true;
}

// Places that explain all sweeps, and those that views have spoken for.
void PlaceBelief::Search() {
  std::vector<Eigen::Vector2d> some;
  const std::size_t stride = std::max<std::size_t>(1, points_.size() / kSearchPoints);
  for (std::size_t i = 0; i < points_.size(); i += stride) some.push_back(points_[i]);
  std::vector<PlaceHypothesis> found;
  for (const PlaceOdds& place : FindPlaces(*field_, some, std::nullopt, kPlaces, kSearchMargin)) {
    PlaceHypothesis hypothesis;
    hypothesis.T_map_base = place.T_map_base;
    for (const PlaceHypothesis& before : hypotheses_) {
      if (!IsSamePlace(before.T_map_base, place.T_map_base)) continue;
      // Views that showed nothing of the place stay views of it.
      if (hypothesis.views > 0 && before.sight() <= hypothesis.sight()) continue;
      hypothesis.seen = before.seen;
      hypothesis.views = before.views;
    }
    found.push_back(hypothesis);
  }
  for (const PlaceHypothesis& before : hypotheses_) {
    const auto is_same = [&before](const PlaceHypothesis& h) { return IsSamePlace(h.T_map_base, before.T_map_base); };
    if (before.seen > 0.0 && std::none_of(found.begin(), found.end(), is_same)) found.push_back(before);
  }
  for (PlaceHypothesis& hypothesis : found) WeighByLaser(&hypothesis);
  hypotheses_ = std::move(found);
}

void PlaceBelief::WeighByLaser(PlaceHypothesis* hypothesis) const {
  if (!HasField() || points_.empty()) return;
  const PlaceOdds place = Climb(*field_, points_, hypothesis->T_map_base);
  hypothesis->T_map_base = place.T_map_base;
  hypothesis->fit = place.log_odds;
  hypothesis->laser = place.log_odds * static_cast<double>(points_.size()) / kCorrelated;
  hypothesis->crossed = Crossed(place.T_map_base);
}

double PlaceBelief::Crossed(const Rigid2& T_map_base) const {
  int beams = 0, crossed = 0;
  for (const Seen& seen : sweeps_) {
    const Rigid2 T = T_map_base * seen.T_now_base;
    const Eigen::Vector2d laser = T * seen.laser;
    for (const Eigen::Vector2d& p : seen.points) crossed += field_->Crosses(laser, T * p) ? 1 : 0;
    beams += static_cast<int>(seen.points.size());
  }
  return beams == 0 ? 0.0 : static_cast<double>(crossed) / beams;
}

bool PlaceBelief::WantsView() const { return !T_now_last_view_.has_value() || IsNewPlace(*T_now_last_view_); }

void PlaceBelief::AddView(const std::vector<SeenPlace>& seen) {
  T_now_last_view_ = Rigid2();
  std::vector<double> gained(hypotheses_.size(), 0.0);
  for (const SeenPlace& place : seen) {
    // What is not seen says nothing: lights change.
    const double odds = std::clamp(place.log_odds, 0.0, kMostOfOneView);
    bool known = false;
    for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
      if (!IsSamePlace(hypotheses_[i].T_map_base, place.T_map_base)) continue;
      known = true;
      gained[i] = std::max(gained[i], odds);
    }
    if (known || odds <= 0.0) continue;
    PlaceHypothesis hypothesis;
    hypothesis.T_map_base = place.T_map_base;
    WeighByLaser(&hypothesis);
    hypotheses_.push_back(hypothesis);
    gained.push_back(odds);
  }
  for (std::size_t i = 0; i < gained.size(); ++i) {
    hypotheses_[i].seen += gained[i];
    ++hypotheses_[i].views;
  }
  Rank();
}

void PlaceBelief::Rank() {
  std::stable_sort(hypotheses_.begin(), hypotheses_.end(),
                   [](const PlaceHypothesis& a, const PlaceHypothesis& b) { return a.log_odds() > b.log_odds(); });
  constexpr std::size_t kMost = 30;
  if (hypotheses_.size() > kMost) hypotheses_.resize(kMost);
  const bool stands_out = LeaderStandsOut();
  const bool same = stands_out && leader_.has_value() && IsSamePlace(*leader_, hypotheses_.front().T_map_base);
  const bool elsewhere = T_now_counted_.has_value() && IsNewPlace(*T_now_counted_);
  if (!same) stood_out_ = 0;
  if (stands_out && (!same || elsewhere)) {
    ++stood_out_;
    T_now_counted_ = Rigid2();
  }
  if (stands_out && hypotheses_.front().sight() >= kSeenToo) stood_out_ = std::max(stood_out_, kTimes);
  leader_.reset();
  if (stands_out) leader_ = hypotheses_.front().T_map_base;
}

// The log of how many places the map has: each is as much less likely beforehand than "unknown".
double PlaceBelief::PlacesOfMap() const {
  constexpr double kHeadings = M_PI / kSamePlaceAngle;
  const double area = std::max(field_->free_area(), 1.0);
  return std::log(kHeadings * area / (kSamePlaceDistance * kSamePlaceDistance));
}

bool PlaceBelief::LeaderStandsOut() const {
  if (hypotheses_.empty() || points_.size() < kFewestPoints) return false;
  const PlaceHypothesis& best = hypotheses_.front();
  double rival = PlacesOfMap();  // "unknown"
  for (const PlaceHypothesis& other : hypotheses_) {
    if (!IsSamePlace(other.T_map_base, best.T_map_base)) rival = std::max(rival, other.log_odds());
  }
  if (best.log_odds() - rival < kBelieved + (elsewhere_ ? kKidnapped : 0.0)) return false;
  return best.fit >= (best.sight() >= kSeenToo ? kLeastFitSeen : kLeastFit) && best.crossed <= kMostCrossed;
}

std::optional<Rigid2> PlaceBelief::Believed() const {
  if (stood_out_ < kTimes) return std::nullopt;
  return hypotheses_.front().T_map_base;
}

bool PlaceBelief::SeesEnough() const { return HasField() && points_.size() >= kFewestPoints; }

bool PlaceBelief::Contradicts(const Rigid2& T_map_base) const {
  if (!SeesEnough()) return false;
  return Climb(*field_, points_, T_map_base).log_odds < kRefuted || Crossed(T_map_base) > kMostCrossed;
}

}  // namespace planar_vslam
