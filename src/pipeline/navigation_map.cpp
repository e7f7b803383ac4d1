#include "planar_vslam/pipeline/navigation_map.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "accepted_landmarks.h"

namespace planar_vslam {
namespace {

// A laser mounted within this of level is level; one that is tilted on purpose looks down by more.
constexpr double kLevelTilt = DegreesToRadians(3.0);

// Keyframes in an epoch: a few dozen sweeps, so that one epoch of seeing through a place clears it, and one of a few
// stray beams does not. Fitted.
constexpr std::uint32_t kKeyframesInEpoch = 16;

int EpochOf(KeyframeId id) { return static_cast<int>(id.value / kKeyframesInEpoch); }

PosedPoints PointsSeenBy(const Map& map, const Keyframe& keyframe, const AcceptedLandmarks& accepted) {
  PosedPoints points;
  points.camera_in_map = keyframe.T_map_camera().translation;
  for (const LandmarkId id : keyframe.landmarks) {
    const auto entry = id.valid() ? accepted.find(id) : accepted.end();
    if (entry == accepted.end()) continue;
    const Eigen::Vector3d& p_map = map.landmarks.At(id).p_map;
    const AcceptedLandmark& landmark = entry->second;
    points.points.push_back({p_map, landmark.relative_sigma * (p_map - points.camera_in_map).norm(), landmark.blocks});
  }
  return points;
}

// Steps along the straight line that odometry says was driven; a curve's chord is not where the robot was.
std::vector<Eigen::Vector2d> DrivenLine(const Map& map, const Keyframe& keyframe) {
  if (!keyframe.odometry_link.has_value()) return {};
  constexpr double kStep = 0.05;           // m
  constexpr double kStraight = 1.02;       // driven distance over chord
  constexpr double kTurnOnTheSpot = 0.05;  // m of driven distance that no chord needs to explain
  const Eigen::Vector2d from = map.keyframes.At(keyframe.odometry_link->from).T_map_base.translation.head<2>();
  const Eigen::Vector2d to = keyframe.T_map_base.translation.head<2>();
  const double chord = (to - from).norm();
  if (keyframe.odometry_link->motion.distance > kStraight * chord + kTurnOnTheSpot) return {};
  const int steps = static_cast<int>(chord / kStep);
  std::vector<Eigen::Vector2d> line;
  for (int i = 1; i <= steps; ++i) line.emplace_back(from + (to - from) * (i * kStep / chord));
  return line;
}

bool IsAway(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const NavigationTolerance& tolerance) {
  return (a - b).norm() > tolerance.distance;
}

bool Differ(const PosedPoints& a, const PosedPoints& b, const NavigationTolerance& tolerance) {
  if (IsAway(a.camera_in_map, b.camera_in_map, tolerance)) return true;
  const auto same = [&tolerance](const PosedPoint& p, const PosedPoint& q) {
    return !IsAway(p.p_map, q.p_map, tolerance) && p.blocks == q.blocks &&
           std::abs(p.depth_sigma - q.depth_sigma) <= tolerance.depth_sigma * q.depth_sigma;
  };
  return !std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(), same);
}

bool Differ(const PosedScan& a, const PosedScan& b, const NavigationTolerance& tolerance) {
  return a.ranges != b.ranges || IsAway(a.T_map_laser.translation, b.T_map_laser.translation, tolerance) ||
         a.T_map_laser.rotation.angularDistance(b.T_map_laser.rotation) > tolerance.angle;
}

}  // namespace

LandmarkAcceptance LandmarkAcceptance::For(double pixel_sigma) {
  LandmarkAcceptance acceptance;
  acceptance.pixel_sigma = pixel_sigma;
  return acceptance;
}

NavigationTolerance NavigationTolerance::For(double resolution) {
  return {std::max(0.01, 0.5 * resolution), DegreesToRadians(0.5), 0.25};
}

struct NavigationMap::Evidence {
  PosedPoints points;
  std::vector<PosedScan> scans;
  std::vector<std::shared_ptr<const PlanarScan>> alive;  // what the scans point to
  std::vector<Eigen::Vector2d> footprints;

