#include "planar_vslam/pipeline/saved_place.h"

#include <array>

#include "planar_vslam/localize/sight_odds.h"

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

// Looks once as if the robot is there, and once as if it is turned by some degrees: then landmarks lie where they do
// not belong.
double PlaceFinder::LookFrom(const Rigid2& place, const CameraView& view) {
  constexpr double kPlace = DegreesToRadians(0.75);  // a few centimetres and half a degree
  constexpr double kKeypoint = 4.0;                  // px at octave 0
  constexpr std::array<double, 4> kTurned{DegreesToRadians(-8.0), DegreesToRadians(-4.0), DegreesToRadians(4.0),
                                          DegreesToRadians(8.0)};
  const SightWindow window{kPlace * view.camera.fx, kKeypoint};
  const LandmarkTable& table = map_.get()->table();
  const std::vector<SightView> views{{Rigid2(), view}};
  Agreement by_chance;
  for (const double turned : kTurned) {
    const Agreement seen = Compare(table, place * Rigid2(0.0, 0.0, turned), views, window);
    by_chance.visible += seen.visible, by_chance.found += seen.found;
  }
  return SightLogOdds(Compare(table, place, views, window), by_chance);
}

void PlaceFinder::AddView(const CameraView& view, const std::vector<Placement>& seen,
                          const std::optional<SettledPlace>& expected) {
  if (ByLaser()) return AddViewBesideLaser(view, seen);
  constexpr int kPatience = 10;  // packets: a laser turns more slowly than images come
  if ((waits_for_sweeps_ && packets_ <= kPatience) || !sight_.WantsView()) return;
  std::vector<Rigid2> suggested;
  for (const Placement& placement : seen) suggested.push_back(ProjectToPlane(placement.T_map_base));
  sight_.AddView(view, std::move(suggested), expected);
}

void PlaceFinder::AddViewBesideLaser(const CameraView& view, const std::vector<Placement>& seen) {
  if (!belief_.WantsView() || !IsReady(map_, false)) return;
  constexpr std::size_t kContenders = 6;
  constexpr double kBehind = 12.0;  // log odds behind the best: few views bring such a place back
  std::vector<Rigid2> contenders;
  for (const PlaceHypothesis& hypothesis : belief_.hypotheses()) {
    if (contenders.size() == kContenders) break;
    if (hypothesis.log_odds() < belief_.hypotheses().front().log_odds() - kBehind) break;
    contenders.push_back(hypothesis.T_map_base);
  }
  // The one place that PnP speaks for most.
  if (!seen.empty()) contenders.push_back(ProjectToPlane(seen.front().T_map_base));
  std::vector<PlaceBelief::SeenPlace> places;
  for (const Rigid2& place : contenders) places.push_back({place, LookFrom(place, view)});
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
