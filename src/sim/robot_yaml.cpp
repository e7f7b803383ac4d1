// The robot's part of a world file.
#include "robot_yaml.h"

#include <fmt/format.h>

#include <cmath>

#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/geometry/check.h"
#include "planar_vslam/sensor/lens.h"

namespace planar_vslam::sim {

void ReadDegrees(YamlFields& fields, const std::string& key, double* radians) {
  double degrees = RadiansToDegrees(*radians);
  fields.Read(key, &degrees);
  if (fields.Has(key)) *radians = DegreesToRadians(degrees);
}

namespace {

void ReadMilliseconds(YamlFields& fields, const std::string& key, double* seconds) {
  double milliseconds = 1e3 * *seconds;
  fields.Read(key, &milliseconds);
  if (fields.Has(key)) *seconds = 1e-3 * milliseconds;
}

}  // namespace

std::vector<Eigen::Vector2d> ReadPoints(YamlFields& fields, const std::string& key) {
  std::vector<Eigen::Vector2d> points;
  const std::vector<YAML::Node> items = fields.Items(key);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::vector<double> point =
        fields.ListOf(items[i], fmt::format("{}[{}]", key, i), 2, "expected [x, y] in metres");
    if (!point.empty()) points.emplace_back(point[0], point[1]);
  }
  return points;
}

void ReadDrive(YamlFields fields, DriveSpec* drive) {
  Eigen::Vector3d start(0, 0, 0);  // m, m, deg
  fields.Require("start");
  fields.Read("start", &start);
  drive->start = Rigid2(start.x(), start.y(), DegreesToRadians(start.z()));
  fields.ReadEnum("base", {"omnidirectional", "differential"}, &drive->base);
  drive->waypoints = ReadPoints(fields, "waypoints");
  fields.Read("shuffle", &drive->shuffle);
  fields.Read("laps", &drive->laps);
  fields.Read("speed", &drive->speed);
  fields.Read("sideways_speed", &drive->sideways_speed);
  fields.Read("acceleration", &drive->acceleration);
  ReadDegrees(fields, "turn_rate_deg", &drive->turn_rate);
  ReadDegrees(fields, "turn_acceleration_deg", &drive->turn_acceleration);
  fields.Read("robot_radius", &drive->robot_radius);
  fields.Finish();
}

void ReadLimits(YamlFields fields, LimitsSpec* limits) {
  fields.Read("speed", &limits->speed);
  fields.Read("sideways_speed", &limits->sideways_speed);
  fields.Read("acceleration", &limits->acceleration);
  ReadDegrees(fields, "turn_rate_deg", &limits->turn_rate);
  ReadDegrees(fields, "turn_acceleration_deg", &limits->turn_acceleration);
  fields.Read("command_timeout", &limits->command_timeout);
  fields.Finish();
}

// `before`: whose lens is kept where the file says nothing.
LensText ReadLens(YamlFields& fields, const CameraModel& before) {
  const std::vector<std::string> models = {"plumb_bob", "equidistant", "rational_polynomial"};
  std::size_t model = 0;
  fields.ReadEnum("lens", models, &model);
  constexpr std::size_t kFew = 4, kRational = 8;
  const bool given = fields.Has("distortion");
  LensText lens{models[model], fields.Numbers("distortion", model == 2 ? kRational : kFew)};
  return given || fields.Has("lens") ? lens : DescribeLens(before);
}

void ReadCamera(YamlFields fields, CameraSpec* camera) {
  CameraModel& model = camera->model;
  Eigen::Vector2d focal(model.fx, model.fy), center(model.cx, model.cy), size(model.width, model.height);
  fields.Read("size", &size);
  fields.Read("focal", &focal);
  fields.Read("center", &center);
  const LensText lens = ReadLens(fields, model);
  const bool whole = size.x() == std::floor(size.x()) && size.y() == std::floor(size.y()) && size.norm() < 1e6;
  if (!whole) fields.errors()->Report(fields.Child("size").Mark(), "camera.size", "expected whole numbers of pixels");
  if (whole) {
    model = CameraModel();
    model.width = static_cast<int>(size.x());
    model.height = static_cast<int>(size.y());
    model.fx = focal.x();
    model.fy = focal.y();
    model.cx = center.x();
    model.cy = center.y();
    PV_CHECK(SetLens(lens, &model).ok(), "lens " << lens.model);
  }
  fields.Read("rate", &camera->rate);
  fields.Read("position", &camera->position);
  ReadDegrees(fields, "tilt_down_deg", &camera->tilt_down);
  ReadDegrees(fields, "shake_deg", &camera->shake);
  fields.Read("noise", &camera->noise);
  fields.Read("exposure", &camera->exposure);
  fields.Read("auto_exposure", &camera->auto_exposure);
  fields.Read("exposure_target", &camera->exposure_target);
  fields.Read("exposure_response", &camera->exposure_response);
  ReadMilliseconds(fields, "exposure_ms", &camera->exposure_time);
  ReadMilliseconds(fields, "longest_exposure_ms", &camera->longest_exposure);
  ReadMilliseconds(fields, "rolling_shutter_ms", &camera->rolling_shutter);
  ReadMilliseconds(fields, "time_offset_ms", &camera->time_offset);
  fields.Finish();
}