  Evidence(const Map& map, KeyframeId id, const AcceptedLandmarks& accepted) {
    const Keyframe& keyframe = map.keyframes.At(id);
    points = PointsSeenBy(map, keyframe, accepted);
    points.epoch = EpochOf(id);
    footprints = DrivenLine(map, keyframe);
    footprints.emplace_back(keyframe.T_map_base.translation.head<2>());
    for (const LaserSweep& sweep : keyframe.sweeps) AddSweep(ProjectToPlane(keyframe.T_map_base), sweep);
  }

  bool DiffersFrom(const Evidence& other, const NavigationTolerance& tolerance) const {
    const auto same_scan = [&](const PosedScan& a, const PosedScan& b) { return !Differ(a, b, tolerance); };
    const auto same_place = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      return (a - b).norm() <= tolerance.distance;
    };
    return Differ(points, other.points, tolerance) ||
           !std::equal(scans.begin(), scans.end(), other.scans.begin(), other.scans.end(), same_scan) ||
           !std::equal(footprints.begin(), footprints.end(), other.footprints.begin(), other.footprints.end(),
                       same_place);
  }

 private:
  void AddSweep(const Rigid2& T_map_keyframe, const LaserSweep& sweep) {
    const Rigid2 T_map_base = T_map_keyframe * sweep.T_keyframe_base;
    PosedScan scan{Embed3(T_map_base) * sweep.T_base_laser,
                   sweep.scan->angle_min,
                   sweep.scan->angle_increment,
                   sweep.scan->range_min,
                   sweep.scan->range_max,
                   &sweep.scan->ranges};
    if (sweep.T_base_laser.R()(2, 2) >= std::cos(kLevelTilt)) scan.level_height = sweep.T_base_laser.translation.z();
    scan.epoch = points.epoch;
    scans.push_back(scan);
    alive.push_back(sweep.scan);
    footprints.emplace_back(T_map_base.translation);
  }
};

NavigationMap::NavigationMap(const MapBuilderOptions& options, const LandmarkAcceptance& acceptance,
                             const NavigationTolerance& tolerance)
    : acceptance_(acceptance),
      tolerance_(tolerance),
      hit_sigma_(options.visual_hit_sigma),
      overhang_(options.overhang),
      legged_(options.legged),
      builder_(options) {
  if (options.layers != GridLayers::kFused) legged_.enabled = false;  // it takes both
}
NavigationMap::~NavigationMap() = default;
NavigationMap::NavigationMap(NavigationMap&&) noexcept = default;
NavigationMap& NavigationMap::operator=(NavigationMap&&) noexcept = default;

void NavigationMap::IntegrateSightings(const Evidence& evidence) {
  builder_.InsertPoints(evidence.points);
  for (const PosedScan& scan : evidence.scans) builder_.InsertScan(scan);
}

void NavigationMap::TakeOutSightings(const Evidence& evidence) {
  builder_.RemovePoints(evidence.points);
  for (const PosedScan& scan : evidence.scans) builder_.RemoveScan(scan);
}

void NavigationMap::TakeOut(const std::vector<KeyframeId>& outdated) {
  std::map<int, std::vector<KeyframeId>> outdated_in;  // epoch
  for (const KeyframeId id : outdated) outdated_in[EpochOf(id)].push_back(id);
  for (const auto& [epoch, ids] : outdated_in) TakeOut(epoch, ids);
}

// One by one costs what integrating costs: where less of the epoch stays than goes, it starts over with what stays.
void NavigationMap::TakeOut(int epoch, const std::vector<KeyframeId>& outdated) {
  const KeyframeId first{static_cast<std::uint32_t>(epoch) * kKeyframesInEpoch};
  const auto end = held_.lower_bound(KeyframeId{first.value + kKeyframesInEpoch});
  const bool start_over =
      2 * static_cast<std::ptrdiff_t>(outdated.size()) > std::distance(held_.lower_bound(first), end);
  if (start_over) builder_.RemoveEpoch(epoch);
  for (const KeyframeId id : outdated) {
    const auto entry = held_.find(id);
    if (!start_over) TakeOutSightings(entry->second);
    for (const Eigen::Vector2d& footprint : entry->second.footprints) builder_.UnmarkFootprint(footprint);
    held_.erase(entry);
  }
  if (!start_over) return;
  for (auto entry = held_.lower_bound(first); entry != end; ++entry) IntegrateSightings(entry->second);
}

