#pragma once
// Our values -> ROS messages, and the few conversions back that the bag reader does not share.
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>

#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam::ros_face {

inline Timestamp ToTimestamp(const ros::Time& time) { return {static_cast<std::int64_t>(time.toNSec())}; }
inline ros::Time ToRosTime(Timestamp stamp) {
  return ros::Time().fromNSec(static_cast<std::uint64_t>(stamp.nanoseconds));
}
std_msgs::Header MakeHeader(Timestamp stamp, const std::string& frame_id);

Rigid3 ToRigid3(const geometry_msgs::Pose& pose);
geometry_msgs::Pose ToPose(const Rigid3& T);
geometry_msgs::TransformStamped ToTransform(const std_msgs::Header& header, const std::string& child, const Rigid3& T);

// `covariance` is about the tangent [translation, rotation] at the pose (body axes, right perturbation). ROS wants it
// along the axes of the header's frame: both halves rotate with the pose.
Matrix6d CovarianceInMapAxes(const Rigid3& T_map_base, const Matrix6d& covariance);
geometry_msgs::PoseWithCovarianceStamped ToPoseWithCovariance(const std_msgs::Header& header, const Rigid3& T_map_base,
                                                              const Matrix6d& covariance);
// The way back, with the covariance about the tangent; an Error where the orientation is none or a number is missing.
struct PoseWithTangentCovariance {
  Rigid3 T_map_base;
  Matrix6d covariance;
};
Expected<PoseWithTangentCovariance> ToPoseWithTangentCovariance(const geometry_msgs::PoseWithCovariance& pose);

nav_msgs::OccupancyGrid ToOccupancyGrid(const std_msgs::Header& header, const OccupancyGrid2d& grid);
map_msgs::OccupancyGridUpdate ToGridUpdate(const std_msgs::Header& header, const OccupancyGrid2d& grid,
                                           const GridRegion& region);
// Fields x y z normal_x normal_y normal_z intensity, float32.
sensor_msgs::PointCloud2 ToPointCloud(const std_msgs::Header& header, const std::vector<CloudPoint>& cloud);
nav_msgs::Path ToPath(const std_msgs::Header& header, const std::vector<std::pair<Timestamp, Rigid3>>& poses);
geometry_msgs::PoseArray ToPoseArray(const std_msgs::Header& header, const Map& map);

}  // namespace planar_vslam::ros_face
