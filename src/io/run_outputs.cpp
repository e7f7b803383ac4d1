#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/io/consistency.h"
#include "planar_vslam/io/run_session.h"
#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/map_planes.h"
#include "planar_vslam/pipeline/navigation_map.h"

namespace planar_vslam {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

Trajectory ToTrajectory(const std::vector<std::pair<Timestamp, Rigid3>>& poses) {
  Trajectory trajectory;
  trajectory.reserve(poses.size());
  for (const auto& [stamp, T] : poses) trajectory.push_back({stamp, T});
  return trajectory;
}

// On the way to a metric map the unscaled poses were not published.
Trajectory LiveTrajectory(const RunResult& result, bool metric) {
  Trajectory trajectory;
  for (const FrameReport& frame : result.frames) {
    if (frame.T_map_base.has_value() && frame.metric == metric) trajectory.push_back({frame.stamp, *frame.T_map_base});
  }
  return trajectory;
}

// Of the planar pose, of the live trajectory's poses.
std::vector<StampedCovariance> LiveCovariances(const RunResult& result, bool metric) {
  std::vector<StampedCovariance> covariances;
  for (const FrameReport& frame : result.frames) {
    if (!frame.T_map_base.has_value() || frame.metric != metric) continue;
    covariances.push_back({frame.stamp, frame.covariance(kPlanarRows, kPlanarRows)});
  }
  return covariances;
}

Trajectory KeyframeTrajectory(const Map& map) {
  Trajectory trajectory;
  for (const auto& [id, keyframe] : map.keyframes) trajectory.push_back({keyframe.stamp, keyframe.T_map_base});
  return trajectory;
}

Expected<bool> WriteText(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) return Error{path.string() + ": cannot be written"};
  return true;
}

std::string StatusCsv(const RunResult& result, bool deterministic) {
  std::string text = "t,state,inliers,keyframe,ms\n";
  for (const FrameReport& f : result.frames) {
    text +=
        fmt::format("{}.{:09d},{},{},{},{:.3f}\n", f.stamp.nanoseconds / 1000000000, f.stamp.nanoseconds % 1000000000,
                    ToString(f.state), f.inliers, f.keyframe ? 1 : 0, deterministic ? 0.0 : f.total_ms);
  }
  return text;
}

Json StagesJson(const StageStatistics& statistics) {
  Json json = Json::object();
  for (const auto& [stage, times] : statistics.stages()) {
    json[stage] = {{"count", times.count()},        {"sum", times.sum()},
                   {"p50", times.Percentile(0.5)},  {"p90", times.Percentile(0.9)},
                   {"p99", times.Percentile(0.99)}, {"max", times.max()}};
  }
  return json;
}

Json Timing(const RunResult& result, const StageStatistics& statistics) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr double kKibPerMib = 1024.0;
  Json json;
  json["stages_ms"] = StagesJson(statistics);
  json["wall_seconds"] = result.wall_seconds;
  json["cpu_seconds"] = result.cpu_seconds;
  json["real_time_factor"] = result.wall_seconds > 0.0 ? result.recorded_seconds / result.wall_seconds : 0.0;
  json["peak_memory_mib"] = static_cast<double>(usage.ru_maxrss) / kKibPerMib;
  return json;
}

Json ToJson(const std::optional<ScaleMeasurement>& source) {
  if (!source.has_value()) return nullptr;
  return {{"log_correction", source->log_scale}, {"sigma", source->sigma}};
}

// Lists of the same length, whose entries belong together; a source is [log_correction, sigma].
Json HistoryJson(const std::vector<ScaleAt>& history) {
  Json json = {{"driven_meters", Json::array()},
               {"together", Json::array()},
               {"wheels", Json::array()},
               {"laser", Json::array()},
               {"floor", Json::array()}};
  const auto entry = [](const std::optional<ScaleMeasurement>& source) {
    return source.has_value() ? Json::array({source->log_scale, source->sigma}) : Json(nullptr);
  };
  for (const ScaleAt& at : history) {
    json["driven_meters"].push_back(at.driven);
    json["together"].push_back(entry(at.fused));
    json["wheels"].push_back(entry(at.wheels));
    json["laser"].push_back(entry(at.laser));
    json["floor"].push_back(entry(at.floor));
  }
  return json;
}

