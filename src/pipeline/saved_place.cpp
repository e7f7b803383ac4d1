#include "planar_vslam/pipeline/saved_place.h"

#include <algorithm>

#include "planar_vslam/map/queries.h"

namespace planar_vslam {
namespace {

constexpr std::size_t kFewestSweeps = 3;  // fewer tell of no place
// Log odds a point (likelihood_field.h) of one sweep where the robot is: 1.1 where nothing has changed.
constexpr double kGoodFit = 0.8;   // nothing fits much better
constexpr double kLeastFit = 0.5;  // three of five beams end on a surface

Eigen::Matrix3d Diagonal(double position, double angle) {
  return Eigen::Vector3d(position * position, position * position, angle * angle).asDiagonal();
}

}  // namespace

MapLaser LaserOf(const Map& map, const ScanMatchOptions& options) {
  if (!map.metric) return {};
  std::vector<PosedSweep> sweeps;
  for (const auto& [id, keyframe] : map.keyframes) {
    const Rigid2 T_map_keyframe = ProjectToPlane(keyframe.T_map_base);
    for (const LaserSweep& sweep : keyframe.sweeps)
      sweeps.push_back({sweep.scan, sweep.T_base_laser, T_map_keyframe * sweep.T_keyframe_base});
  }
  if (sweeps.size() < kFewestSweeps) return {};
  MapLaser laser{std::make_shared<const LikelihoodField>(sweeps), std::make_shared<const SurfaceMap>(sweeps, options)};
  if (laser.field->empty() || laser.surfaces->empty()) return {};
  return laser;
}

void PlaceFinder::Add(const FramePacket& packet, const Rigid2& step) {
  belief_.Move(step);
  sight_.Move(step);
  ++packets_;
  for (const ScanPacket& scan : packet.scans) belief_.AddSweep(scan.scan, scan.T_base_laser, scan.T_frame_base);
}

// What the view shows of the landmarks that should be in view at a place.
struct PlaceFinder::Sighting {
  Rigid2 T_map_base;
  int visible = 0, found = 0;
};

PlaceFinder::Sighting PlaceFinder::LookFrom(const Rigid2& place, const CameraView& view, const Map& map) {
  constexpr double kWindow = 12.0;  // px: a few centimetres and half a degree
  constexpr double kRatio = 0.8;
  constexpr double kReach = 10.0;         // m: what is seen across a room
  constexpr std::size_t kKeyframes = 40;  // that may have seen it
  const Rigid3 T_map_camera = Embed3(place) * view.T_base_camera;
  const std::vector<KeyframeId> near =
      NearbyKeyframes(map, T_map_camera, kReach, PlaceLimits::kTrackerReachAngle, kKeyframes);
  ProjectionSearchOptions search;
  search.radius = kWindow;
  search.ratio = kRatio;
  search.max_distance = PlaceLimits::kLikeDistance;
  FrameMatches matches;
  SearchByProjection(map, LandmarksOf(map, near), T_map_camera, view.camera, *view.features, search, &matches);
  return {place, static_cast<int>(matches.visible.size()), matches.count};
}

// Landmarks found at a place beyond those that its rivals show by chance, for as many in view.
double PlaceFinder::Excess(const std::vector<Sighting>& sightings, std::size_t of) {
  constexpr int kLeastInView = 30;
  constexpr double kByChance = 0.05;           // of those in view, at least
  constexpr double kTimes = 1.5, kMore = 3.0;  // that chance may have found more
  if (sightings.size() < 2 || sightings[of].visible < kLeastInView) return 0.0;
  double rival = kByChance * sightings[of].visible;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (i == of) continue;
    const double share = sightings[i].found / static_cast<double>(std::max(kLeastInView, sightings[i].visible));
    rival = std::max(rival, share * sightings[of].visible);
  }
  return sightings[of].found - kTimes * rival - kMore;
}

void PlaceFinder::AddView(const CameraView& view, const Map& map, const std::vector<Placement>& seen,
                          const std::optional<SettledPlace>& expected) {
  if (ByLaser()) return AddViewBesideLaser(view, map, seen);
  constexpr int kPatience = 10;  // packets: a laser turns more slowly than images come
  if ((waits_for_sweeps_ && packets_ <= kPatience) || !sight_.WantsView()) return;
  std::vector<Rigid2> suggested;
  for (const Placement& placement : seen) suggested.push_back(ProjectToPlane(placement.T_map_base));
  sight_.AddView(view, std::move(suggested), expected);
}

