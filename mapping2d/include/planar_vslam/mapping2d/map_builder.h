#pragma once
// From posed scans and posed points to an OctoMap and a 2D grid. Plain values in: no map, no ROS.
//  - Points: one ray from the observing keyframe's camera centre, free up to two depth sigmas before the point; a hit
//    counts as far as the depth's distribution lies in the point's voxel.
//  - Scans: own sensor model and layer, beams without return clear only. A laser mounted level stays level: what its
//    pose estimate tilts or bobs is ignored.
//  - Within one keyframe or scan occupied wins over free, and the order of its points or beams does not matter.
//  - Points on or below the floor clear only; the robot's footprint along the path is free.
//  - What was inserted can be removed again: the result depends on what is in it, never on how it came there.
// mapping2d/README.md has the reasons and the measurements behind the defaults.
#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/mapping2d/legged.h"
#include "planar_vslam/mapping2d/overhang.h"

namespace planar_vslam {

struct SensorModel {
  double p_hit = 0.7;
  double p_miss = 0.4;
};

// What the grid and the OctoMap are made of.
enum class GridLayers { kFused, kLaser, kVisual };

struct MapBuilderOptions {
  GridLayers layers = GridLayers::kFused;
  double resolution = 0.05;
  SensorModel visual{0.62, 0.45};  // a hit weighs less than occupied_threshold: two keyframes have to agree
  SensorModel laser{0.70, 0.40};   // OctoMap's
  double clamp_min = 0.12;
  double clamp_max = 0.97;
  double visual_range = 6.0;
  double visual_hit_sigma = 0.05;
  double laser_range = 8.0;
  double floor_tolerance = 0.05;
  double tilt_sigma = DegreesToRadians(0.5);
  double band_min = 0.10;  // a laser counts from the floor up
  double band_max = 1.30;
  double footprint_radius = 0.20;
  double occupied_threshold = 0.65;
  double free_threshold = 0.35;
  OverhangOptions overhang;
  LeggedOptions legged;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr Bound kHit = bound::Between(0.5, 1.0), kMiss = bound::Between(0.0, 0.5);
    v("layers", o.layers,
      {{"fused", GridLayers::kFused}, {"laser", GridLayers::kLaser}, {"visual", GridLayers::kVisual}},
      "what they are made of: fused, laser (sweeps) or visual (points)");
    v("resolution", o.resolution, unit::kMeters, bound::Positive(), "voxels and cells");
    v("visual_p_hit", o.visual.p_hit, unit::kNone, kHit, "probability that a voxel is occupied where a point lies");
    v("visual_p_miss", o.visual.p_miss, unit::kNone, kMiss, "probability that it is where a ray to a point passes");
    v("laser_p_hit", o.laser.p_hit, unit::kNone, kHit, "the same for the laser");
    v("laser_p_miss", o.laser.p_miss, unit::kNone, kMiss, "the same for the laser");
    v("clamp_min", o.clamp_min, unit::kNone, bound::Positive().And(bound::LessThan("free_threshold", o.free_threshold)),
      "probability a voxel never falls below");
    v("clamp_max", o.clamp_max, unit::kNone,
      bound::MoreThan("occupied_threshold", o.occupied_threshold).And(bound::LessThan(1.0)),
      "probability a voxel never exceeds");
    v("visual_range", o.visual_range, unit::kMeters, bound::Positive(), "points farther away only clear up to it");
    v("visual_hit_sigma", o.visual_hit_sigma, unit::kMeters, bound::Positive(),
      "points less certain in depth only clear");
    v("laser_range", o.laser_range, unit::kMeters, bound::Positive(), "never beyond the scan's own");
    v("floor_tolerance", o.floor_tolerance, unit::kMeters, bound::AtLeast(0.0), "what ends below it only clears");
    v("tilt_sigma_deg", o.tilt_sigma, unit::kDegrees, bound::AtLeast(0.0).And(bound::LessThan(45.0)),
      "error of the camera's tilt that may lift floor points");
    v("band_min", o.band_min, unit::kMeters, bound::AtLeast(0.0), "heights from here...");
    v("band_max", o.band_max, unit::kMeters, bound::MoreThan("band_min", o.band_min),
      "...to here (the robot's) count as obstacles");
    v("footprint_radius", o.footprint_radius, unit::kMeters, bound::AtLeast(0.0),
      "free along the path; 0 switches it off");
    v("occupied_threshold", o.occupied_threshold, unit::kNone, bound::AtLeast(0.5).And(bound::LessThan(1.0)),
      "probability from which a voxel is occupied");
    v("free_threshold", o.free_threshold, unit::kNone, bound::Positive().And(bound::AtMost(0.5)),
      "probability below which a voxel is free");
    OverhangOptions::Visit(o.overhang, v);
    LeggedOptions::Visit(o.legged, v);
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

// A landmark as one camera saw it. Finite numbers.
struct PosedPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  double depth_sigma = 0.0;  // m, along the ray
  bool blocks = true;        // otherwise the ray clears only
};
// `epoch` is the stretch of the drive an observation belongs to: of two that disagree the later one is believed.
struct PosedPoints {
  Eigen::Vector3d camera_in_map = Eigen::Vector3d::Zero();
  std::vector<PosedPoint> points;
  int epoch = 0;
};
struct PosedScan {
  Rigid3 T_map_laser;
  double angle_min = 0.0, angle_increment = 0.0;  // rad
  double range_min = 0.0, range_max = 0.0;        // m
  const std::vector<float>* ranges = nullptr;     // not owned, alive during the call
  // m above the floor, of a laser mounted level: then height and tilt of the pose do not count. Absent: the beams are
  // traced in space as the pose has them.
  std::optional<double> level_height = std::nullopt;
  int epoch = 0;
};

// A leaf of the OctoMap: 2^n voxels wide.
struct OccupiedCube {
  Eigen::Vector3f center = Eigen::Vector3f::Zero();  // map, m
  float size = 0.0F;                                 // m
};

// Occupied or free, as in a .bt file, or with log-odds, as in an .ot file.
enum class OctomapForm { kBinary, kFull };

class MapBuilder {
 public:
  explicit MapBuilder(const MapBuilderOptions& options);
  ~MapBuilder();
  MapBuilder(MapBuilder&&) noexcept;
  MapBuilder& operator=(MapBuilder&&) noexcept;

