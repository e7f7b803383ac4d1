#include "run_time_server.h"

#include <dynamic_reconfigure/server.h>
#include <fmt/format.h>
#include <planar_vslam/SlamConfig.h>

#include <utility>

namespace planar_vslam::ros_face {
namespace {

RunTimeSettings FromConfig(const SlamConfig& config) {
  return {config.tf_rate,           config.transform_tolerance, config.map_period,
          config.map_points_period, config.obstacle_band_min,   config.obstacle_band_max};
}

SlamConfig ToConfig(const RunTimeSettings& settings) {
  SlamConfig config;
  config.tf_rate = settings.tf_rate;
  config.transform_tolerance = settings.transform_tolerance;
  config.map_period = settings.map_period;
  config.map_points_period = settings.map_points_period;
  config.obstacle_band_min = settings.band_min;
  config.obstacle_band_max = settings.band_max;
  return config;
}

}  // namespace

std::vector<std::string> RunTimeProblems(const RunTimeSettings& settings) {
  std::vector<std::string> problems;
  const SlamConfig &least = SlamConfig::__getMin__(), &most = SlamConfig::__getMax__();
  const SlamConfig config = ToConfig(settings);
  const std::pair<const char*, double SlamConfig::*> fields[] = {
      {"tf_rate", &SlamConfig::tf_rate},
      {"transform_tolerance", &SlamConfig::transform_tolerance},
      {"map_period", &SlamConfig::map_period},
      {"map_points_period", &SlamConfig::map_points_period},
      {"obstacle_band_min", &SlamConfig::obstacle_band_min},
      {"obstacle_band_max", &SlamConfig::obstacle_band_max}};
  for (const auto& [name, field] : fields) {
    if (config.*field >= least.*field && config.*field <= most.*field) continue;
    problems.push_back(fmt::format("{}: is {}; expected {} to {}", name, config.*field, least.*field, most.*field));
  }
  if (!(settings.band_min < settings.band_max)) {
    problems.push_back(fmt::format("obstacle_band_max: is {}; expected more than obstacle_band_min, {}",
                                   settings.band_max, settings.band_min));
  }
  return problems;
}

class RunTimeServer::Implementation {
 public:
  Implementation(const ros::NodeHandle& node, const RunTimeSettings& start,
                 std::function<void(const RunTimeSettings&)> apply)
      : current_(start), apply_(std::move(apply)), server_(mutex_, WithParameters(node, start)) {
    server_.setCallback([this](SlamConfig& config, std::uint32_t) { Change(&config); });
  }

 private:
  // The server begins with what it finds there.
  static const ros::NodeHandle& WithParameters(const ros::NodeHandle& node, const RunTimeSettings& start) {
    ToConfig(start).__toServer__(node);
    return node;
  }
  // What is left in `config` is told to who asked.
  void Change(SlamConfig* config) {
    const RunTimeSettings wanted = FromConfig(*config);
    const std::vector<std::string> problems = RunTimeProblems(wanted);
    for (const std::string& problem : problems) ROS_WARN("%s: nothing is changed", problem.c_str());
    if (problems.empty()) {
      current_ = wanted;
      apply_(wanted);
    }
    *config = ToConfig(current_);
  }

  RunTimeSettings current_;
  const std::function<void(const RunTimeSettings&)> apply_;
  boost::recursive_mutex mutex_;
  dynamic_reconfigure::Server<SlamConfig> server_;
};

RunTimeServer::RunTimeServer(const ros::NodeHandle& node, const RunTimeSettings& start,
                             std::function<void(const RunTimeSettings&)> apply)
    : implementation_(std::make_unique<Implementation>(node, start, std::move(apply))) {}

RunTimeServer::~RunTimeServer() = default;

}  // namespace planar_vslam::ros_face
