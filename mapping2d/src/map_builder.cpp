#include "planar_vslam/mapping2d/map_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "grid_raster.h"
#include "level_fan.h"
#include "occupancy_layer.h"
#include "octomap_file.h"

namespace planar_vslam {
namespace {

// How much of a point's depth distribution, a normal one, lies in its own voxel.
double ShareInVoxel(double depth_sigma, double resolution) {
  return depth_sigma > 0.0 ? std::erf(0.5 * resolution / (M_SQRT2 * depth_sigma)) : 1.0;
}

// Of a point at `ray` from the camera: its depth's error along the ray, and the camera's tilt.
double HeightSigma(const Eigen::Vector3d& ray, double depth_sigma, const MapBuilderOptions& options) {
  const double distance = ray.norm();
  if (distance <= 0.0) return 0.0;
  return std::hypot(depth_sigma * ray.z() / distance, distance * options.tilt_sigma);
}

void Sight(const PosedPoints& points, const MapBuilderOptions& options, Sighting* sighting) {
  const Eigen::Vector3d& camera = points.camera_in_map;
  for (const PosedPoint& point : points.points) {
    const Eigen::Vector3d ray = point.p_map - camera;
    const double distance = ray.norm();
    PV_CHECK(std::isfinite(distance) && std::isfinite(point.depth_sigma),
             "p_map=" << point.p_map.transpose() << " depth_sigma=" << point.depth_sigma);
    const double margin = std::max(2.0 * point.depth_sigma, 0.5 * options.resolution);
    const double free_distance = std::min(distance - margin, options.visual_range);
    if (free_distance > 0.0) sighting->AddFreeRay(camera, camera + ray * (free_distance / distance));
    const bool above_floor =
        point.p_map.z() > options.floor_tolerance + 2.0 * HeightSigma(ray, point.depth_sigma, options);
    if (point.blocks && above_floor && distance <= options.visual_range &&
        point.depth_sigma <= options.visual_hit_sigma) {
      sighting->AddHit(point.p_map, ShareInVoxel(point.depth_sigma, options.resolution));
    }
  }
}

// The beams' directions, from `origin`, and what they measured.
struct Beams {
  Eigen::Vector3d origin;
  std::vector<std::pair<Eigen::Vector3d, double>> beams;
};
Beams BeamsOf(const PosedScan& scan) {
  PV_CHECK(scan.ranges != nullptr && scan.T_map_laser.translation.allFinite(), "no ranges, or no pose");
  const Eigen::Matrix3d R_map_laser = scan.T_map_laser.R();
  Beams result{scan.T_map_laser.translation, {}};
  const bool level = scan.level_height.has_value();
  if (level) result.origin.z() = *scan.level_height;
  result.beams.reserve(scan.ranges->size());
  for (std::size_t i = 0; i < scan.ranges->size(); ++i) {
    const double range = (*scan.ranges)[i];
    if (!(range >= scan.range_min) || range <= 0.0) continue;  // too close to measure, or not a number: says nothing
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    Eigen::Vector3d direction = R_map_laser.col(0) * std::cos(angle) + R_map_laser.col(1) * std::sin(angle);
    if (level) direction.z() = 0.0;
    result.beams.emplace_back(direction, range);
  }
  return result;
}

void Sight(const PosedScan& scan, const MapBuilderOptions& options, LevelFan* fan, Sighting* sighting) {
  const auto [origin, beams] = BeamsOf(scan);
  const double limit = std::min(scan.range_max, options.laser_range);
  const auto returned = [limit](double range) { return std::isfinite(range) && range < limit; };
  double reach = 0.0;
  for (const auto& [direction, range] : beams) reach = std::max(reach, std::min(range, limit));
  const bool level = scan.level_height.has_value(), in_fan = level && fan->Start(origin, reach);
  for (const auto& [direction, range] : beams) {
    // A voxel short, so that a beam which grazes a surface under a slightly wrong pose does not clear it.
    const double free_distance = returned(range) ? range - options.resolution : limit;
    if (free_distance <= 0.0) continue;
    const Eigen::Vector3d free_end = origin + free_distance * direction;
    in_fan ? fan->AddFreeRay(free_end) : sighting->AddFreeRay(origin, free_end);
  }
  if (in_fan) fan->AddTo(sighting);
  for (const auto& [direction, range] : beams) {
    const Eigen::Vector3d end = origin + range * direction;
    if (!returned(range) || !(level || end.z() > options.floor_tolerance)) continue;
    sighting->AddHit(end, 1.0);
    // Under a pose some centimetres wrong the beams that pass a thin leg cross the voxels it was hit in before.
    sighting->SpareAround(end);
  }
}

}  // namespace

struct MapBuilder::State {
  MapBuilderOptions options;
  OccupancyLayer visual, laser;
  Sighting sighting;                                 // empty between calls; keeps its memory
  LevelFan fan;                                      // of the scan at hand
  std::map<std::array<double, 2>, long> footprints;  // how often the robot was there
  std::vector<Overhang> overhangs;
  std::int32_t occupied_units, free_units;

