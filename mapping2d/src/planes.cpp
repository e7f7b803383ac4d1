#include "planar_vslam/mapping2d/planes.h"

#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_line.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/angles.h"
#include "quiet_pcl.h"

namespace planar_vslam {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

constexpr int kMaxIterations = 2000;  // of RANSAC: two points of a wall that holds 5 % of the cloud, with 99 %

pcl::PointXYZ ToPcl(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

// Indices into the model's cloud, ascending; empty where RANSAC finds no model.
template <class Model>
std::vector<int> RansacInliers(const std::shared_ptr<Model>& model, double thickness) {
  const QuietPcl quiet;
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, thickness);
  ransac.setMaxIterations(kMaxIterations);
  pcl::Indices inliers;
  if (ransac.computeModel()) ransac.getInliers(inliers);
  std::sort(inliers.begin(), inliers.end());
  return {inliers.begin(), inliers.end()};
}

FloorPlane FitFloor(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  FloorPlane floor;
  floor.normal = axes.eigenvectors().col(0);
  if (floor.normal.z() < 0.0) floor.normal = -floor.normal;
  floor.height = mean.z();
  floor.center = mean.head<2>();
  floor.points = static_cast<int>(points.size());
  floor.rms = std::sqrt(std::max(axes.eigenvalues()(0), 0.0) / static_cast<double>(points.size()));
  return floor;
}

// Seen from above, upright planes are lines: the points of the strongest one, taken out of `points`.
std::vector<Eigen::Vector3d> TakeLine(double thickness, std::vector<Eigen::Vector3d>* points) {
  const auto cloud = pcl::make_shared<Cloud>();
  for (const Eigen::Vector3d& p : *points) cloud->push_back(ToPcl(p.x(), p.y(), 0.0));
  const std::vector<int> inliers =
      RansacInliers(pcl::make_shared<pcl::SampleConsensusModelLine<pcl::PointXYZ>>(cloud), thickness);
  std::vector<Eigen::Vector3d> line, rest;
  std::size_t next = 0;
  for (std::size_t i = 0; i < points->size(); ++i) {
    const bool inlier = next < inliers.size() && static_cast<std::size_t>(inliers[next]) == i;
    if (inlier) ++next;
    (inlier ? line : rest).push_back((*points)[i]);
  }
  *points = std::move(rest);
  return line;
}

// The pieces of a line that no gap divides.
void AddPieces(const std::vector<Eigen::Vector3d>& line, const PlaneOptions& options, std::vector<WallPlane>* walls) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : line) mean += p.head<2>() / static_cast<double>(line.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : line) spread += (p.head<2>() - mean) * (p.head<2>() - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  const Eigen::Vector2d along = axes.eigenvectors().col(1), across = axes.eigenvectors().col(0);
  struct OnLine {
    double along, across, z;  // m
  };
  std::vector<OnLine> sorted;
  for (const Eigen::Vector3d& p : line) {
    sorted.push_back({along.dot(p.head<2>() - mean), across.dot(p.head<2>() - mean), p.z()});
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const OnLine& a, const OnLine& b) { return a.along < b.along; });
  for (std::size_t first = 0, last = 0; first < sorted.size(); first = last) {
    WallPlane wall;
    wall.bottom = wall.top = sorted[first].z;
    double squares = 0.0;
    for (; last < sorted.size(); ++last) {
      if (last > first && sorted[last].along - sorted[last - 1].along > options.wall_max_gap) break;
      wall.bottom = std::min(wall.bottom, sorted[last].z);
      wall.top = std::max(wall.top, sorted[last].z);
      squares += sorted[last].across * sorted[last].across;
    }
    wall.from = mean + sorted[first].along * along;
    wall.to = mean + sorted[last - 1].along * along;
    wall.points = static_cast<int>(last - first);
    wall.rms = std::sqrt(squares / wall.points);
    const bool is_wall = wall.points >= options.wall_min_points &&
                         (wall.to - wall.from).norm() >= options.wall_min_length &&
                         wall.top - wall.bottom >= options.wall_min_rise;
    if (is_wall) walls->push_back(wall);
  }
}

}  // namespace

double FloorPlane::TiltDegrees() const { return RadiansToDegrees(std::acos(std::min(normal.z(), 1.0))); }

double FloorPlane::HeightOf(const Eigen::Vector3d& p) const {
  return normal.dot(p - Eigen::Vector3d(center.x(), center.y(), height));
}

std::optional<FloorPlane> FindFloor(const std::vector<Eigen::Vector3d>& points, const PlaneOptions& options) {
  std::vector<Eigen::Vector3d> low;
  const auto cloud = pcl::make_shared<Cloud>();
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(p.z()) > options.floor_reach) continue;
    low.push_back(p);
    cloud->push_back(ToPcl(p.x(), p.y(), p.z()));
  }
  if (static_cast<int>(low.size()) < options.floor_min_points) return std::nullopt;
  const auto model = pcl::make_shared<pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>>(cloud);
  model->setAxis(Eigen::Vector3f::UnitZ());
  model->setEpsAngle(DegreesToRadians(options.floor_max_tilt_deg));
  std::vector<Eigen::Vector3d> on_plane;
  for (const int i : RansacInliers(model, options.thickness)) on_plane.push_back(low[static_cast<std::size_t>(i)]);
  if (static_cast<int>(on_plane.size()) < options.floor_min_points) return std::nullopt;
  const FloorPlane floor = FitFloor(on_plane);
  // Points all over the room fill every slab alike.
  int within = 0, above = 0, below = 0;
  for (const Eigen::Vector3d& p : low) {
    const double slabs = floor.HeightOf(p) / (2.0 * options.thickness);
    within += std::abs(slabs) <= 0.5 ? 1 : 0;
    above += slabs > 0.5 && slabs <= 1.5 ? 1 : 0;
    below += slabs < -0.5 && slabs >= -1.5 ? 1 : 0;
  }
  const bool stands_out = within > 2 * std::max(above, below);
  if (!stands_out || floor.TiltDegrees() > options.floor_max_tilt_deg) return std::nullopt;
  return floor;
}

std::vector<WallPlane> FindWalls(const std::vector<Eigen::Vector3d>& points, const PlaneOptions& options) {
  std::vector<WallPlane> walls;
  std::vector<Eigen::Vector3d> left;
  for (const Eigen::Vector3d& p : points) {
    if (p.z() >= options.wall_min_height) left.push_back(p);
  }
  while (static_cast<int>(left.size()) >= options.wall_min_points) {
    const std::vector<Eigen::Vector3d> line = TakeLine(options.wall_thickness, &left);
    if (static_cast<int>(line.size()) < options.wall_min_points) break;
    AddPieces(line, options, &walls);
  }
  std::stable_sort(walls.begin(), walls.end(),
                   [](const WallPlane& a, const WallPlane& b) { return a.points > b.points; });
  return walls;
}

}  // namespace planar_vslam
