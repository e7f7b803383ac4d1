#include "converters.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace planar_vslam::ros_face {

std_msgs::Header MakeHeader(Timestamp stamp, const std::string& frame_id) {
  std_msgs::Header header;
  header.stamp = ToRosTime(stamp);
  header.frame_id = frame_id;
  return header;
}

Rigid3 ToRigid3(const geometry_msgs::Pose& pose) {
  const auto& p = pose.position;
  const auto& q = pose.orientation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(p.x, p.y, p.z)};
}

geometry_msgs::Pose ToPose(const Rigid3& T) {
  geometry_msgs::Pose pose;
  pose.position.x = T.translation.x();
  pose.position.y = T.translation.y();
  pose.position.z = T.translation.z();
  pose.orientation.x = T.rotation.x();
  pose.orientation.y = T.rotation.y();
  pose.orientation.z = T.rotation.z();
  pose.orientation.w = T.rotation.w();
  return pose;
}

geometry_msgs::TransformStamped ToTransform(const std_msgs::Header& header, const std::string& child, const Rigid3& T) {
  const geometry_msgs::Pose pose = ToPose(T);
  geometry_msgs::TransformStamped transform;
  transform.header = header;
  transform.child_frame_id = child;
  transform.transform.translation.x = pose.position.x;
  transform.transform.translation.y = pose.position.y;
  transform.transform.translation.z = pose.position.z;
  transform.transform.rotation = pose.orientation;
  return transform;
}

Matrix6d CovarianceInMapAxes(const Rigid3& T_map_base, const Matrix6d& covariance) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = T_map_base.R();
  turn.bottomRightCorner<3, 3>() = T_map_base.R();
  return turn * covariance * turn.transpose();
}

geometry_msgs::PoseWithCovarianceStamped ToPoseWithCovariance(const std_msgs::Header& header, const Rigid3& T_map_base,
                                                              const Matrix6d& covariance) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header = header;
  message.pose.pose = ToPose(T_map_base);
  const Matrix6d in_map = CovarianceInMapAxes(T_map_base, covariance);
  constexpr Eigen::Index kSize = 6;
  for (Eigen::Index row = 0; row < kSize; ++row) {
    for (Eigen::Index column = 0; column < kSize; ++column) {
      message.pose.covariance[static_cast<std::size_t>(row * kSize + column)] = in_map(row, column);
    }
  }
  return message;
}

Expected<PoseWithTangentCovariance> ToPoseWithTangentCovariance(const geometry_msgs::PoseWithCovariance& pose) {
  using RowMajor = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  const Matrix6d in_map = Eigen::Map<const RowMajor>(pose.covariance.data());
  const auto& q = pose.pose.orientation;
  Rigid3 T = ToRigid3(pose.pose);
  const double norm = Eigen::Vector4d(q.x, q.y, q.z, q.w).norm();
  if (!T.translation.allFinite() || !in_map.allFinite() || !std::isfinite(norm)) {
    return Error{"pose: has a number that is not finite; expected finite ones"};
  }
  constexpr double kUnitTolerance = 0.01;  // of what people type
  if (std::abs(norm - 1.0) > kUnitTolerance) {
    return Error{fmt::format("pose: orientation has length {:.3g}; expected a unit quaternion", norm)};
  }
  T.rotation.normalize();
  return PoseWithTangentCovariance{T, CovarianceInMapAxes(T.Inverse(), in_map)};
}

nav_msgs::OccupancyGrid ToOccupancyGrid(const std_msgs::Header& header, const OccupancyGrid2d& grid) {
  nav_msgs::OccupancyGrid message;
  message.header = header;
  message.info.map_load_time = header.stamp;
  message.info.resolution = static_cast<float>(grid.resolution);
  message.info.width = static_cast<std::uint32_t>(grid.width);
  message.info.height = static_cast<std::uint32_t>(grid.height);
  message.info.origin.position.x = grid.origin.x();
  message.info.origin.position.y = grid.origin.y();
  message.info.origin.orientation.w = 1.0;
  message.data = grid.cells;
  return message;
}

map_msgs::OccupancyGridUpdate ToGridUpdate(const std_msgs::Header& header, const OccupancyGrid2d& grid,
                                           const GridRegion& region) {
  map_msgs::OccupancyGridUpdate message;
  message.header = header;
  message.x = region.x;
  message.y = region.y;
  message.width = static_cast<std::uint32_t>(region.width);
  message.height = static_cast<std::uint32_t>(region.height);
  for (int y = region.y; y < region.y + region.height; ++y) {
    for (int x = region.x; x < region.x + region.width; ++x) message.data.push_back(grid.At(x, y));
  }
  return message;
}

sensor_msgs::PointCloud2 ToPointCloud(const std_msgs::Header& header, const std::vector<CloudPoint>& cloud) {
  static constexpr const char* kFields[] = {"x", "y", "z", "normal_x", "normal_y", "normal_z", "intensity"};
  sensor_msgs::PointCloud2 message;
  message.header = header;
  message.height = 1;
  message.width = static_cast<std::uint32_t>(cloud.size());
  message.is_dense = 1;
  for (const char* name : kFields) {
    sensor_msgs::PointField field;
    field.name = name;
    field.offset = message.point_step;
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    message.fields.push_back(field);
    message.point_step += static_cast<std::uint32_t>(sizeof(float));
  }
  message.row_step = message.point_step * message.width;
  message.data.resize(message.row_step);
  std::uint8_t* target = message.data.data();
  for (const CloudPoint& point : cloud) {
    const float values[] = {point.position.x(), point.position.y(), point.position.z(), point.normal.x(),
                            point.normal.y(),   point.normal.z(),   point.intensity};
    static_assert(std::size(values) == std::size(kFields));
    std::memcpy(target, values, sizeof(values));
    target += sizeof(values);
  }
  return message;
}

nav_msgs::Path ToPath(const std_msgs::Header& header, const std::vector<std::pair<Timestamp, Rigid3>>& poses) {
  nav_msgs::Path path;
  path.header = header;
  path.poses.reserve(poses.size());
  for (const auto& [stamp, T_map_base] : poses) {
    geometry_msgs::PoseStamped pose;
    pose.header = MakeHeader(stamp, header.frame_id);
    pose.pose = ToPose(T_map_base);
    path.poses.push_back(pose);
  }
  return path;
}

geometry_msgs::PoseArray ToPoseArray(const std_msgs::Header& header, const Map& map) {
  geometry_msgs::PoseArray poses;
  poses.header = header;
  for (const auto& [id, keyframe] : map.keyframes) poses.poses.push_back(ToPose(keyframe.T_map_base));
  return poses;
}

}  // namespace planar_vslam::ros_face
