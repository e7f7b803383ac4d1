#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>

#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam {
namespace {

Error CannotWrite(const std::filesystem::path& path) {
  return {path.string() + ": cannot be written (is the folder there, and space left?)"};
}

std::string LittleEndian(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  std::string bytes;
  for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(bits >> shift & 0xFFU));
  return bytes;
}

}  // namespace

Expected<bool> WritePcd(const std::vector<CloudPoint>& cloud, const std::filesystem::path& path) {
  const Error cannot_write = CannotWrite(path);
  pcl::PointCloud<pcl::PointXYZINormal> points;
  points.reserve(cloud.size());
  for (const CloudPoint& from : cloud) {
    pcl::PointXYZINormal to;
    to.getVector3fMap() = from.position;
    to.getNormalVector3fMap() = from.normal;
    to.intensity = from.intensity;
    points.push_back(to);
  }
  std::ofstream file(path, std::ios::binary);
  if (!file) return cannot_write;  // PCL would print a line of its own
  if (points.empty()) {            // and it refuses to write these
    file << pcl::PCDWriter::generateHeader(points) << "DATA binary\n" << std::flush;
    return file ? Expected<bool>(true) : Expected<bool>(cannot_write);
  }
  file.close();
  try {
    if (pcl::PCDWriter().writeBinary(path.string(), points) != 0) return cannot_write;
  } catch (const pcl::IOException&) {
    return cannot_write;
  }
  return true;
}

// PCL's own writer adds elements for a camera or a range image that other readers trip over.
Expected<bool> WritePly(const std::vector<CloudPoint>& cloud, const std::filesystem::path& path) {
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << cloud.size() << "\n";
  for (const char* property : {"x", "y", "z", "nx", "ny", "nz", "intensity"}) {
    file << "property float " << property << "\n";
  }
  file << "end_header\n";
  for (const CloudPoint& point : cloud) {
    for (const float value : point.position) file << LittleEndian(value);
    for (const float value : point.normal) file << LittleEndian(value);
    file << LittleEndian(point.intensity);
  }
  file.close();
  if (!file) return CannotWrite(path);
  return true;
}

std::vector<CloudPoint> VoxelFiltered(const std::vector<CloudPoint>& cloud, double size) {
  PV_CHECK(size > 0.0, "size=" << size);
  std::map<std::array<long, 3>, std::size_t> index_of_cube;
  std::vector<CloudPoint> filtered;
  std::vector<float> counts;
  for (const CloudPoint& point : cloud) {
    const Eigen::Array3d at = (point.position.cast<double>().array() / size).floor();
    const std::array<long, 3> cube = {std::lround(at.x()), std::lround(at.y()), std::lround(at.z())};
    const auto [entry, is_new] = index_of_cube.try_emplace(cube, filtered.size());
    if (is_new) filtered.emplace_back(), counts.push_back(0.0F);
    CloudPoint& sum = filtered[entry->second];
    sum.position += point.position;
    sum.normal += point.normal;
    sum.intensity += point.intensity;
    counts[entry->second] += 1.0F;
  }
  for (std::size_t i = 0; i < filtered.size(); ++i) {
    filtered[i].position /= counts[i];
    filtered[i].normal.normalize();
  }
  return filtered;
}

void EstimateNormals(double radius, std::vector<CloudPoint>* cloud) {
  PV_CHECK(radius > 0.0, "radius=" << radius);
  if (cloud->empty()) return;
  const auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const CloudPoint& p : *cloud) points->push_back({p.position.x(), p.position.y(), p.position.z()});
  pcl::search::KdTree<pcl::PointXYZ> tree;
  tree.setInputCloud(points);
  std::vector<int> neighbors;
  std::vector<float> squared_distances;
  constexpr std::size_t kFewest = 5;  // the point itself among them
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    tree.radiusSearch((*points)[i], radius, neighbors, squared_distances);
    if (neighbors.size() < kFewest) continue;
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (const int n : neighbors) mean += (*cloud)[static_cast<std::size_t>(n)].position;
    mean /= static_cast<float>(neighbors.size());
    Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
    for (const int n : neighbors) {
      const Eigen::Vector3f d = (*cloud)[static_cast<std::size_t>(n)].position - mean;
      spread += d * d.transpose();
    }
    const Eigen::Vector3f normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(spread).eigenvectors().col(0);
    Eigen::Vector3f& seen_from = (*cloud)[i].normal;
    seen_from = normal.dot(seen_from) < 0.0F ? -normal : normal;
  }
}

std::vector<int> RadiusInliers(const std::vector<Eigen::Vector3d>& points, double radius, int min_neighbors) {
  PV_CHECK(radius > 0.0 && min_neighbors >= 0, "radius=" << radius << " min_neighbors=" << min_neighbors);
  if (points.empty()) return {};
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3f f = p.cast<float>();
    cloud->push_back(pcl::PointXYZ(f.x(), f.y(), f.z()));
  }
  pcl::RadiusOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setRadiusSearch(radius);
  filter.setMinNeighborsInRadius(min_neighbors);
  std::vector<int> inliers;
  filter.filter(inliers);
  std::sort(inliers.begin(), inliers.end());
  return inliers;
}

}  // namespace planar_vslam
