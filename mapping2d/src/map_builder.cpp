#include "planar_vslam/mapping2d/map_builder.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "occupancy_layer.h"

namespace planar_vslam {
namespace {

// A laser within this of level is level, and the rest is the pose estimate's tilt error (below 1 deg for a floor
// robot); lasers tilted on purpose look down by more.
constexpr double kLevelTilt = DegreesToRadians(3.0);

constexpr double kLatticeReach = 32768.0;  // voxels each way from the origin: an octomap::OcTreeKey has 16 bits

// How much of a point's depth distribution, a normal one, lies in its own voxel.
double ShareInVoxel(double depth_sigma, double resolution) {
  return depth_sigma > 0.0 ? std::erf(0.5 * resolution / (M_SQRT2 * depth_sigma)) : 1.0;
}

enum class Verdict : std::int8_t { kUnknown = -1, kFree = 0, kOccupied = 100 };  // as in OccupancyGrid2d::cells

// A cell of the lattice whose cell (0, 0) has its corner at the origin of `map`.
struct Cell {
  Eigen::Vector2i at;
  Verdict verdict;
};

// Of several verdicts on one cell occupied wins over free, except that `surely_free` cells are free.
OccupancyGrid2d Raster(const std::vector<Cell>& cells, const std::vector<Eigen::Vector2i>& surely_free,
                       double resolution) {
  OccupancyGrid2d grid;
  grid.resolution = resolution;
  if (cells.empty() && surely_free.empty()) return grid;
  Eigen::Array2i low = Eigen::Array2i::Constant(std::numeric_limits<int>::max());
  Eigen::Array2i high = Eigen::Array2i::Constant(std::numeric_limits<int>::min());
  const auto include = [&](const Eigen::Vector2i& at) {
    low = low.min(at.array());
    high = high.max(at.array());
  };
  for (const Cell& cell : cells) include(cell.at);
  for (const Eigen::Vector2i& at : surely_free) include(at);
  grid.width = high.x() - low.x() + 1;
  grid.height = high.y() - low.y() + 1;
  grid.origin = resolution * low.cast<double>().matrix();
  grid.cells.assign(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height), -1);
  const auto value = [&](const Eigen::Vector2i& at) -> std::int8_t& {
    const auto row = static_cast<std::size_t>(at.y() - low.y()), column = static_cast<std::size_t>(at.x() - low.x());
    return grid.cells[row * static_cast<std::size_t>(grid.width) + column];
  };
  for (const Cell& cell : cells) value(cell.at) = std::max(value(cell.at), static_cast<std::int8_t>(cell.verdict));
  for (const Eigen::Vector2i& at : surely_free) value(at) = static_cast<std::int8_t>(Verdict::kFree);
  return grid;
}

// OctoMap's .bt format: a text header, then two bits a node. OcTree::writeBinary does the same but talks on stderr.
bool WriteBinaryTree(octomap::OcTree& tree, std::ostream& out) {
  tree.toMaxLikelihood();
  tree.prune();
  out << "# Octomap OcTree binary file\nid " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
      << tree.getResolution() << "\ndata\n";
  if (tree.size() > 0) tree.writeBinaryData(out);
  return out.good();
}

}  // namespace

struct MapBuilder::State {
  MapBuilderOptions options;
  OccupancyLayer visual, laser;
  double occupied_log_odds, free_log_odds;
  std::vector<double> laser_heights;  // m, centres of the voxel layers that level lasers write to
  std::vector<Eigen::Vector2d> footprints;

  explicit State(const MapBuilderOptions& o)
      : options(o),
        visual(o.visual, o.resolution, o.clamp_min, o.clamp_max),
        laser(o.laser, o.resolution, o.clamp_min, o.clamp_max),
        occupied_log_odds(LogOdds(o.occupied_threshold)),
        free_log_odds(LogOdds(o.free_threshold)) {}

  // The height a level laser's evidence goes to: one layer of voxels for all scans within a voxel of it, so that the
  // pose estimate's jitter in height does not split what belongs together.
  double LaserHeight(double height) {
    for (const double layer : laser_heights) {
      if (std::abs(layer - height) <= options.resolution) return layer;
    }
    laser_heights.push_back((std::floor(height / options.resolution) + 0.5) * options.resolution);
    return laser_heights.back();
  }

  Verdict Judge(double log_odds) const {
    if (log_odds >= occupied_log_odds) return Verdict::kOccupied;
    return log_odds < free_log_odds ? Verdict::kFree : Verdict::kUnknown;
  }