int NavigationMap::Update(const Map& map, const CameraModel& camera) {
  const AcceptedLandmarks accepted =
      map.metric ? AcceptLandmarks(map, camera, acceptance_, hit_sigma_) : AcceptedLandmarks{};
  std::map<KeyframeId, Evidence> wanted;  // of the keyframes that are new or have moved
  for (const auto& [id, keyframe] : map.keyframes) {
    if (!map.metric) break;
    Evidence evidence(map, id, accepted);
    const auto held = held_.find(id);
    if (held != held_.end() && !evidence.DiffersFrom(held->second, tolerance_)) continue;
    wanted.emplace_hint(wanted.end(), id, std::move(evidence));
  }
  std::vector<KeyframeId> outdated;
  for (const auto& [id, evidence] : held_) {
    if (!map.metric || !map.keyframes.Contains(id) || wanted.count(id) != 0) outdated.push_back(id);
  }
  TakeOut(outdated);
  for (auto& [id, evidence] : wanted) {
    IntegrateSightings(evidence);
    for (const Eigen::Vector2d& footprint : evidence.footprints) builder_.MarkFootprint(footprint);
    held_.emplace(id, std::move(evidence));
  }
  builder_.SetOverhangs(Overhangs(map, accepted));
  return static_cast<int>(std::max(outdated.size(), wanted.size()));
}

std::vector<Overhang> NavigationMap::Overhangs(const Map& map, const AcceptedLandmarks& accepted) const {
  LeggedEvidence evidence;
  std::vector<Eigen::Vector3d> sure;  // depth's errors spread points of a wall over a level band, too
  for (const auto& [id, landmark] : accepted) {
    const Eigen::Vector3d& p_map = map.landmarks.At(id).p_map;
    evidence.points.push_back(p_map);
    if (landmark.least_sigma <= hit_sigma_) sure.push_back(p_map);
  }
  for (const auto& [id, held] : held_) {
    evidence.path.insert(evidence.path.end(), held.footprints.begin(), held.footprints.end());
    for (const PosedPoint& point : held.points.points) {
      evidence.sight_lines.push_back({held.points.camera_in_map, point.p_map});
    }
  }
  constexpr double kRim = 0.1;  // m, within which lines that pass beside a face may seem to pass through it
  std::vector<Overhang> overhangs;
  for (Overhang& face : FindOverhangs(sure, overhang_)) {
    const int lines = LinesThrough(evidence.sight_lines, face, face.height, kRim, 2.0 * overhang_.thickness);
    if (lines < overhang_.min_sight_lines) overhangs.push_back(std::move(face));
  }
  if (!legged_.enabled) return overhangs;
  evidence.laser = builder_.LaserGrid();
  for (Overhang& legged : FindLegged(evidence, legged_, overhang_)) overhangs.push_back(std::move(legged));
  return overhangs;
}

MapBuilder BuildNavigationMap(const Map& map, const CameraModel& camera, const MapBuilderOptions& options,
                              const LandmarkAcceptance& acceptance) {
  NavigationMap navigation(options, acceptance, NavigationTolerance{});
  navigation.Update(map, camera);
  return std::move(navigation).builder();
}

std::vector<CloudPoint> LandmarkCloud(const Map& map) {
  std::vector<CloudPoint> cloud;
  cloud.reserve(map.landmarks.size());
  for (const auto& [id, landmark] : map.landmarks) {
    const Eigen::Vector3d towards = -landmark.view_direction;
    cloud.push_back(
        {landmark.p_map.cast<float>(), towards.cast<float>(), static_cast<float>(landmark.observations.size())});
  }
  return cloud;
}

}  // namespace planar_vslam
