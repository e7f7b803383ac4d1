#pragma once
// Everything that can be configured, as one value. YAML keys are the dotted names of OptionKeys(); angles are in
// degrees there and carry `_deg` in their name.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/feature/orb_extractor.h"
#include "planar_vslam/frontend/initializer.h"
#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/mapping2d/map_builder.h"
#include "planar_vslam/optimize/calibration.h"
#include "planar_vslam/pipeline/map_scale.h"
#include "planar_vslam/planar/odometry_noise.h"
#include "planar_vslam/planar/planar_prior.h"

namespace planar_vslam {

// How well the camera's mount tells where the base is: at the map's first keyframe, whose base is the map's origin, and
// at every frame again. A camera that shakes by a sixth of a degree turns the map's axes by as much.
struct MountUncertainty {
  double position = 0.003;                // m, x and y
  double angle = DegreesToRadians(0.16);  // rad, about the vertical
  std::vector<std::string> Problems() const;
};

enum class OdometryUse { kAuto, kRequired, kOff };

struct TopicOptions {
  std::string image, camera_info, odometry, scan;  // empty: the only one of its type
  std::string base_frame = "base_footprint";
  std::string odom_frame = "odom";
};

// What happens to a map that the run starts from: it grows, or it stays as it is and only gives poses.
enum class RunMode { kMapping, kLocalization };

struct PipelineOptions {
  RunMode mode = RunMode::kMapping;
  OdometryUse odometry = OdometryUse::kAuto;
  OrbOptions orb;
  InitializerOptions initializer;
  TrackerOptions tracker;
  MapperOptions mapper;
  LoopOptions loop;
  BundleOptions bundle;
  OdometryNoise odometry_noise;
  PlanarPriorOptions planar;
  ScaleOptions scale;
  ScanMatchOptions scan_match;
  MapBuilderOptions mapping2d;
  TopicOptions topics;
  MountUncertainty mount;
  SensorCorrection calibration;  // applied to everything that comes in
  bool final_bundle_adjustment = true;

  std::vector<std::string> Problems() const;
};

// Reads a YAML file over the defaults. Unknown keys and values of the wrong type are errors naming file and key.
Expected<PipelineOptions> LoadOptions(const std::filesystem::path& path);
// "key=value" over `options`.
Expected<PipelineOptions> SetOption(PipelineOptions options, const std::string& assignment);
// Every key with its present value, in file order: what report.json shows, and what the documentation lists.
std::vector<std::pair<std::string, std::string>> OptionValues(const PipelineOptions& options);

}  // namespace planar_vslam
