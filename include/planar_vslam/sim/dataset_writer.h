#pragma once
// Writes a simulation as a dataset folder: images.csv and images/, odometry.csv, scan.csv, calibration.yaml and the
// ground truth (groundtruth_base.txt, groundtruth_camera.txt, groundtruth_grid*.pgm and .yaml).
#include <filesystem>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/simulation.h"

namespace planar_vslam {

struct DatasetCounts {
  long images = 0, odometry_readings = 0, scans = 0;
};

// Runs the simulation to its end. Creates `folder`; files of these names in it are replaced.
Expected<DatasetCounts> WriteDataset(Simulation& simulation, const std::filesystem::path& folder);

}  // namespace planar_vslam
