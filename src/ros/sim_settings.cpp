#include "sim_settings.h"

#include <fmt/format.h>

#include <cmath>

#include "parameter_reader.h"
#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/sim/world_files.h"

namespace planar_vslam::ros_face {
namespace {

constexpr int kMostThreads = 256;

// At least 0, which infinity and "not a number" are not.
void RequireNotNegative(ParameterReader* reader, const std::string& name, double value) {
  if (!(value >= 0.0 && std::isfinite(value)))
    reader->Report(name, fmt::format("is {}; expected a number of at least 0", value));
}

void ReadStart(ParameterReader* reader, LiveOptions* options) {
  std::vector<double> start;
  reader->Read("start", "[x, y, yaw] in m, m and degrees", &start);
  if (start.empty()) return;
  if (start.size() != 3) {
    reader->Report("start", fmt::format("has {} numbers; expected [x, y, yaw] in m, m and degrees", start.size()));
    return;
  }
  options->start = Rigid2(start[0], start[1], DegreesToRadians(start[2]));
}

}  // namespace

SimSettings ReadSimSettings(const ros::NodeHandle& node, std::vector<std::string>* problems) {
  SimSettings settings;
  WorldChoice choice;
  choice.world = "sample_lab";
  std::string drive;
  int seed = 1;
  LiveOptions options;
  ParameterReader reader(node, problems);
  reader.Read("world", "a world file, or the name of a shipped world", &choice.world);
  reader.Read("seed", "a whole number", &seed);
  reader.Read("variants", "a list of NAME or NAME=VALUE", &choice.variants);
  reader.Read("drive", "mapping, repeat, reverse, or empty: cmd_vel", &drive);
  reader.Read("rate", "a number (simulated seconds in a second; 0: as fast as possible)", &settings.rate);
  reader.Read("start_delay", "a number (s)", &settings.start_delay);
  reader.Read("people_wait", "true or false", &options.people_wait);
  reader.Read("threads", "a whole number", &options.threads);
  ReadStart(&reader, &options);
  RequireNotNegative(&reader, "rate", settings.rate);
  RequireNotNegative(&reader, "start_delay", settings.start_delay);
  RequireNotNegative(&reader, "seed", seed);
  if (options.threads < 1 || options.threads > kMostThreads)
    reader.Report("threads", fmt::format("is {}; expected 1 to {}", options.threads, kMostThreads));
  reader.RefuseUnknown();
  if (!problems->empty()) return settings;
  settings.world_name = choice.world;
  choice.seed = options.seed = static_cast<std::uint64_t>(seed);
  options.follow_drive = !drive.empty();
  if (options.follow_drive) choice.drive = drive;
  const Expected<World> world = OpenWorld(choice);
  if (!world) {
    reader.Report("world", world.error().message);
    return settings;
  }
  Expected<LiveSimulation> robot = LiveSimulation::Create(*world, options);
  if (robot)
    settings.robot = std::move(*robot);
  else
    reader.Report(options.start.has_value() ? "start" : "world", robot.error().message);
  return settings;
}

}  // namespace planar_vslam::ros_face
