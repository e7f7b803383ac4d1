#include "demo_settings.h"

#include "parameter_reader.h"

namespace planar_vslam::ros_face {

DemoSettings ReadDemoSettings(const ros::NodeHandle& node, std::vector<std::string>* problems) {
  DemoSettings settings;
  int seed = 1;
  double degrees = RadiansToDegrees(settings.largest_turn);
  ParameterReader reader(node, problems);
  reader.Read("goals", "a whole number", &settings.drawing.count);
  reader.Read("seed", "a whole number", &seed);
  reader.Read("map_name", "a name", &settings.map_name);
  reader.Read("max_error", "a number (m)", &settings.largest_error);
  reader.Read("max_error_deg", "a number (degrees)", &degrees);
  reader.Read("goal_timeout", "a number (s)", &settings.longest);
  reader.Read("patience", "a number (s)", &settings.patience);
  reader.RequirePositive("goals", settings.drawing.count);
  reader.RequirePositive("max_error", settings.largest_error);
  reader.RequirePositive("max_error_deg", degrees);
  reader.RequirePositive("goal_timeout", settings.longest);
  reader.RequirePositive("patience", settings.patience);
  if (seed < 0) reader.Report("seed", "is negative; expected a number of at least 0");
  reader.RefuseUnknown();
  settings.drawing.seed = static_cast<std::uint64_t>(seed);
  settings.largest_turn = DegreesToRadians(degrees);
  return settings;
}

}  // namespace planar_vslam::ros_face
