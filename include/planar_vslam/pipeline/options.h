#pragma once
// Everything that can be configured, as one value. `PipelineOptions::Visit` and those of the structs it holds are the
// only place where keys, units, bounds and meanings stand (geometry/option_fields.h); what reads, checks and writes
// configurations goes through them. Angles are in degrees in a configuration and carry `_deg` in their key.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/feature/orb_extractor.h"
#include "planar_vslam/frontend/initializer.h"
#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/mapping2d/map_builder.h"
#include "planar_vslam/optimize/calibration.h"
#include "planar_vslam/pipeline/map_scale.h"
#include "planar_vslam/planar/odometry_noise.h"
#include "planar_vslam/planar/planar_prior.h"
#include "planar_vslam/sensor/lens.h"

namespace planar_vslam {

// How well the camera's mount tells where the base is: at the map's first keyframe, whose base is the map's origin, and
// at every frame again. A camera that shakes by a sixth of a degree turns the map's axes by as much.
struct MountUncertainty {
  double position = 0.003;
  double angle = DegreesToRadians(0.16);

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("sigma_position", o.position, unit::kMeters, bound::Positive(), "x and y");
    v("sigma_angle_deg", o.angle, unit::kDegrees, bound::Positive(),
      "sway and joint backlash; about each axis in calibrate", Origin::kFitted);
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

// When the rows of an image were exposed (image_timing.h).
struct ImageTimingOptions {
  double readout = 0.0;       // s
  double sigma_clock = 0.01;  // s, of a camera whose images are stamped on arrival
  bool learn_clock = true;    // beyond calibration.time_offset

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr double kLongest = 0.1;
    v("readout", o.readout, unit::kSeconds, bound::FromTo(-kLongest, kLongest),
      "from an image's first row to its last; its stamp is that of the middle row");
    v("sigma_clock", o.sigma_clock, unit::kSeconds, bound::AtLeast(0.0),
      "how far the images' stamps may be off the wheels' clock: part of published covariances");
    v("learn_clock", o.learn_clock, "by how much they are off is learned from turns, and corrected");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

// Whether the laser helps to localise in a saved map that has sweeps.
enum class LaserLocalize { kAuto, kOff };

enum class OdometryUse { kAuto, kRequired, kOff };

struct TopicOptions {
  std::string image, camera_info, odometry, scan;  // empty: the only one of its type
  std::string base_frame = "base_footprint";
  std::string odom_frame = "odom";
  RectifiedImages rectified = RectifiedImages::kAuto;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("image", o.image, "sensor_msgs/Image or CompressedImage");
    v("camera_info", o.camera_info, "sensor_msgs/CameraInfo");
    v("odometry", o.odometry, "nav_msgs/Odometry");
    v("scan", o.scan, "sensor_msgs/LaserScan");
    v("base_frame", o.base_frame, "frame of the robot on the floor; empty: a handheld camera");
    v("odom_frame", o.odom_frame, "frame odometry is given in");
    v("rectified", o.rectified,
      {{"auto", RectifiedImages::kAuto}, {"yes", RectifiedImages::kYes}, {"no", RectifiedImages::kNo}},
      "images without distortion, P of the camera_info counts: auto (topics named ..._rect...), yes or no");
  }
};

// What happens to a map that the run starts from: it grows, or it stays as it is and only gives poses.
enum class RunMode { kMapping, kLocalization };

struct PipelineOptions {
  RunMode mode = RunMode::kMapping;
  OdometryUse odometry = OdometryUse::kAuto;
  double pixel_sigma = 1.0;
  OrbOptions orb;
  InitializerOptions initializer;
  TrackerOptions tracker;
  MapperOptions mapper;
  LoopOptions loop;
  BundleOptions bundle;
  OdometryNoise odometry_noise;
  PlanarPriorOptions planar;
  ScaleOptions scale;
  SystematicErrors systematic;
  ScanMatchOptions scan_match;                          // the section `laser`
  LaserLocalize laser_localize = LaserLocalize::kAuto;  // ...its key `localize`
  MapBuilderOptions mapping2d;
  TopicOptions topics;
  MountUncertainty mount;
  ImageTimingOptions image_timing;
  SensorCorrection calibration;         // applied to everything that comes in
  bool final_bundle_adjustment = true;  // the key `bundle.final`

  // In the order of config/default.yaml.
  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    VisitEstimator(o, v);
    VisitSensors(o, v);
    v.Section("mapping2d", "OctoMap and 2D grid.");
    MapBuilderOptions::Visit(o.mapping2d, v);
    v.Section("topics", "Rosbags and ROS. An empty topic is the only one of its type.");
    TopicOptions::Visit(o.topics, v);
  }
  // One line each, with the key as the user typed it: what lies outside its bounds, and what does not fit together.
  std::vector<std::string> Problems() const;