void ReadLaser(YamlFields fields, LaserSpec* laser) {
  fields.ReadEnum("kind", {"full", "pepper", "none"}, &laser->kind);
  if (laser->kind == LaserKind::kPepper) {
    // Three sectors of 15 beams each, 4 degrees apart, and what lies between them (naoqi_driver's message).
    laser->field_of_view = DegreesToRadians(240.0);
    laser->beams = 61;
    laser->range_max = 1.5;
  }
  fields.Read("rate", &laser->rate);
  fields.Read("height", &laser->height);
  ReadDegrees(fields, "field_of_view_deg", &laser->field_of_view);
  fields.Read("beams", &laser->beams);
  fields.Read("range_max", &laser->range_max);
  fields.Read("noise", &laser->noise);
  fields.Finish();
}

void ReadOdometry(YamlFields fields, OdometrySpec* odometry) {
  fields.Read("rate", &odometry->rate);
  fields.Read("scale", &odometry->scale);
  fields.Read("yaw_scale", &odometry->yaw_scale);
  fields.Read("translation_noise", &odometry->translation_noise);
  ReadDegrees(fields, "rotation_noise_deg", &odometry->rotation_noise);
  fields.Finish();
}

void ReadHead(YamlFields fields, HeadSpec* head) {
  fields.Read("neck", &head->neck);
  const std::vector<YAML::Node> items = fields.Items("motion");
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string key = fmt::format("motion[{}]", i);
    const std::vector<double> pose = fields.ListOf(items[i], key, 3, "expected [seconds, pan, tilt] in s and degrees");
    if (!pose.empty()) head->motion.push_back({pose[0], DegreesToRadians(pose[1]), DegreesToRadians(pose[2])});
  }
  fields.Read("period", &head->period);
  ReadDegrees(fields, "backlash_deg", &head->backlash);
  fields.Finish();
}

void ReadEvents(YamlFields fields, EventsSpec* events) {
  // Calls read(item) for every item of a list.
  const auto each = [&fields](const char* list, const auto& read) {
    const std::vector<YAML::Node> items = fields.Items(list);
    for (std::size_t i = 0; i < items.size(); ++i) {
      YamlFields item(items[i], fields.PathOf(fmt::format("{}[{}]", list, i)), fields.errors());
      item.Require("at");
      read(item);
      item.Finish();
    }
  };
  const auto read_span = [](YamlFields& item) {
    SpanSpec span;
    item.Read("at", &span.at);
    item.Read("duration", &span.duration);
    return span;
  };
  each("slips", [events](YamlFields& item) {
    SlipSpec slip;
    item.Read("at", &slip.at);
    item.Read("duration", &slip.duration);
    item.Read("factor", &slip.factor);
    events->slips.push_back(slip);
  });
  each("kidnaps", [events](YamlFields& item) {
    KidnapSpec kidnap;
    item.Read("at", &kidnap.at);
    item.Read("skip", &kidnap.skip);
    events->kidnaps.push_back(kidnap);
  });
  each("blackouts", [&](YamlFields& item) { events->blackouts.push_back(read_span(item)); });
  each("occlusions", [&](YamlFields& item) { events->occlusions.push_back(read_span(item)); });
  const YAML::Node random = fields.Child("random_slips");
  if (random.IsDefined()) {
    YamlFields slips(random, fields.PathOf("random_slips"), fields.errors());
    slips.Require("rate");
    slips.Read("rate", &events->random_slips.rate);
    slips.Read("duration", &events->random_slips.duration);
    slips.Read("spinning", &events->random_slips.spinning);
    slips.Read("skidding", &events->random_slips.skidding);
    slips.Finish();
  }
  fields.Finish();
}

}  // namespace planar_vslam::sim