  explicit State(const MapBuilderOptions& o)
      : options(o),
        visual(o.visual, o.clamp_min, o.clamp_max),
        laser(o.laser, o.clamp_min, o.clamp_max),
        sighting(o.resolution),
        fan(o.resolution),
        occupied_units(ToUnits(LogOdds(o.occupied_threshold))),
        free_units(ToUnits(LogOdds(o.free_threshold))) {}

  void Integrate(const PosedPoints& points, int times) {
    Sight(points, options, &sighting);
    Add(points.epoch, &visual, times);
  }
  void Integrate(const PosedScan& scan, int times) {
    Sight(scan, options, &fan, &sighting);
    Add(scan.epoch, &laser, times);
  }
  void Add(int epoch, OccupancyLayer* layer, int times) {
    layer->Add(sighting, epoch, times);
    sighting.Clear();
  }

  void CountFootprint(const Eigen::Vector2d& base_in_map, long times) {
    PV_CHECK(base_in_map.allFinite(), "base_in_map=" << base_in_map.transpose());
    // A footprint that leaves the lattice is ignored, as rays are.
    const double reach = (base_in_map.cwiseAbs().maxCoeff() + options.footprint_radius) / options.resolution;
    if (options.footprint_radius <= 0.0 || reach + 1.0 >= kLatticeReach) return;
    const auto entry = footprints.try_emplace({base_in_map.x(), base_in_map.y()}, 0).first;
    entry->second += times;
    if (entry->second == 0) footprints.erase(entry);
  }

  Verdict Judge(std::int32_t log_odds) const {
    if (log_odds >= occupied_units) return Verdict::kOccupied;
    return log_odds < free_units ? Verdict::kFree : Verdict::kUnknown;
  }

  // Calls visit(voxel, log_odds, known_to_laser) once for each voxel that a layer in use knows, blocks ascending by
  // column and height; where two know a voxel, log-odds add.
  template <class Visitor>
  void VisitFused(const Visitor& visit) const {
    using Blocks = std::vector<OccupancyLayer::FoldedBlock>;
    const Blocks points = options.layers == GridLayers::kLaser ? Blocks{} : visual.Fold();
    const Blocks scans = options.layers == GridLayers::kVisual ? Blocks{} : laser.Fold();
    auto p = points.begin();
    auto s = scans.begin();
    while (p != points.end() || s != scans.end()) {
      const bool take_p = p != points.end() && (s == scans.end() || p->key <= s->key);
      const bool take_s = s != scans.end() && (p == points.end() || s->key <= p->key);
      const BlockKey key = take_p ? p->key : s->key;
      for (int cell = 0; cell < kBlockCells; ++cell) {
        const auto i = static_cast<std::size_t>(cell);
        const std::int32_t from_points = take_p ? p->log_odds[i] : OccupancyLayer::kUnknown;
        const std::int32_t from_scans = take_s ? s->log_odds[i] : OccupancyLayer::kUnknown;
        const bool seen = from_points != OccupancyLayer::kUnknown, scanned = from_scans != OccupancyLayer::kUnknown;
        if (!seen && !scanned) continue;
        visit(VoxelAt(key, cell), (seen ? from_points : 0) + (scanned ? from_scans : 0), scanned);
      }
      if (take_p) ++p;
      if (take_s) ++s;
    }
  }

  std::vector<OctomapVoxel> KnownVoxels() const {
    std::vector<OctomapVoxel> voxels;
    VisitFused([&](const VoxelIndex& voxel, std::int32_t log_odds, bool) {
      if (Judge(log_odds) == Verdict::kUnknown) return;
      voxels.push_back({voxel, static_cast<float>(log_odds / kUnitsPerNat)});
    });
    return voxels;
  }
};

MapBuilder::MapBuilder(const MapBuilderOptions& options) {
  const std::vector<std::string> problems = options.Problems();
  PV_CHECK(problems.empty(), problems.front());
  state_ = std::make_unique<State>(options);
}
MapBuilder::~MapBuilder() = default;
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&&) noexcept = default;