  // Cells whose centre the robot's footprint covered.
  std::vector<Eigen::Vector2i> FootprintCells() const {
    std::vector<Eigen::Vector2i> cells;
    const double radius = options.footprint_radius / options.resolution;  // cells
    const int reach = static_cast<int>(std::ceil(radius));
    for (const Eigen::Vector2d& footprint : footprints) {
      const Eigen::Vector2d p = footprint / options.resolution;
      const Eigen::Vector2i middle = p.array().floor().cast<int>();
      for (int y = middle.y() - reach; y <= middle.y() + reach; ++y) {
        for (int x = middle.x() - reach; x <= middle.x() + reach; ++x) {
          if ((Eigen::Vector2d(x + 0.5, y + 0.5) - p).norm() <= radius) cells.emplace_back(x, y);
        }
      }
    }
    return cells;
  }

  // Calls visit(key, log_odds, known_to_laser) once for each voxel that a layer knows; where both do, log-odds add.
  template <class Visitor>
  void VisitFused(const Visitor& visit) const {
    for (const Voxel& voxel : visual.table().voxels()) {
      const Voxel* other = laser.table().Find(voxel.key);
      visit(Unpack(voxel.key), voxel.log_odds + (other != nullptr ? other->log_odds : 0.0F), other != nullptr);
    }
    for (const Voxel& voxel : laser.table().voxels()) {
      if (visual.table().Find(voxel.key) == nullptr) visit(Unpack(voxel.key), voxel.log_odds, true);
    }
  }
};

std::vector<std::string> MapBuilderOptions::Problems() const {
  std::vector<std::string> problems;
  const auto require = [&](bool holds, const std::string& problem) {
    if (!holds) problems.push_back(problem);
  };
  const auto finite_above = [](double value, double bound) { return std::isfinite(value) && value > bound; };
  require(finite_above(resolution, 0.0), "resolution: expected metres above 0");
  require(visual.p_hit > 0.5 && visual.p_hit < 1.0, "visual.p_hit: expected a probability above 0.5");
  require(visual.p_miss > 0.0 && visual.p_miss < 0.5, "visual.p_miss: expected a probability below 0.5");
  require(laser.p_hit > 0.5 && laser.p_hit < 1.0, "laser.p_hit: expected a probability above 0.5");
  require(laser.p_miss > 0.0 && laser.p_miss < 0.5, "laser.p_miss: expected a probability below 0.5");
  require(occupied_threshold >= 0.5 && occupied_threshold < 1.0, "occupied_threshold: expected a probability from 0.5");
  require(free_threshold > 0.0 && free_threshold <= 0.5, "free_threshold: expected a probability up to 0.5");
  require(clamp_min > 0.0 && clamp_min < free_threshold, "clamp_min: expected a probability below free_threshold");
  require(clamp_max > occupied_threshold && clamp_max < 1.0,
          "clamp_max: expected a probability above occupied_threshold");
  require(finite_above(visual_range, 0.0), "visual_range: expected metres above 0");
  require(finite_above(laser_range, 0.0), "laser_range: expected metres above 0");
  require(std::isfinite(floor_tolerance) && floor_tolerance >= 0.0, "floor_tolerance: expected metres, not negative");
  require(finite_above(band_max, band_min) && band_min >= 0.0, "band_min, band_max: expected 0 <= band_min < band_max");
  require(std::isfinite(footprint_radius) && footprint_radius >= 0.0,
          "footprint_radius: expected metres, not negative");
  return problems;
}

MapBuilder::MapBuilder(const MapBuilderOptions& options) {
  const std::vector<std::string> problems = options.Problems();
  PV_CHECK(problems.empty(), problems.front());
  state_ = std::make_unique<State>(options);
}
MapBuilder::~MapBuilder() = default;
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&&) noexcept = default;

void MapBuilder::InsertPoints(const PosedPoints& points) {
  const MapBuilderOptions& options = state_->options;
  OccupancyLayer& layer = state_->visual;
  const Eigen::Vector3d& camera = points.camera_in_map;
  for (const PosedPoint& point : points.points) {
    const Eigen::Vector3d ray = point.p_map - camera;
    const double distance = ray.norm();
    PV_CHECK(std::isfinite(distance) && std::isfinite(point.depth_sigma),
             "p_map=" << point.p_map.transpose() << " depth_sigma=" << point.depth_sigma);
    const double margin = std::max(2.0 * point.depth_sigma, 0.5 * options.resolution);
    const double free_distance = std::min(distance - margin, options.visual_range);
    if (free_distance > 0.0) layer.AddFreeRay(camera, camera + ray * (free_distance / distance));
    const bool above_floor = point.p_map.z() > options.floor_tolerance;
    if (above_floor && distance <= options.visual_range) {
      layer.AddHit(point.p_map, ShareInVoxel(point.depth_sigma, options.resolution));
    }
  }
  layer.Commit();
}

