#include "planar_vslam/pipeline/options.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <functional>
#include <map>

namespace planar_vslam {
namespace {

// One configurable value: how to read it from text and how to show it.
struct Field {
  std::string key;
  std::string expected;
  std::function<bool(const std::string&)> set;
  std::function<std::string()> get;
};

class FieldList {
 public:
  void Add(const std::string& key, double& value, double unit = 1.0) {
    fields_.push_back(
        {key, "a number",
         [&value, unit](const std::string& text) { return Parse<double>(text, [&](double v) { value = v * unit; }); },
         [&value, unit] { return fmt::format("{:.9g}", value / unit); }});
  }
  void AddDegrees(const std::string& key, double& radians) { Add(key, radians, DegreesToRadians(1.0)); }
  void Add(const std::string& key, int& value) {
    fields_.push_back({key, "an integer",
                       [&value](const std::string& text) { return Parse<int>(text, [&](int v) { value = v; }); },
                       [&value] { return fmt::format("{}", value); }});
  }
  void Add(const std::string& key, bool& value) {
    fields_.push_back({key, "true or false",
                       [&value](const std::string& text) { return Parse<bool>(text, [&](bool v) { value = v; }); },
                       [&value] { return value ? "true" : "false"; }});
  }
  void Add(const std::string& key, std::string& value) {
    fields_.push_back({key, "a text",
                       [&value](const std::string& text) {
                         value = text;
                         return true;
                       },
                       [&value] { return value; }});
  }
  template <class Enum>
  void Add(const std::string& key, Enum& value, const std::map<std::string, Enum>& names) {
    std::string expected = "one of";
    for (const auto& [name, v] : names) expected += " " + name;
    fields_.push_back({key, expected,
                       [&value, names](const std::string& text) {
                         const auto it = names.find(text);
                         if (it == names.end()) return false;
                         value = it->second;
                         return true;
                       },
                       [&value, names] {
                         const auto it = std::find_if(names.begin(), names.end(),
                                                      [&value](const auto& n) { return n.second == value; });
                         return it->first;
                       }});
  }
  const std::vector<Field>& fields() const { return fields_; }

