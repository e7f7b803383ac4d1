#include "services.h"

#include <fmt/format.h>
#include <nav_msgs/GetMap.h>
#include <planar_vslam/LoadMap.h>
#include <planar_vslam/SaveMap.h>
#include <planar_vslam/SetMode.h>
#include <ros/console.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include <utility>

#include "map_files.h"

namespace planar_vslam::ros_face {
namespace {

template <class Response>
bool Answer(const Expected<std::string>& result, Response* response) {
  response->success = result.ok();
  response->message = result.ok() ? *result : result.error().message;
  return true;
}

}  // namespace

Services::Services(const ros::NodeHandle& node, const NodeSettings& settings, TrackingThread* tracking,
                   MapPublisher* maps)
    : settings_(settings), tracking_(tracking), maps_(maps), node_(node) {
  node_.setCallbackQueue(&queue_);
  AdvertiseMaps();
  AdvertiseCommands();
  spinner_.start();
}

Expected<bool> Services::Do(const std::function<Expected<bool>(TrackingLoop&)>& act) {
  try {
    return tracking_->Ask<Expected<bool>>(act);
  } catch (const std::future_error&) {
    return Error{"the node stops"};
  }
}

void Services::AdvertiseMaps() {
  using Save = planar_vslam::SaveMap;
  const boost::function<bool(Save::Request&, Save::Response&)> save =
      [this](Save::Request& request, Save::Response& response) { return Answer(SaveMap(request.name), &response); };
  servers_.push_back(node_.advertiseService("save_map", save));
  using Load = planar_vslam::LoadMap;
  const boost::function<bool(Load::Request&, Load::Response&)> load =
      [this](Load::Request& request, Load::Response& response) { return Answer(LoadMap(request.name), &response); };
  servers_.push_back(node_.advertiseService("load_map", load));
  using Get = nav_msgs::GetMap;
  const boost::function<bool(Get::Request&, Get::Response&)> get = [this](Get::Request&, Get::Response& response) {
    const std::optional<nav_msgs::OccupancyGrid> grid = maps_->grid();
    if (grid.has_value()) response.map = *grid;
    if (!grid.has_value()) ROS_WARN("static_map: there is no grid yet");
    return grid.has_value();
  };
  servers_.push_back(node_.advertiseService("static_map", get));
}

void Services::AdvertiseCommands() {
  using Mode = planar_vslam::SetMode;
  const boost::function<bool(Mode::Request&, Mode::Response&)> set_mode =
      [this](Mode::Request& request, Mode::Response& response) { return Answer(SetMode(request.mode), &response); };
  servers_.push_back(node_.advertiseService("set_mode", set_mode));
  const auto always = [](auto act) {
    return [act](TrackingLoop& loop) -> Expected<bool> {
      act(loop);
      return true;
    };
  };
  Advertise("reset", always([](TrackingLoop& loop) { loop.Restart(); }), "map and trajectory dropped");
  Advertise("pause", always([](TrackingLoop& loop) { loop.Pause(true); }), "images are not used until resume");
  Advertise("resume", always([](TrackingLoop& loop) { loop.Pause(false); }), "images are used");
  Advertise(
      "global_bundle_adjustment", [](TrackingLoop& loop) { return loop.AdjustMap(); },
      "the whole map is adjusted next, in the background");
  using Empty = std_srvs::Empty;
  const boost::function<bool(Empty::Request&, Empty::Response&)> find = [this](Empty::Request&, Empty::Response&) {
    const auto found = Do([](TrackingLoop& loop) { return loop.FindPlaceAnew(); });
    if (!found.ok()) ROS_WARN("global_localization: %s", found.error().message.c_str());
    return found.ok();
  };
  servers_.push_back(node_.advertiseService("global_localization", find));
  using Pose = geometry_msgs::PoseWithCovarianceStamped;
  const boost::function<void(const Pose::ConstPtr&)> start = [this](const Pose::ConstPtr& pose) {
    const auto started = Do([&](TrackingLoop& loop) { return loop.StartAt(*pose); });
    if (!started.ok()) ROS_WARN("initialpose: %s", started.error().message.c_str());
  };
  initial_pose_ = node_.subscribe<Pose>("initialpose", 1, start);
}

void Services::Advertise(const std::string& name, std::function<Expected<bool>(TrackingLoop&)> act,
                         const std::string& done) {
  using Trigger = std_srvs::Trigger;
  const boost::function<bool(Trigger::Request&, Trigger::Response&)> answer =
      [this, act = std::move(act), done](Trigger::Request&, Trigger::Response& response) {
        const Expected<bool> result = Do(act);
        return Answer(result.ok() ? Expected<std::string>(done) : Expected<std::string>(result.error()), &response);
      };
  servers_.push_back(node_.advertiseService(name, answer));
}

Expected<std::string> Services::SaveMap(const std::string& name) {
  std::optional<EstimatorSnapshot> snapshot;
  const auto taken = Do([&snapshot](TrackingLoop& loop) -> Expected<bool> {
    snapshot = loop.Snapshot();
    return true;
  });
  if (!taken.ok()) return taken.error();
  if (!snapshot.has_value()) return Error{"there is no map yet"};
  const Expected<std::filesystem::path> file = SaveMapFiles(*snapshot, maps_->settings(), name);
  if (!file.ok()) return file.error();
  return file->string();
}

Expected<std::string> Services::LoadMap(const std::string& name) {
  const Expected<std::filesystem::path> file = ResolveMapName(settings_.map_directory, name, ".pvm");
  if (!file.ok()) return file.error();
  const Expected<SavedMap> saved = LoadMapFile(*file);
  if (!saved.ok()) return saved.error();
  const auto loaded = Do([&](TrackingLoop& loop) { return loop.LoadMap(*saved); });
  if (!loaded.ok()) return Error{fmt::format("{}: {}", file->string(), loaded.error().message)};
  return file->string();
}

Expected<std::string> Services::SetMode(const std::string& mode) {
  if (mode != "mapping" && mode != "localization") {
    return Error{fmt::format("mode: is '{}'; expected mapping or localization", mode)};
  }
  const RunMode wanted = mode == "mapping" ? RunMode::kMapping : RunMode::kLocalization;
  const auto set = Do([&](TrackingLoop& loop) { return loop.SetMode(wanted); });
  if (!set.ok()) return set.error();
  return "mode " + mode;
}

}  // namespace planar_vslam::ros_face
