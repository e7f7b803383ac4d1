#pragma once
// The robot's part of a world as the text of a world file.
#include <string>

#include "planar_vslam/sim/world.h"

namespace planar_vslam::sim {

std::string TextOfDrive(const char* key, const DriveSpec& drive);
// Everything behind the drives.
std::string TextOfRobot(const World& world);

}  // namespace planar_vslam::sim