 private:
  template <class T, class F>
  static bool Parse(const std::string& text, const F& use) {
    try {
      use(YAML::Load(text).as<T>());
      return true;
    } catch (const YAML::Exception&) {
      return false;
    }
  }
  std::vector<Field> fields_;
};

void AddFrontEnd(PipelineOptions& o, FieldList* f) {
  f->Add("orb.feature_count", o.orb.feature_count);
  f->Add("orb.scale_factor", o.orb.scale_factor);
  f->Add("orb.level_count", o.orb.level_count);
  f->Add("orb.fast_threshold", o.orb.fast_threshold);
  f->Add("orb.fast_min_threshold", o.orb.fast_min_threshold);
  f->Add("orb.cell_pixels", o.orb.cell_pixels);
  f->Add("init", o.initializer.mode,
         std::map<std::string, InitializationMode>{{"odometry", InitializationMode::kOdometry},
                                                   {"visual", InitializationMode::kVisual}});
  f->Add("initializer.min_features", o.initializer.min_features);
  f->Add("initializer.min_matches", o.initializer.min_matches);
  f->Add("initializer.min_points", o.initializer.min_points);
  f->AddDegrees("initializer.min_parallax_deg", o.initializer.min_parallax);
  f->AddDegrees("initializer.min_median_parallax_deg", o.initializer.min_median_parallax);
  f->Add("initializer.min_baseline", o.initializer.min_baseline);
  f->Add("initializer.max_baseline_time", o.initializer.max_baseline_time);
  f->Add("initializer.search_radius", o.initializer.search_radius);
  f->Add("initializer.visual_search_radius", o.initializer.visual_search_radius);
  f->Add("tracker.frame_search_radius", o.tracker.frame_search_radius);
  f->Add("tracker.map_search_radius", o.tracker.map_search_radius);
  f->Add("tracker.rematch_radius_max", o.tracker.rematch_radius_max);
  f->Add("tracker.min_inliers", o.tracker.min_inliers);
  f->Add("tracker.min_inliers_odometry", o.tracker.min_inliers_odometry);
  f->Add("tracker.min_inliers_rematch", o.tracker.min_inliers_rematch);
  f->Add("tracker.local_keyframes", o.tracker.local_keyframes);
  f->Add("tracker.nearby_distance", o.tracker.nearby_distance);
  f->AddDegrees("tracker.nearby_angle_deg", o.tracker.nearby_angle);
  f->Add("tracker.keyframe_ratio", o.tracker.keyframe_ratio);
  f->Add("tracker.keyframe_distance", o.tracker.keyframe_distance);
  f->AddDegrees("tracker.keyframe_angle_deg", o.tracker.keyframe_angle);
  f->Add("tracker.keyframe_min_gap", o.tracker.keyframe_min_gap);
  f->Add("tracker.keyframe_min_features", o.tracker.keyframe_min_features);
}

void AddBackEnd(PipelineOptions& o, FieldList* f) {
  f->Add("mapper.triangulation_neighbors", o.mapper.triangulation_neighbors);
  f->Add("mapper.link_neighbors", o.mapper.link_neighbors);
  f->Add("mapper.fusion_neighbors", o.mapper.fusion_neighbors);
  f->Add("mapper.window", o.mapper.window);
  f->Add("mapper.wide_window", o.mapper.wide_window);
  f->Add("mapper.wide_every", o.mapper.wide_every);
  f->Add("mapper.young_map", o.mapper.young_map);
  f->Add("mapper.min_shared", o.mapper.min_shared);
  f->Add("mapper.max_fixed", o.mapper.max_fixed);
  f->AddDegrees("mapper.min_parallax_deg", o.mapper.min_parallax);
  f->Add("mapper.min_baseline_ratio", o.mapper.min_baseline_ratio);
  f->Add("mapper.max_descriptor_distance", o.mapper.max_descriptor_distance);
  f->Add("mapper.fusion_radius", o.mapper.fusion_radius);
  f->Add("mapper.redundancy", o.mapper.redundancy);
  f->Add("mapper.min_found_ratio", o.mapper.min_found_ratio);
  f->Add("mapper.nearby_distance", o.mapper.nearby_distance);
  f->Add("loop.close", o.loop.enabled);
  f->Add("loop.min_inliers", o.loop.min_inliers);
  f->Add("loop.min_share", o.loop.min_share);
  f->Add("loop.sigma_factor", o.loop.sigma_factor);
  f->Add("bundle.max_iterations", o.bundle.max_iterations);
  f->Add("bundle.drop_outliers", o.bundle.drop_outliers);
  f->Add("bundle.pixel_sigma", o.bundle.pixel_sigma);
  f->Add("bundle.odometry_loss", o.bundle.odometry_loss);
  f->Add("bundle.tilt_loss", o.bundle.tilt_loss);
  f->Add("bundle.use_odometry", o.bundle.use_odometry);
  f->Add("bundle.final", o.final_bundle_adjustment);
  f->Add("calibration.odometry_scale_x", o.calibration.odometry.scale.x());
  f->Add("calibration.odometry_scale_y", o.calibration.odometry.scale.y());
  f->Add("calibration.odometry_scale_yaw", o.calibration.odometry.scale.z());
  f->Add("calibration.time_offset", o.calibration.odometry.time_offset);
  f->Add("calibration.camera_x", o.calibration.camera_mount[0]);
  f->Add("calibration.camera_y", o.calibration.camera_mount[1]);
  f->Add("calibration.camera_z", o.calibration.camera_mount[2]);
  f->AddDegrees("calibration.camera_roll_deg", o.calibration.camera_mount[3]);
  f->AddDegrees("calibration.camera_pitch_deg", o.calibration.camera_mount[4]);
  f->AddDegrees("calibration.camera_yaw_deg", o.calibration.camera_mount[5]);
  f->Add("laser.match", o.scan_match.enabled);
  f->Add("laser.range_sigma", o.scan_match.range_sigma);
  f->Add("laser.max_offset", o.scan_match.max_offset);
  f->Add("laser.min_share", o.scan_match.min_share);
  f->Add("laser.min_points", o.scan_match.min_points);
  f->Add("scale.keyframes", o.scale.keyframes);
  f->Add("scale.max_sigma", o.scale.max_sigma);
  f->Add("scale.min_distance", o.scale.min_distance);
  f->Add("scale.wheel_sigma", o.scale.systematic.wheels);
  f->Add("scale.laser_sigma", o.scale.systematic.laser);
  f->Add("scale.height_sigma", o.scale.height_sigma);
}

void AddPlanar(PipelineOptions& o, FieldList* f) {
  f->Add("mode", o.mode,
         std::map<std::string, RunMode>{{"mapping", RunMode::kMapping}, {"localization", RunMode::kLocalization}});
  f->Add("odometry", o.odometry,
         std::map<std::string, OdometryUse>{
             {"auto", OdometryUse::kAuto}, {"required", OdometryUse::kRequired}, {"off", OdometryUse::kOff}});
  OdometryNoise& n = o.odometry_noise;
  f->Add("odometry_noise.model", n.model,
         std::map<std::string, OdometryNoiseModel>{{"arc_length", OdometryNoiseModel::kArcLength},
                                                   {"amcl", OdometryNoiseModel::kAmcl}});
  f->Add("odometry_noise.message_covariance", n.message_covariance,
         std::map<std::string, MessageCovarianceUse>{{"auto", MessageCovarianceUse::kAuto},
                                                     {"never", MessageCovarianceUse::kNever}});
  f->Add("odometry_noise.along_per_sqrt_meter", n.along_per_sqrt_meter);
  f->Add("odometry_noise.across_per_sqrt_meter", n.across_per_sqrt_meter);
  f->Add("odometry_noise.across_per_sqrt_radian", n.across_per_sqrt_radian);
  f->AddDegrees("odometry_noise.heading_per_sqrt_meter_deg", n.heading_per_sqrt_meter);
  f->Add("odometry_noise.heading_per_sqrt_radian", n.heading_per_sqrt_radian);
  f->Add("odometry_noise.amcl_alpha1", n.amcl_alpha1);
  f->Add("odometry_noise.amcl_alpha2", n.amcl_alpha2);
  f->Add("odometry_noise.amcl_alpha3", n.amcl_alpha3);
  f->Add("odometry_noise.amcl_alpha4", n.amcl_alpha4);
  f->Add("odometry_noise.position_floor", n.position_floor);
  f->AddDegrees("odometry_noise.heading_floor_deg", n.heading_floor);
  f->Add("odometry_noise.height_per_sqrt_meter", n.height_per_sqrt_meter);
  f->Add("odometry_noise.height_floor", n.height_floor);
  f->AddDegrees("odometry_noise.tilt_per_sqrt_meter_deg", n.tilt_per_sqrt_meter);
  f->AddDegrees("odometry_noise.tilt_floor_deg", n.tilt_floor);
  f->Add("planar.mode", o.planar.mode,
         std::map<std::string, PlanarMode>{{"off", PlanarMode::kOff},
                                           {"soft_se3", PlanarMode::kSoftSe3},
                                           {"se2_xyz", PlanarMode::kSe2Xyz},
                                           {"hard", PlanarMode::kHard}});
  f->Add("planar.sigma_height", o.planar.sigma_height);
  f->AddDegrees("planar.sigma_tilt_deg", o.planar.sigma_tilt);
  f->Add("mount.sigma_position", o.mount.position);
  f->AddDegrees("mount.sigma_angle_deg", o.mount.angle);
  f->Add("planar.floor_points", o.planar.floor_points);
  f->Add("planar.sigma_floor_point", o.planar.sigma_floor_point);
}

void AddMapping2d(PipelineOptions& o, FieldList* f) {
  MapBuilderOptions& m = o.mapping2d;
  f->Add("mapping2d.layers", m.layers,
         std::map<std::string, GridLayers>{
             {"fused", GridLayers::kFused}, {"laser", GridLayers::kLaser}, {"visual", GridLayers::kVisual}});
  f->Add("mapping2d.resolution", m.resolution);
  f->Add("mapping2d.visual_p_hit", m.visual.p_hit);
  f->Add("mapping2d.visual_p_miss", m.visual.p_miss);
  f->Add("mapping2d.laser_p_hit", m.laser.p_hit);
  f->Add("mapping2d.laser_p_miss", m.laser.p_miss);
  f->Add("mapping2d.clamp_min", m.clamp_min);
  f->Add("mapping2d.clamp_max", m.clamp_max);
  f->Add("mapping2d.visual_range", m.visual_range);
  f->Add("mapping2d.visual_hit_sigma", m.visual_hit_sigma);
  f->Add("mapping2d.laser_range", m.laser_range);
  f->Add("mapping2d.floor_tolerance", m.floor_tolerance);
  f->Add("mapping2d.tilt_sigma_deg", m.tilt_sigma_deg);
  f->Add("mapping2d.band_min", m.band_min);
  f->Add("mapping2d.band_max", m.band_max);
  f->Add("mapping2d.footprint_radius", m.footprint_radius);
  f->Add("mapping2d.occupied_threshold", m.occupied_threshold);
  f->Add("mapping2d.free_threshold", m.free_threshold);
  f->Add("mapping2d.overhang_enabled", m.overhang.enabled);
  f->Add("mapping2d.overhang_min_height", m.overhang.min_height);
  f->Add("mapping2d.overhang_max_height", m.overhang.max_height);
  f->Add("mapping2d.overhang_thickness", m.overhang.thickness);
  f->Add("mapping2d.overhang_neighborhood", m.overhang.neighborhood);
  f->Add("mapping2d.overhang_max_tilt_deg", m.overhang.max_tilt_deg);
  f->Add("mapping2d.overhang_max_gap", m.overhang.max_gap);
  f->Add("mapping2d.overhang_min_points", m.overhang.min_points);
  f->Add("mapping2d.overhang_min_sight_lines", m.overhang.min_sight_lines);
  f->Add("mapping2d.legged_enabled", m.legged.enabled);
  f->Add("mapping2d.legged_max_leg", m.legged.max_leg);
  f->Add("mapping2d.legged_min_side", m.legged.min_side);
  f->Add("mapping2d.legged_max_side", m.legged.max_side);
  f->Add("mapping2d.legged_min_height", m.legged.min_height);
  f->Add("mapping2d.legged_max_height", m.legged.max_height);
}

void AddTopics(PipelineOptions& o, FieldList* f) {
  f->Add("topics.image", o.topics.image);
  f->Add("topics.camera_info", o.topics.camera_info);
  f->Add("topics.odometry", o.topics.odometry);
  f->Add("topics.scan", o.topics.scan);
  f->Add("topics.base_frame", o.topics.base_frame);
  f->Add("topics.odom_frame", o.topics.odom_frame);
}

FieldList Fields(PipelineOptions& options) {
  FieldList list;
  AddFrontEnd(options, &list);
  AddBackEnd(options, &list);
  AddPlanar(options, &list);
  AddMapping2d(options, &list);
  AddTopics(options, &list);
  return list;
}

// Sets one key; a message says what is wrong, empty when nothing is.
std::string SetField(const FieldList& list, const std::string& key, const std::string& text) {
  for (const Field& field : list.fields()) {
    if (field.key != key) continue;
    return field.set(text) ? "" : fmt::format("key '{}' is '{}': expected {}", key, text, field.expected);
  }
  return fmt::format("unknown key '{}': see config/default.yaml for the known ones", key);
}

std::string ApplyNode(const FieldList& list, const YAML::Node& node, const std::string& prefix) {
  for (const auto& entry : node) {
    const std::string key = prefix + entry.first.as<std::string>();
    std::string problem;
    if (entry.second.IsMap()) {
      problem = ApplyNode(list, entry.second, key + ".");
    } else if (entry.second.IsScalar() || entry.second.IsNull()) {
      problem = SetField(list, key, entry.second.IsNull() ? "" : entry.second.Scalar());
    } else {
      problem = fmt::format("key '{}': expected a single value", key);
    }
    if (!problem.empty()) return problem;
  }
  return "";
}

}  // namespace

std::vector<std::string> MountUncertainty::Problems() const {
  std::vector<std::string> problems;
  if (!(position > 0.0)) problems.emplace_back("sigma_position must be positive (m)");
  if (!(angle > 0.0)) problems.emplace_back("sigma_angle_deg must be positive (deg)");
  return problems;
}

std::vector<std::string> PipelineOptions::Problems() const {
  std::vector<std::string> all;
  const auto add = [&all](const std::string& section, const std::vector<std::string>& problems) {
    for (const std::string& p : problems) all.push_back(section + ": " + p);
  };
  add("orb", orb.Problems());
  add("initializer", initializer.Problems());
  add("tracker", tracker.Problems());
  add("mapper", mapper.Problems());
  add("bundle", bundle.Problems());
  add("odometry_noise", odometry_noise.Problems());
  add("planar", planar.Problems());
  add("calibration", calibration.Problems());
  add("loop", loop.Problems());
  add("laser", scan_match.Problems());
  add("mapping2d", mapping2d.Problems());
  add("scale", scale.Problems());
  add("mount", mount.Problems());
  if (initializer.mode == InitializationMode::kOdometry && odometry == OdometryUse::kOff) {
    all.emplace_back("init: 'odometry' needs odometry, but odometry is 'off'; set init to 'visual'");
  }
  return all;
}

Expected<PipelineOptions> LoadOptions(const std::filesystem::path& path) {
  PipelineOptions options;
  if (!std::filesystem::is_regular_file(path)) {
    return Error{fmt::format("{}: cannot be read; expected a YAML configuration file", path.string())};
  }
  try {
    const YAML::Node root = YAML::LoadFile(path.string());
    if (root.IsNull()) return options;
    if (!root.IsMap()) return Error{fmt::format("{}: expected a map of keys", path.string())};
    const std::string problem = ApplyNode(Fields(options), root, "");
    if (!problem.empty()) return Error{fmt::format("{}: {}", path.string(), problem)};
  } catch (const YAML::BadFile&) {
    return Error{fmt::format("{}: cannot be read; expected a YAML configuration file", path.string())};
  } catch (const YAML::Exception& e) {
    return Error{fmt::format("{}:{}: not valid YAML: {}", path.string(), e.mark.line + 1, e.msg)};
  }
  return options;
}

Expected<PipelineOptions> SetOption(PipelineOptions options, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos) return Error{fmt::format("--set {}: expected key=value", assignment)};
  const std::string problem = SetField(Fields(options), assignment.substr(0, equals), assignment.substr(equals + 1));
  if (!problem.empty()) return Error{fmt::format("--set {}: {}", assignment, problem)};
  return options;
}

std::vector<std::pair<std::string, std::string>> OptionValues(const PipelineOptions& options) {
  PipelineOptions copy = options;
  std::vector<std::pair<std::string, std::string>> values;
  const FieldList list = Fields(copy);
  for (const Field& field : list.fields()) values.emplace_back(field.key, field.get());
  return values;
}

}  // namespace planar_vslam