// The factor the map's scale is still short of by each source, and how an unscaled map came by its scale.
Json ScaleJson(const EstimatorReport& report, const std::vector<ScaleAt>& history) {
  const MapScale& scale = report.map_scale;
  if (!scale.fused.has_value()) return nullptr;
  Json json = {{"sigma", scale.fused->sigma},
               {"log_correction", scale.fused->log_scale},
               {"wheels", ToJson(scale.wheels)},
               {"laser", ToJson(scale.laser)},
               {"floor", ToJson(scale.floor)},
               {"consistent", scale.consistent},
               {"slipped_steps", scale.track.has_value() ? scale.track->slipped : 0}};
  json["known_after_meters"] = report.scale_known_after.has_value() ? Json(*report.scale_known_after) : Json(nullptr);
  json["history"] = HistoryJson(history);
  if (report.scale.has_value()) {
    json["recovered"] = {{"by_steps", report.scale->by_steps},
                         {"by_centroids", report.scale->by_centroids},
                         {"applied", report.scale->applied},
                         {"keyframe", report.scale->keyframe.value},
                         {"t", report.scale->stamp.Seconds()}};
  }
  return json;
}

// The factors that the wheels' readings are multiplied by, learned while mapping.
Json WheelsJson(const WheelErrors& wheels) {
  return {{"length", std::exp(wheels.log_length)},
          {"length_sigma", wheels.length_sigma},
          {"turn", std::exp(wheels.log_turn)},
          {"turn_sigma", wheels.turn_sigma},
          {"noise", {{"way", wheels.noise.way}, {"turn", wheels.noise.turn}}}};
}

void AddFrames(const EstimatorReport& report, const RunResult& result, const Map* map, Json* json) {
  for (const TrackingState state : {TrackingState::kInitializing, TrackingState::kTracking, TrackingState::kRelocalized,
                                    TrackingState::kOdometry, TrackingState::kLost}) {
    const auto it = report.frames.find(state);
    (*json)["frames"][ToString(state)] = it == report.frames.end() ? 0 : it->second;
  }
  (*json)["frames"]["total"] = result.frames.size();
  (*json)["frames_dropped"] = result.frames_dropped;
  (*json)["recorded_seconds"] = result.recorded_seconds;
  (*json)["initialized_after_seconds"] = report.initialized.has_value() && !result.frames.empty()
                                             ? Json(SecondsBetween(result.frames.front().stamp, *report.initialized))
                                             : Json(nullptr);
  if (map == nullptr && !result.frames.empty()) (*json)["waiting_for"] = result.frames.back().waiting_for;
}

void AddMap(const EstimatorReport& report, const RunResult& result, const Map& map, Json* json) {
  (*json)["metric"] = map.metric;
  (*json)["scale"] = ScaleJson(report, result.scale_history);
  (*json)["wheels"] = WheelsJson(report.wheels);
  (*json)["keyframes"] = map.keyframes.size();
  (*json)["keyframes_made"] = report.keyframes_made;
  (*json)["keyframes_culled"] = report.keyframes_culled;
  (*json)["points"] = map.landmarks.size();
  long off_floor = 0;
  std::size_t laser_links = 0;
  for (const auto& [id, keyframe] : map.keyframes) {
    off_floor += keyframe.on_floor ? 0 : 1;
    laser_links += keyframe.laser_links.size();
  }
  (*json)["keyframes_off_floor"] = off_floor;
  (*json)["laser_links"] = laser_links;
  const MapPlanes planes = map.keyframes.empty() ? MapPlanes{} : PlanesOf(map, PlaneOptions{});
  (*json)["floor"] = nullptr;
  if (planes.floor.has_value()) {
    (*json)["floor"] = {{"height", planes.floor->height},
                        {"tilt_deg", planes.floor->TiltDegrees()},
                        {"points", planes.floor->points},
                        {"rms", planes.floor->rms}};
  }
  (*json)["walls"] = planes.walls.size();
}

double DegreesOf(const Rigid3& T) { return RadiansToDegrees(LogSo3(T.rotation).norm()); }

void AddLoops(const EstimatorReport& report, Json* json) {
  (*json)["loops"] = Json::array();
  for (const auto& [loop, keyframe, in_map] : report.loops) {
    (*json)["loops"].push_back({{"t", keyframe.Seconds()},
                                {"in_map_t", in_map.Seconds()},
                                {"old_keyframe", loop.old.value},
                                {"moved", loop.T_before_after.translation.norm()},
                                {"turned_deg", DegreesOf(loop.T_before_after)}});
  }
  (*json)["map_joined"] = nullptr;
  if (report.joined.has_value()) {
    (*json)["map_joined"] = {{"t", report.joined->keyframe.Seconds()},
                             {"in_map_t", report.joined->in_map.Seconds()},
                             {"places", report.joined->places},
                             {"moved", report.joined->T_known_own.translation.norm()},
                             {"turned_deg", DegreesOf(report.joined->T_known_own)}};
  }
  (*json)["own_map"] = report.own_map && !report.joined.has_value();
}

