#pragma once
// The robot's part of a world file: a function for each section.
#include "planar_vslam/sim/robot_spec.h"
#include "yaml_fields.h"

namespace planar_vslam::sim {

void ReadDegrees(YamlFields& fields, const std::string& key, double* radians);
std::vector<Eigen::Vector2d> ReadPoints(YamlFields& fields, const std::string& key);

void ReadDrive(YamlFields fields, DriveSpec* drive);
void ReadLimits(YamlFields fields, LimitsSpec* limits);
void ReadCamera(YamlFields fields, CameraSpec* camera);
void ReadHead(YamlFields fields, HeadSpec* head);
void ReadLaser(YamlFields fields, LaserSpec* laser);
void ReadOdometry(YamlFields fields, OdometrySpec* odometry);
void ReadEvents(YamlFields fields, EventsSpec* events);

}  // namespace planar_vslam::sim
