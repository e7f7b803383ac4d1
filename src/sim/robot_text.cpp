#include "robot_text.h"

#include "text_fields.h"

namespace planar_vslam::sim {
namespace {

FlowMap TextOfLimits(const LimitsSpec& limits) {
  FlowMap map;
  map.Add("speed", limits.speed).Add("sideways_speed", limits.sideways_speed).Add("acceleration", limits.acceleration);
  map.AddDegrees("turn_rate_deg", limits.turn_rate).AddDegrees("turn_acceleration_deg", limits.turn_acceleration);
  return map.Add("command_timeout", limits.command_timeout);
}

FlowMap TextOfCamera(const CameraSpec& camera) {
  const CameraModel& m = camera.model;
  FlowMap map;
  map.Add("size", std::vector<int>{m.width, m.height}).Add("focal", Eigen::Vector2d(m.fx, m.fy));
  map.Add("center", Eigen::Vector2d(m.cx, m.cy)).Add("distortion", Eigen::Vector4d(m.k1, m.k2, m.p1, m.p2));
  map.Add("rate", camera.rate).Add("position", camera.position).AddDegrees("tilt_down_deg", camera.tilt_down);
  map.AddDegrees("shake_deg", camera.shake).Add("noise", camera.noise).Add("exposure", camera.exposure);
  map.Add("auto_exposure", camera.auto_exposure).Add("exposure_target", camera.exposure_target);
  map.Add("exposure_response", camera.exposure_response).AddMilliseconds("exposure_ms", camera.exposure_time);
  map.AddMilliseconds("longest_exposure_ms", camera.longest_exposure);
  map.AddMilliseconds("rolling_shutter_ms", camera.rolling_shutter);
  return map.AddMilliseconds("time_offset_ms", camera.time_offset);
}

FlowMap TextOfHead(const HeadSpec& head) {
  FlowMap map;
  std::vector<Eigen::Vector3d> motion;
  for (const HeadPose& pose : head.motion)
    motion.emplace_back(pose.time, RadiansToDegrees(pose.pan), RadiansToDegrees(pose.tilt));
  map.Add("neck", head.neck).Add("motion", motion).Add("period", head.period);
  return map.AddDegrees("backlash_deg", head.backlash);
}

FlowMap TextOfLaser(const LaserSpec& laser) {
  FlowMap map;
  switch (laser.kind) {
    case LaserKind::kFull:
      map.Add("kind", "full");
      break;
    case LaserKind::kPepper:
      map.Add("kind", "pepper");
      break;
    case LaserKind::kNone:
      map.Add("kind", "none");
      break;
  }
  map.Add("rate", laser.rate).Add("height", laser.height).AddDegrees("field_of_view_deg", laser.field_of_view);
  return map.Add("beams", laser.beams).Add("range_max", laser.range_max).Add("noise", laser.noise);
}

FlowMap TextOfOdometry(const OdometrySpec& odometry) {
  FlowMap map;
  map.Add("rate", odometry.rate).Add("scale", odometry.scale).Add("yaw_scale", odometry.yaw_scale);
  map.Add("translation_noise", odometry.translation_noise);
  return map.AddDegrees("rotation_noise_deg", odometry.rotation_noise);
}

std::vector<FlowMap> TextOfSpans(const std::vector<SpanSpec>& spans) {
  std::vector<FlowMap> items;
  for (const SpanSpec& span : spans) items.push_back(FlowMap().Add("at", span.at).Add("duration", span.duration));
  return items;
}

std::string TextOfEvents(const EventsSpec& events) {
  const std::string indent = "  ";
  std::vector<FlowMap> slips, kidnaps;
  for (const SlipSpec& slip : events.slips)
    slips.push_back(FlowMap().Add("at", slip.at).Add("duration", slip.duration).Add("factor", slip.factor));
  for (const KidnapSpec& kidnap : events.kidnaps)
    kidnaps.push_back(FlowMap().Add("at", kidnap.at).Add("skip", kidnap.skip));
  std::string text = TextOfList("slips", slips, indent) + TextOfList("kidnaps", kidnaps, indent) +
                     TextOfList("blackouts", TextOfSpans(events.blackouts), indent) +
                     TextOfList("occlusions", TextOfSpans(events.occlusions), indent);
  const RandomSlipSpec& random = events.random_slips;
  if (random.rate > 0.0) {
    FlowMap map;
    map.Add("rate", random.rate).Add("duration", random.duration).Add("spinning", random.spinning);
    text += fmt::format("{}random_slips: {}\n", indent, map.Add("skidding", random.skidding).text());
  }
  return text.empty() ? "" : "events:\n" + text;
}

}  // namespace

std::string TextOfDrive(const char* key, const DriveSpec& drive) {
  const Eigen::Vector3d start(drive.start.translation.x(), drive.start.translation.y(),
                              RadiansToDegrees(drive.start.angle));
  std::string text = fmt::format("{}:\n", key);
  const auto line = [&text](const char* name, const auto& value) {
    text += fmt::format("  {}: {}\n", name, TextOf(value));
  };
  line("base", drive.base == BaseKind::kDifferential ? "differential" : "omnidirectional");
  line("start", start);
  line("shuffle", drive.shuffle);
  line("waypoints", drive.waypoints);
  line("laps", drive.laps);
  line("speed", drive.speed);
  line("sideways_speed", drive.sideways_speed);
  line("acceleration", drive.acceleration);
  line("turn_rate_deg", RadiansToDegrees(drive.turn_rate));
  line("turn_acceleration_deg", RadiansToDegrees(drive.turn_acceleration));
  line("robot_radius", drive.robot_radius);
  return text;
}

std::string TextOfRobot(const World& world) {
  std::string text = fmt::format("limits: {}\n", TextOfLimits(world.limits).text());
  text += fmt::format("camera: {}\n", TextOfCamera(world.camera).text());
  if (!world.head.motion.empty()) text += fmt::format("head: {}\n", TextOfHead(world.head).text());
  text += fmt::format("laser: {}\n", TextOfLaser(world.laser).text());
  text += fmt::format("odometry: {}\n", TextOfOdometry(world.odometry).text());
  return text + TextOfEvents(world.events);
}

}  // namespace planar_vslam::sim
