#pragma once
// Writes a simulation as a dataset folder: images.csv and images/, odometry.csv, scan.csv, calibration.yaml and the
// ground truth (groundtruth_base.txt, groundtruth_camera.txt, groundtruth_grid*.pgm and .yaml). Where the head moves,
// base_camera.txt has T_base_camera as the robot believes it at every image; calibration.yaml has the resting head's.
#include <filesystem>
#include <functional>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sim/simulation.h"

namespace planar_vslam {

struct DatasetCounts {
  long images = 0, odometry_readings = 0, scans = 0;

  void Add(const SimulatedEvent& event);
};

// Runs the simulation to its end. Creates `folder`; files of these names in it are replaced. A simulation that does not
// render leaves out images.csv and images/.
// Everything is also shown to `observer`, where there is one.
Expected<DatasetCounts> WriteDataset(Simulation& simulation, const std::filesystem::path& folder,
                                     const std::function<void(const SimulatedEvent&)>& observer = {});

}  // namespace planar_vslam