void AddInput(const EstimatorReport& report, const RunResult& result, Json* json) {
  (*json)["odometry_rejected"] = report.odometry_rejected;
  (*json)["slips"] = report.slips;
  const std::optional<Deviation>& missed = report.missed_readout;
  (*json)["missed_readout"] = missed.has_value() ? Json{{"seconds", missed->value}, {"sigma", missed->sigma}} : Json();
  const std::optional<ImageOffset>& offset = report.image_offset;
  (*json)["image_offset"] = offset.has_value() ? Json{{"seconds", offset->value}, {"sigma", offset->sigma}} : Json();
  (*json)["odometry_covariance"] = {{"by_model", report.odometry_by_model},
                                    {"by_messages", report.odometry_by_messages}};
  (*json)["findings"] = result.findings;
  (*json)["unused_input"] = result.unused_input.empty() ? Json(Json::object()) : Json(result.unused_input);
}

void AddAdjustments(const EstimatorReport& report, const RunResult& result, Json* json) {
  (*json)["adjustments"] = {{"count", report.adjustments}, {"iterations", report.adjustment_iterations}};
  (*json)["failed_adjustments"] = Json::object();
  for (const auto& [reason, count] : report.failed_adjustments) (*json)["failed_adjustments"][reason] = count;
  (*json)["final_adjustment"] = result.final_adjustment.empty() ? Json("done") : Json(result.final_adjustment);
}

Json ReportJson(const Estimator& estimator, const RunResult& result, bool deterministic) {
  const EstimatorReport& report = estimator.report();
  const std::shared_ptr<const Map> map = estimator.map();
  Json json;
  AddFrames(report, result, map.get(), &json);
  AddMap(report, result, map != nullptr ? *map : Map{}, &json);
  AddLoops(report, &json);
  AddInput(report, result, &json);
  AddAdjustments(report, result, &json);
  if (!deterministic) json["timing"] = Timing(result, report.stages);
  for (const auto& [key, value] : OptionValues(estimator.settings().options)) json["configuration"][key] = value;
  return json;
}

Expected<bool> WriteMaps(const fs::path& folder, const Map& map, const CameraModel& camera,
                         const PipelineOptions& options) {
  if (Expected<bool> done = SaveMapFile(map, camera, folder / "map.pvm"); !done.ok()) return done;
  if (Expected<bool> done = WritePcd(LandmarkCloud(map), folder / "points.pcd"); !done.ok()) return done;
  if (!map.metric) return true;
  const MapBuilder builder =
      BuildNavigationMap(map, camera, options.mapping2d, LandmarkAcceptance::For(options.pixel_sigma));
  if (Expected<bool> done = builder.WriteOctomap(folder / "map.bt"); !done.ok()) return done;
  return WriteMapServerFiles(builder.Grid(), folder / "map.yaml");
}

}  // namespace

Expected<bool> WriteRunOutputs(const fs::path& folder, const Estimator& estimator, const RunResult& result,
                               bool deterministic) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return Error{fmt::format("{}: cannot be created: {}", folder.string(), failed.message())};
  const std::shared_ptr<const Map> map = estimator.map();
  const Trajectory trajectory = map != nullptr ? ToTrajectory(estimator.trajectory().Poses(*map)) : Trajectory{};
  const Trajectory keyframes = map != nullptr ? KeyframeTrajectory(*map) : Trajectory{};
  for (const auto& [name, poses] : {std::pair("trajectory.txt", &trajectory), std::pair("keyframes.txt", &keyframes)}) {
    if (Expected<bool> done = WriteTrajectory(*poses, folder / name); !done.ok()) return done;
  }
  if (Expected<bool> done =
          WriteTrajectory(LiveTrajectory(result, map != nullptr && map->metric), folder / "trajectory_live.txt");
      !done.ok())
    return done;
  if (Expected<bool> done =
          WriteCovariances(LiveCovariances(result, map != nullptr && map->metric), folder / "covariance_live.csv");
      !done.ok())
    return done;
  if (estimator.report().scale.has_value()) {
    const Trajectory cameras = ToTrajectory(estimator.report().scale->unscaled_cameras);
    if (Expected<bool> done = WriteTrajectory(cameras, folder / "scale_cameras.txt"); !done.ok()) return done;
  }
  if (Expected<bool> done = WriteText(folder / "status.csv", StatusCsv(result, deterministic)); !done.ok()) return done;
  if (map != nullptr) {
    if (Expected<bool> done = WriteMaps(folder, *map, estimator.map_camera(), estimator.settings().options); !done.ok())
      return done;
  }
  return WriteText(folder / "report.json", ReportJson(estimator, result, deterministic).dump(2) + "\n");
}

}  // namespace planar_vslam
