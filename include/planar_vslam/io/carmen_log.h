#pragma once
// Laser logs of the CARMEN toolkit, in which scans carry (corrected) poses; plain or gzip.
#include <filesystem>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct CarmenScan {
  Rigid2 T_map_laser;
  PlanarScan scan;  // stamped with its number in the log: clocks of old logs are broken
};

// The ROBOTLASER1 lines in the order of the log, or where it has none, the FLASER lines:
//   FLASER n range_1 .. range_n x y theta odom_x odom_y odom_theta [times and host]
// Beams of FLASER span 180 degrees from the right to the left, unless a line "PARAM laser_front_laser_fov DEGREES"
// comes before; a number of beams that does not divide 180 degrees is an error. Errors name file, line and field.
Expected<std::vector<CarmenScan>> ReadCarmenLog(const std::filesystem::path& path);

}  // namespace planar_vslam