void MapBuilder::InsertPoints(const PosedPoints& points) { state_->Integrate(points, 1); }
void MapBuilder::RemovePoints(const PosedPoints& points) { state_->Integrate(points, -1); }
void MapBuilder::InsertScan(const PosedScan& scan) { state_->Integrate(scan, 1); }
void MapBuilder::RemoveScan(const PosedScan& scan) { state_->Integrate(scan, -1); }
void MapBuilder::MarkFootprint(const Eigen::Vector2d& base_in_map) { state_->CountFootprint(base_in_map, 1); }
void MapBuilder::UnmarkFootprint(const Eigen::Vector2d& base_in_map) { state_->CountFootprint(base_in_map, -1); }

void MapBuilder::RemoveEpoch(int epoch) {
  state_->visual.RemoveEpoch(epoch);
  state_->laser.RemoveEpoch(epoch);
}

void MapBuilder::SetBand(double band_min, double band_max) {
  PV_CHECK(band_min >= 0.0 && band_min < band_max, "band_min=" << band_min << " band_max=" << band_max);
  state_->options.band_min = band_min;
  state_->options.band_max = band_max;
}

void MapBuilder::SetOverhangs(std::vector<Overhang> overhangs) { state_->overhangs = std::move(overhangs); }
const std::vector<Overhang>& MapBuilder::overhangs() const { return state_->overhangs; }

void MapBuilder::Clear() {
  state_->visual.Clear();
  state_->laser.Clear();
  state_->footprints.clear();
  state_->overhangs.clear();
}

OccupancyGrid2d MapBuilder::Grid() const {
  const MapBuilderOptions& options = state_->options;
  GridRaster raster;
  state_->VisitFused([&](const VoxelIndex& voxel, std::int32_t log_odds, bool known_to_laser) {
    const double z = (voxel.z - kLatticeReach + 0.5) * options.resolution;
    const double lowest = known_to_laser ? 0.0 : options.band_min;  // the slice of a low laser counts
    if (z >= lowest && z <= options.band_max) raster.Add(voxel.x, voxel.y, state_->Judge(log_odds));
  });
  if (options.layers != GridLayers::kLaser) {
    for (const Overhang& overhang : state_->overhangs) {
      for (const Eigen::Vector2i& cell : CellsOf(overhang, options.resolution)) {
        raster.Add(cell.x(), cell.y(), Verdict::kOccupied);
      }
    }
  }
  for (const auto& [position, times] : state_->footprints) {
    const Eigen::Vector2d center(position[0], position[1]);
    for (const Eigen::Vector2i& cell : DiscCells(center, options.footprint_radius, options.resolution)) {
      raster.Set(cell.x(), cell.y(), Verdict::kFree);
    }
  }
  return raster.ToGrid(options.resolution);
}

OccupancyGrid2d MapBuilder::LaserGrid() const {
  GridRaster raster;
  for (const OccupancyLayer::FoldedBlock& block : state_->laser.Fold()) {
    for (int cell = 0; cell < kBlockCells; ++cell) {
      const std::int32_t log_odds = block.log_odds[static_cast<std::size_t>(cell)];
      const VoxelIndex at = VoxelAt(block.key, cell);
      if (log_odds != OccupancyLayer::kUnknown) raster.Add(at.x, at.y, state_->Judge(log_odds));
    }
  }
  return raster.ToGrid(state_->options.resolution);
}

Expected<bool> MapBuilder::WriteOctomap(const std::filesystem::path& path) const {
  return WriteOctomapFile(state_->KnownVoxels(), state_->options.resolution, state_->options.occupied_threshold, path);
}

std::string MapBuilder::OctomapData(OctomapForm form) const {
  return OctomapStream(state_->KnownVoxels(), state_->options.resolution, state_->options.occupied_threshold, form);
}

std::vector<OccupiedCube> MapBuilder::OccupiedCubes() const {
  return OccupiedLeaves(state_->KnownVoxels(), state_->options.resolution, state_->options.occupied_threshold);
}

std::size_t MapBuilder::VoxelCount() const {
  std::size_t count = 0;
  state_->VisitFused([&](const VoxelIndex&, std::int32_t, bool) { ++count; });
  return count;
}

std::size_t MapBuilder::MemoryBytes() const { return state_->visual.MemoryBytes() + state_->laser.MemoryBytes(); }

}  // namespace planar_vslam