  void InsertPoints(const PosedPoints& points);
  void InsertScan(const PosedScan& scan);
  void MarkFootprint(const Eigen::Vector2d& base_in_map);
  // Each takes out what was put in with equal values.
  void RemovePoints(const PosedPoints& points);
  void RemoveScan(const PosedScan& scan);
  void UnmarkFootprint(const Eigen::Vector2d& base_in_map);
  // Takes out all points and scans of the epoch, at once: where most of them move, faster than one by one.
  void RemoveEpoch(int epoch);
  // Heights that Grid() takes for obstacles from now on, in place of the options': m, 0 <= band_min < band_max.
  void SetBand(double band_min, double band_max);
  // Horizontal faces that block the cells below them, in place of the ones set before.
  void SetOverhangs(std::vector<Overhang> overhangs);
  const std::vector<Overhang>& overhangs() const;
  void Clear();

  // Height band of the fused map: occupied where an occupied voxel lies in the band, free where there are free voxels
  // and no occupied one, unknown elsewhere; cells below an overhang are occupied, footprint cells free. In voxels that
  // scans and points both know the log-odds add. Bounds grow with the content and lie on multiples of the resolution.
  OccupancyGrid2d Grid() const;
  // What the laser alone saw, at all heights, without footprints.
  OccupancyGrid2d LaserGrid() const;
  // The fused voxels that are occupied or free, as OctoMap's .bt, or with probabilities where the name ends in .ot.
  Expected<bool> WriteOctomap(const std::filesystem::path& path) const;
  // The same as octomap_msgs/Octomap carries it, id "OcTree": a file's data without its text header. Empty where
  // nothing is known.
  std::string OctomapData(OctomapForm form) const;
  // The occupied leaves of what WriteOctomap writes as .bt: eight full neighbours are one cube.
  std::vector<OccupiedCube> OccupiedCubes() const;
  std::size_t VoxelCount() const;  // known to the layers in use
  std::size_t MemoryBytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Points with normals (the mean viewing direction, towards the cameras) and intensity (observations), as binary PCD or
// PLY (properties x y z nx ny nz intensity).
struct CloudPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float intensity = 0.0F;
};
Expected<bool> WritePcd(const std::vector<CloudPoint>& cloud, const std::filesystem::path& path);
Expected<bool> WritePly(const std::vector<CloudPoint>& cloud, const std::filesystem::path& path);

// One point a cube of `size` m: their mean, with the mean normal and the sum of the intensities. By first occurrence.
std::vector<CloudPoint> VoxelFiltered(const std::vector<CloudPoint>& cloud, double size);
// Normals of the planes through the points within `radius`, on the side of the normals before; those with fewer than
// four others there keep theirs.
void EstimateNormals(double radius, std::vector<CloudPoint>* cloud);

// Keeps points with at least `min_neighbors` others within `radius` (PCL radius outlier removal): indices kept,
// ascending.
std::vector<int> RadiusInliers(const std::vector<Eigen::Vector3d>& points, double radius, int min_neighbors);

}  // namespace planar_vslam