void PlaceFinder::AddViewBesideLaser(const CameraView& view, const Map& map, const std::vector<Placement>& seen) {
  if (!belief_.WantsView()) return;
  constexpr std::size_t kContenders = 6;
  constexpr double kBehind = 12.0;  // log odds behind the best: few views bring such a place back
  std::vector<PlaceBelief::SeenPlace> places;
  for (const Placement& placement : seen)
    places.push_back({ProjectToPlane(placement.T_map_base), placement.matches.count});
  std::vector<Sighting> sightings;
  for (const PlaceHypothesis& hypothesis : belief_.hypotheses()) {
    if (sightings.size() == kContenders) break;
    if (hypothesis.log_odds() < belief_.hypotheses().front().log_odds() - kBehind) break;
    sightings.push_back(LookFrom(hypothesis.T_map_base, view, map));
  }
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const double excess = Excess(sightings, i);
    if (excess > 0.0)
      places.push_back({sightings[i].T_map_base, PlaceBelief::kInliersByChance + static_cast<int>(excess)});
  }
  belief_.AddView(places);
}

std::optional<SettledPlace> PlaceFinder::Found() {
  constexpr double kPosition = 0.10;  // m: the field's cells, and odometry over the sweeps
  constexpr double kAngle = DegreesToRadians(2.0);
  if (const std::optional<Rigid2> by_laser = belief_.Believed())
    return SettledPlace{*by_laser, Diagonal(kPosition, kAngle)};
  if (ByLaser()) return std::nullopt;
  return sight_.Found();
}

// The best of all poses around. Nothing where none explains the sweep, or several do.
std::optional<LaserFix> LaserTracker::BestAround(const ScanPacket& scan, const std::vector<Eigen::Vector2d>& points,
                                                 const Rigid2& guess) const {
  constexpr double kRadius = 1.0;  // m: a large slip
  constexpr double kAngle = DegreesToRadians(25.0);
  constexpr double kUnrivalled = 0.2;  // log odds a point ahead of every other place around
  constexpr double kMatched = 0.1;     // ...that matching may lose: it follows surfaces, not points
  constexpr double kCellSigma = 0.03;  // m, of a pose that the field gave
  constexpr double kStepSigma = DegreesToRadians(0.7);
  const std::vector<PlaceOdds> places =
      FindPlaces(*laser_.field, points, SearchArea{guess, kRadius, kAngle}, 2, kUnrivalled);
  if (places.empty() || places.front().log_odds < kLeastFit) return std::nullopt;
  if (places.size() > 1 && places[1].log_odds > places[0].log_odds - kUnrivalled) return std::nullopt;
  const PlaceOdds& best = places.front();
  const Eigen::Matrix3d covariance = Diagonal(kCellSigma, kStepSigma);
  const std::optional<LaserFix> fix = laser_.surfaces->Fix(scan.scan, scan.T_base_laser, best.T_map_base, covariance);
  if (fix.has_value() && laser_.field->LogOdds(points, fix->T_map_base) > best.log_odds - kMatched) return fix;
  return LaserFix{best.T_map_base, covariance, true};
}

std::optional<PlanarFix> LaserTracker::Fix(const FramePacket& packet, const Rigid2& guess,
                                           const Eigen::Matrix3d& covariance) const {
  if (laser_.surfaces == nullptr || packet.scans.empty()) return std::nullopt;
  constexpr double kPointSize = 0.1;  // m
  constexpr double kModel = 0.02;     // m, that a matched pose may be off odometry's beside both covariances...
  constexpr double kModelAngle = DegreesToRadians(1.0);
  const ScanPacket& scan = packet.scans.back();
  const Rigid2 at_sweep = guess * scan.T_frame_base;
  const std::vector<Eigen::Vector2d> points = Thinned(PointsOf(scan.scan, scan.T_base_laser), kPointSize);
  std::optional<LaserFix> fix =
      laser_.surfaces->Fix(scan.scan, scan.T_base_laser, at_sweep, covariance + Diagonal(kModel, kModelAngle));
  // The wheels slipped, or much has moved: one of several ways to lay the sweep on the map, and maybe not the best.
  if (!fix.has_value() || laser_.field->LogOdds(points, fix->T_map_base) < kGoodFit)
    fix = BestAround(scan, points, at_sweep);
  if (!fix.has_value()) return std::nullopt;
  const Rigid2 T_sweep_image = scan.T_frame_base.Inverse();
  const Eigen::Matrix3d adjoint = AdjointSe2(scan.T_frame_base);  // of the inverse's inverse
  return PlanarFix{fix->T_map_base * T_sweep_image, adjoint * fix->covariance * adjoint.transpose(), fix->complete};
}

}  // namespace planar_vslam