void MapBuilder::InsertScan(const PosedScan& scan) {
  PV_CHECK(scan.ranges != nullptr && scan.T_map_laser.translation.allFinite(), "no ranges, or no pose");
  const MapBuilderOptions& options = state_->options;
  const double limit = std::min(scan.range_max, options.laser_range);
  const Eigen::Matrix3d R_map_laser = scan.T_map_laser.R();
  const bool level = std::abs(R_map_laser(2, 2)) >= std::cos(kLevelTilt);
  Eigen::Vector3d origin = scan.T_map_laser.translation;
  if (level) origin.z() = state_->LaserHeight(origin.z());

  OccupancyLayer& layer = state_->laser;
  for (std::size_t i = 0; i < scan.ranges->size(); ++i) {
    const double range = (*scan.ranges)[i];
    if (range < scan.range_min || range <= 0.0) continue;  // too close to measure: says nothing
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    Eigen::Vector3d direction = R_map_laser.col(0) * std::cos(angle) + R_map_laser.col(1) * std::sin(angle);
    if (level) direction.z() = 0.0;
    const bool returned = std::isfinite(range) && range < limit;
    // A voxel short, so that a beam which grazes a surface under a slightly wrong pose does not clear it.
    const double free_distance = returned ? range - options.resolution : limit;
    if (free_distance > 0.0) layer.AddFreeRay(origin, origin + free_distance * direction);
    const Eigen::Vector3d end = origin + range * direction;
    if (returned && (level || end.z() > options.floor_tolerance)) layer.AddHit(end, 1.0);
  }
  layer.Commit();
}

void MapBuilder::MarkFootprint(const Eigen::Vector2d& base_in_map) {
  PV_CHECK(base_in_map.allFinite(), "base_in_map=" << base_in_map.transpose());
  const MapBuilderOptions& options = state_->options;
  const bool on_lattice = (base_in_map / options.resolution).cwiseAbs().maxCoeff() < kLatticeReach;
  if (options.footprint_radius > 0.0 && on_lattice) state_->footprints.push_back(base_in_map);
}

OccupancyGrid2d MapBuilder::Grid() const {
  const MapBuilderOptions& options = state_->options;
  const octomap::OcTree lattice(options.resolution);
  const int key_of_zero = lattice.coordToKey(0.0);
  std::vector<Cell> cells;
  state_->VisitFused([&](const octomap::OcTreeKey& key, float log_odds, bool known_to_laser) {
    const double z = lattice.keyToCoord(key[2]);
    const double lowest = known_to_laser ? 0.0 : options.band_min;  // the slice of a low laser counts
    const Verdict verdict = state_->Judge(log_odds);
    if (verdict == Verdict::kUnknown || z < lowest || z > options.band_max) return;
    cells.push_back({{key[0] - key_of_zero, key[1] - key_of_zero}, verdict});
  });
  return Raster(cells, state_->FootprintCells(), options.resolution);
}

Expected<bool> MapBuilder::WriteOctomap(const std::filesystem::path& path) const {
  const MapBuilderOptions& options = state_->options;
  octomap::OcTree fused(options.resolution);
  fused.setOccupancyThres(options.occupied_threshold);
  state_->VisitFused([&](const octomap::OcTreeKey& key, float log_odds, bool) {
    if (state_->Judge(log_odds) == Verdict::kUnknown) return;
    fused.setNodeValue(key, log_odds, /*lazy_eval=*/true);
  });
  if (fused.getRoot() != nullptr) fused.updateInnerOccupancy();
  std::ofstream file(path, std::ios::binary);
  const bool good = file && (path.extension() == ".ot" ? fused.write(file) : WriteBinaryTree(fused, file));
  if (!good || !file.flush()) {
    return Error{path.string() + ": cannot be written (is the folder there, and space left?)"};
  }
  return true;
}

std::size_t MapBuilder::VoxelCount() const {
  std::size_t count = 0;
  state_->VisitFused([&](const octomap::OcTreeKey&, float, bool) { ++count; });
  return count;
}

}  // namespace planar_vslam
