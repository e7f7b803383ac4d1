#include "planar_vslam/backend/shared_places.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "planar_vslam/map/queries.h"
#include "stages.h"

namespace planar_vslam {
namespace {

// Whether two poses are of one place, as far as a verified view tells.
bool SamePlace(const Rigid3& a, const Rigid3& b) {
  constexpr double kDistance = 0.5;  // m
  constexpr double kAngle = DegreesToRadians(10.0);
  const Vector6d difference = LogSe3(a.Inverse() * b);
  return difference.head<3>().norm() < kDistance && difference.tail<3>().norm() < kAngle;
}

void Append(const PreparedScan& scan, const Rigid2& T_all_scan, PreparedScan* all) {
  for (const Eigen::Vector2d& point : scan.points) all->points.push_back(T_all_scan * point);
  for (const ScanSurface& surface : scan.surfaces)
    all->surfaces.push_back({T_all_scan * surface.point, T_all_scan.R() * surface.normal});
}

std::vector<LandmarkId> PlaceAround(const Map& map, KeyframeId keyframe) {
  const std::vector<LandmarkId> seen = LandmarksOf(map, {keyframe});
  return LandmarksOf(map, VotedKeyframes(map, seen, PlaceLimits::kPlaceKeyframes));
}

}  // namespace

PlaceSeeker::PlaceSeeker(std::shared_ptr<const Map> known, const MapperContext& context)
    : known_(std::move(known)), context_(context) {
  index_.Update(*known_);
}

CameraView PlaceSeeker::ViewOf(const Keyframe& keyframe) const {
  const MeasurementModel& model = context_.model;
  CameraView view{keyframe.features, keyframe.T_base_camera, model.camera, model.planar, model.pixel_sigma};
  if (!keyframe.on_floor) view.planar.mode = PlanarMode::kOff;
  return view;
}

std::optional<KeyframeId> PlaceSeeker::SeesTheSame(const Placement& placement) const {
  const std::vector<KeyframeId> most = VotedKeyframes(*known_, ValidOnly(placement.matches.landmarks), 1);
  return most.empty() ? std::nullopt : std::optional(most.front());
}

std::optional<SharedPlace> PlaceSeeker::Find(KeyframeId id, const Keyframe& keyframe) const {
  return FindBy(index_, id, keyframe);
}

std::vector<SharedPlace> PlaceSeeker::FindElsewhere(const Map& other, const std::vector<SharedPlace>& places) const {
  std::vector<LandmarkId> shown;
  for (const SharedPlace& place : places) {
    const std::vector<LandmarkId> matched = ValidOnly(place.matches.landmarks);
    shown.insert(shown.end(), matched.begin(), matched.end());
  }
  std::sort(shown.begin(), shown.end());
  const std::vector<LandmarkId> all = known_->landmarks.Ids();
  std::vector<LandmarkId> rest;
  std::set_difference(all.begin(), all.end(), shown.begin(), shown.end(), std::back_inserter(rest));
  const PlaceIndex elsewhere(*known_, rest);
  std::vector<SharedPlace> found;
  for (const SharedPlace& place : places) {
    std::optional<SharedPlace> another = FindBy(elsewhere, place.keyframe, other.keyframes.At(place.keyframe));
    if (another.has_value()) found.push_back(std::move(*another));
  }
  return found;
}

std::optional<SharedPlace> PlaceSeeker::FindBy(const PlaceIndex& index, KeyframeId id, const Keyframe& keyframe) const {
  std::optional<Placement> best;
  int rival = 0;  // inliers of the best one at another place
  for (const KeyframeId candidate : index.Resembling(*keyframe.features, PlaceLimits::kTriedAnywhere)) {
    std::optional<Placement> found = Verify(*known_, ViewOf(keyframe), PlaceAround(*known_, candidate), candidate);
    if (!found.has_value()) continue;
    const bool better = !best.has_value() || found->matches.count > best->matches.count;
    if (best.has_value() && !SamePlace(best->T_map_base, found->T_map_base))
      rival = std::max(rival, std::min(best->matches.count, found->matches.count));
    if (better) best = std::move(found);
  }
  if (!best.has_value() || best->matches.count < context_.loop.min_inliers || !best->Shows(context_.loop.min_share) ||
      rival > PlaceLimits::kRivalShare * best->matches.count) {
    return std::nullopt;
  }
  const LaserWord laser = AskLaser(id, keyframe, best->T_map_base);
  const std::optional<KeyframeId> known = SeesTheSame(*best);
  if (!known.has_value() || (laser.has_sweeps && !laser.agrees)) return std::nullopt;
  return SharedPlace{*known, id, best->T_map_base, keyframe.T_map_base, std::move(best->matches), laser.agrees};
}

PlaceTest PlaceSeeker::TestAt(KeyframeId id, const Keyframe& keyframe, const Rigid3& T_known_base) const {
  constexpr double kReach = 1.0;  // m: views from here show the same
  constexpr double kReachAngle = DegreesToRadians(30.0);
  PlaceTest test;
  LaserWord laser = AskLaser(id, keyframe, T_known_base);
  test.place = std::move(laser.place);
  test.has_sweeps = laser.has_sweeps;
  test.sweeps_agree = laser.agrees;
  const std::vector<KeyframeId> near = NearbyKeyframes(*known_, T_known_base * keyframe.T_base_camera, kReach,
                                                       kReachAngle, PlaceLimits::kPlaceKeyframes);
  const std::vector<LandmarkId> landmarks = LandmarksOf(*known_, near);
  FrameMatches expected;
  SearchByProjection(*known_, landmarks, T_known_base * keyframe.T_base_camera, context_.model.camera,
                     *keyframe.features, ProjectionSearchOptions{}, &expected);
  test.should_see = static_cast<int>(expected.visible.size()) >= 2 * context_.loop.min_inliers &&
                    static_cast<int>(keyframe.features->keypoints.size()) >= 2 * context_.loop.min_inliers;
  std::optional<Placement> found = Verify(*known_, ViewOf(keyframe), landmarks, T_known_base);
  if (!found.has_value() || !SamePlace(found->T_map_base, T_known_base)) return test;
  test.sees = 2 * found->matches.count >= context_.loop.min_inliers;
  if (!test.sees || (laser.has_sweeps && !laser.agrees)) return test;
  if (const std::optional<KeyframeId> known = SeesTheSame(*found)) {
    test.place =
        SharedPlace{*known, id, found->T_map_base, keyframe.T_map_base, std::move(found->matches), laser.agrees};
  }
  return test;
}

PlaceSeeker::LaserWord PlaceSeeker::AskLaser(KeyframeId id, const Keyframe& keyframe,
                                             const Rigid3& T_known_base) const {
  constexpr double kNear = 1.0;           // m: surfaces in view are the same
  constexpr std::size_t kReferences = 4;  // sweeps: a robot that drove the other way saw another part of the room
  constexpr double kOff = 0.15;           // m, that sweeps may put the place elsewhere than the guess
  constexpr double kOffAngle = DegreesToRadians(3.0);
  constexpr double kCertain = 0.03;  // m: not so along a bare corridor
  const ScanMatchOptions& options = context_.scan_match;
  if (!options.enabled || keyframe.sweeps.empty()) return {};
  const std::vector<KeyframeId> near = NearestWithSweep(*known_, T_known_base, kNear, kReferences);
  if (near.empty()) return {};
  const Rigid2 T_first_known = ProjectToPlane(known_->keyframes.At(near.front()).T_map_base).Inverse();
  const Rigid2 guess = T_first_known * ProjectToPlane(T_known_base);
  const PreparedScan current = OwnSweep(keyframe, options);
  PreparedScan before;
  bool same_heading = false;  // sweeps of one heading have to agree; of others they may
  for (const KeyframeId other : near) {
    const Keyframe& reference = known_->keyframes.At(other);
    const Rigid2 T_first_other = T_first_known * ProjectToPlane(reference.T_map_base);
    same_heading = same_heading || std::abs((T_first_other.Inverse() * guess).angle) < DegreesToRadians(60.0);
    Append(OwnSweep(reference, options), T_first_other, &before);
  }
  const auto enough = static_cast<std::size_t>(options.min_points);
  if (current.points.size() < enough || before.points.size() < enough) return {};
  const std::optional<ScanMatch> match = MatchScans(before, current, guess, options);
  if (!match.has_value()) return {same_heading, false, {}};
  const Rigid2 off = guess.Inverse() * match->T_reference_current;
  const bool agrees = off.translation.norm() < kOff && std::abs(off.angle) < kOffAngle;
  LaserWord word{same_heading || agrees, agrees, {}};
  const bool in_all_directions = match->covariance(0, 0) + match->covariance(1, 1) < kCertain * kCertain;
  if (agrees && in_all_directions) {
    word.place = SharedPlace{near.front(), id, T_known_base * Embed3(off), keyframe.T_map_base, FrameMatches{}, true};
  }
  return word;
}

}  // namespace planar_vslam