 private:
  template <class Self, class Visitor>
  static void VisitEstimator(Self& o, Visitor& v) {
    v("init", o.initializer.mode,
      {{"odometry", InitializationMode::kOdometry}, {"visual", InitializationMode::kVisual}},
      "first map: odometry (metric at once) or visual (scale recovered later)");
    v("mode", o.mode, {{"mapping", RunMode::kMapping}, {"localization", RunMode::kLocalization}},
      "mapping, or localization in a saved map, which stays as it is");
    v("odometry", o.odometry,
      {{"auto", OdometryUse::kAuto}, {"required", OdometryUse::kRequired}, {"off", OdometryUse::kOff}},
      "auto (used where there is some), required (absent is an error) or off");
    v("pixel_sigma", o.pixel_sigma, unit::kPixels, bound::Positive(),
      "of a keypoint at full resolution, from tracking to the navigation map");
    v.Section("orb", "Image features.");
    OrbOptions::Visit(o.orb, v);
    v.Section("initializer", "The first map from two images.");
    InitializerOptions::Visit(o.initializer, v);
    v.Section("tracker", "The pose of every image.");
    TrackerOptions::Visit(o.tracker, v);
    v.Section("mapper", "What happens to the map when a keyframe arrives.");
    MapperOptions::Visit(o.mapper, v);
    v.Section("loop", "Places mapped before, recognised when the robot comes back.");
    LoopOptions::Visit(o.loop, v);
    v.Section("bundle", "Bundle adjustment.");
    BundleOptions::Visit(o.bundle, v);
    v("final", o.final_bundle_adjustment, "adjust the whole map at the end");
  }
  template <class Self, class Visitor>
  static void VisitSensors(Self& o, Visitor& v) {
    v.Section("calibration",
              "Corrections to what the recording says of its sensors; `planar_vslam calibrate` finds them.");
    SensorCorrection::Visit(o.calibration, v);
    v.Section("laser", "Motion between keyframes from matched laser sweeps, and poses in a saved map that has sweeps.");
    ScanMatchOptions::Visit(o.scan_match, v);
    v("localize", o.laser_localize, {{"auto", LaserLocalize::kAuto}, {"off", LaserLocalize::kOff}},
      "auto (poses in a saved map by its sweeps, where there is a laser) or off");
    v.Section("scale", "Scale: that of a visually initialised map, and how well a map's scale is known.");
    ScaleOptions::Visit(o.scale, v);
    v.Section(
        "systematic",
        "Shares by which a source of motion reads wrong throughout: for the scale and its standard deviation, for\n"
        "the covariance of poses, and for how far around the robot loops are searched.");
    SystematicErrors::Visit(o.systematic, v);
    v.Section("odometry_noise",
              "How wheel odometry errs: variances grow with distance and turn. The values are for an omnidirectional\n"
              "base; config/differential.yaml has those of two driven wheels.");
    OdometryNoise::Visit(o.odometry_noise, v);
    v.Section("mount", "How well the camera's mount tells where the base is, for the covariance of poses.");
    MountUncertainty::Visit(o.mount, v);
    v.Section("image_timing", "When the rows of an image were exposed: rolling shutters, stamps of another clock.");
    ImageTimingOptions::Visit(o.image_timing, v);
    v.Section("planar", "What the floor says of the base's pose.");
    PlanarPriorOptions::Visit(o.planar, v);
  }
};

// Reads a YAML file over the defaults. Unknown keys, keys that stand twice and values of the wrong type are errors that
// name file and key, all of them in one line, and then also whatever Problems() finds. Values out of bounds alone are
// no error yet: what is set afterwards may be right.
Expected<PipelineOptions> LoadOptions(const std::filesystem::path& path);
// "key=value" over `options`.
Expected<PipelineOptions> SetOption(PipelineOptions options, const std::string& assignment);
// The file (none where empty), then the assignments over it. All that is wrong is added to `problems`, one line each.
PipelineOptions CollectOptions(const std::filesystem::path& file, const std::vector<std::string>& assignments,
                               std::vector<std::string>* problems);
// All that is wrong with a configuration file, one line each, without its name; empty where it can be used.
std::vector<std::string> FileProblems(const std::filesystem::path& path);
// Every key with its present value, in the order of config/default.yaml.
std::vector<std::pair<std::string, std::string>> OptionValues(const PipelineOptions& options);
// The text of config/default.yaml: every key with its default and what it means.
std::string DefaultConfiguration();

}  // namespace planar_vslam
