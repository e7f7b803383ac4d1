#include "planar_vslam/mapping2d/overhang.h"

#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/concave_hull.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/geometry/check.h"
#include "quiet_pcl.h"

namespace planar_vslam {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// Whether the points around `p` lie in a level patch: their spread is least along the vertical.
bool IsLevel(const Cloud& cloud, const std::vector<int>& neighbors, double max_tilt) {
  constexpr std::size_t kFewest = 4;  // three always lie in a plane
  if (neighbors.size() < kFewest) return false;
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const int i : neighbors) mean += cloud[static_cast<std::size_t>(i)].getVector3fMap();
  mean /= static_cast<float>(neighbors.size());
  Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
  for (const int i : neighbors) {
    const Eigen::Vector3f d = cloud[static_cast<std::size_t>(i)].getVector3fMap() - mean;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> axes(spread);
  return std::abs(axes.eigenvectors()(2, 0)) >= std::cos(max_tilt);
}

Cloud::Ptr LevelPoints(const std::vector<Eigen::Vector3d>& points, const OverhangOptions& options) {
  const Cloud::Ptr cloud(new Cloud), level(new Cloud);
  for (const Eigen::Vector3d& p : points) {
    if (p.z() < options.min_height - options.thickness || p.z() > options.max_height) continue;
    const Eigen::Vector3f f = p.cast<float>();
    cloud->push_back(pcl::PointXYZ(f.x(), f.y(), f.z()));
  }
  if (cloud->empty()) return level;
  pcl::search::KdTree<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  std::vector<int> neighbors;
  std::vector<float> squared_distances;
  for (const pcl::PointXYZ& p : *cloud) {
    tree.radiusSearch(p, options.neighborhood, neighbors, squared_distances);
    if (IsLevel(*cloud, neighbors, options.max_tilt)) level->push_back(p);
  }
  return level;
}

// Parts of a face whose points are at most `gap` apart, each with its points in ascending order of index.
std::vector<std::vector<int>> Patches(const Cloud::ConstPtr& face, double gap) {
  pcl::search::KdTree<pcl::PointXYZ> tree;
  tree.setInputCloud(face);
  std::vector<std::vector<int>> patches;
  std::vector<char> taken(face->size(), 0);
  std::vector<int> neighbors;
  std::vector<float> squared_distances;
  for (std::size_t seed = 0; seed < face->size(); ++seed) {
    if (taken[seed] != 0) continue;
    std::vector<int> patch = {static_cast<int>(seed)};
    taken[seed] = 1;
    for (std::size_t next = 0; next < patch.size(); ++next) {
      tree.radiusSearch((*face)[static_cast<std::size_t>(patch[next])], gap, neighbors, squared_distances);
      for (const int i : neighbors) {
        if (taken[static_cast<std::size_t>(i)] == 0) patch.push_back(i);
        taken[static_cast<std::size_t>(i)] = 1;
      }
    }
    std::sort(patch.begin(), patch.end());
    patches.push_back(std::move(patch));
  }
  return patches;
}

Overhang Outline(const Cloud& face, const std::vector<int>& patch, double height, double max_gap) {
  const Cloud::Ptr flat(new Cloud);
  for (const int i : patch) {
    const pcl::PointXYZ& p = face[static_cast<std::size_t>(i)];
    flat->push_back(pcl::PointXYZ(p.x, p.y, static_cast<float>(height)));
  }
  pcl::ConcaveHull<pcl::PointXYZ> hull;
  hull.setInputCloud(flat);
  hull.setDimension(2);
  // Triangles with a circumscribed circle of at most this radius are filled: no empty disc of that size fits in.
  hull.setAlpha(0.5 * max_gap);
  Cloud corners;
  std::vector<pcl::Vertices> loops;
  hull.reconstruct(corners, loops);
  Overhang overhang;
  overhang.height = height;
  for (const pcl::Vertices& loop : loops) {
    overhang.outlines.emplace_back();
    for (const auto corner : loop.vertices) {
      const pcl::PointXYZ& p = corners[static_cast<std::size_t>(corner)];
      overhang.outlines.back().emplace_back(p.x, p.y);
    }
  }
  return overhang;
}

// Takes the points of the largest level plane out of `cloud`; none when it has less than `min_points`.
Cloud::Ptr TakeFace(Cloud* cloud, const OverhangOptions& options, double* height) {
  const Cloud::Ptr face(new Cloud), rest(new Cloud);
  if (static_cast<int>(cloud->size()) < options.min_points) return face;
  const auto model = pcl::make_shared<pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>>(cloud->makeShared());
  model->setAxis(Eigen::Vector3f::UnitZ());
  model->setEpsAngle(DegreesToRadians(3.0));  // of the plane as a whole: several sigmas of the floor's tilt in the map
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, options.thickness);
  pcl::Indices inliers;
  const QuietPcl quiet;
  if (ransac.computeModel()) ransac.getInliers(inliers);
  std::sort(inliers.begin(), inliers.end());
  if (static_cast<int>(inliers.size()) < options.min_points) return face;
  double sum = 0.0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const bool inlier = next < inliers.size() && static_cast<std::size_t>(inliers[next]) == i;
    (inlier ? face : rest)->push_back((*cloud)[i]);
    if (inlier) sum += (*cloud)[i].z, ++next;
  }
  *height = sum / static_cast<double>(face->size());
  *cloud = *rest;
  return face;
}

}  // namespace

bool Overhang::Contains(const Eigen::Vector2d& p) const {
  bool inside = false;
  for (const std::vector<Eigen::Vector2d>& loop : outlines) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d& a = loop[i];
      const Eigen::Vector2d& b = loop[(i + 1) % loop.size()];
      const bool crosses = (a.y() > p.y()) != (b.y() > p.y());
      if (crosses && p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
    }
  }
  return inside;
}

std::vector<Overhang> FindOverhangs(const std::vector<Eigen::Vector3d>& points, const OverhangOptions& options) {
  const std::vector<std::string> problems = options.Problems();
  PV_CHECK(problems.empty(), problems.front());
  std::vector<Overhang> overhangs;
  if (!options.enabled) return overhangs;
  const Cloud::Ptr cloud = LevelPoints(points, options);
  double height = 0.0;
  for (Cloud::Ptr face = TakeFace(cloud.get(), options, &height); !face->empty();
       face = TakeFace(cloud.get(), options, &height)) {
    for (const std::vector<int>& patch : Patches(face, options.max_gap)) {
      if (static_cast<int>(patch.size()) < options.min_points) continue;
      overhangs.push_back(Outline(*face, patch, height, options.max_gap));
    }
  }
  return overhangs;
}

}  // namespace planar_vslam
