#include "demo_watch.h"

#include <fmt/format.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/GetMap.h>
#include <planar_vslam/LoadMap.h>
#include <planar_vslam/SaveMap.h>
#include <planar_vslam/SetMode.h>
#include <ros/callback_queue.h>
#include <std_srvs/Trigger.h>

#include <cmath>
#include <limits>

#include "converters.h"
#include "planar_pose.h"
#include "planar_vslam/geometry/alignment.h"

namespace planar_vslam::ros_face {
namespace {

constexpr double kTurnRate = 0.3;  // rad/s, while it looks for its place
constexpr double kForever = std::numeric_limits<double>::infinity();

template <class Message>
boost::function<void(const Message&)> Into(Message* target) {
  return [target](const Message& message) { *target = message; };
}

OccupancyGrid2d ToGrid(const nav_msgs::OccupancyGrid& message) {
  OccupancyGrid2d grid;
  grid.width = static_cast<int>(message.info.width);
  grid.height = static_cast<int>(message.info.height);
  grid.resolution = static_cast<double>(message.info.resolution);
  grid.origin = {message.info.origin.position.x, message.info.origin.position.y};
  grid.cells = message.data;
  return grid;
}

}  // namespace

DemoWatch::DemoWatch(double patience)
    : patience_(patience), action_("move_base", false), cmd_vel_(node_.advertise<geometry_msgs::Twist>("cmd_vel", 1)) {
  const boost::function<void(const nav_msgs::Odometry&)> on_truth = [this](const nav_msgs::Odometry& message) {
    truth_[message.header.stamp] = PlanarOf(message.pose.pose);
  };
  const boost::function<void(const std_msgs::Bool&)> on_drive = [this](const std_msgs::Bool& message) {
    drive_over_ = message.data != 0;
  };
  subscribers_ = {node_.subscribe<nav_msgs::Odometry>("ground_truth", 1000, on_truth),
                  node_.subscribe<std_msgs::Bool>("drive_over", 1, on_drive),
                  node_.subscribe<nav_msgs::Path>("path", 1, Into(&path_)),
                  node_.subscribe<State>("state", 10, Into(&state_)),
                  node_.subscribe("/diagnostics", 10, &DemoWatch::OnDiagnostics, this)};
}

void DemoWatch::OnDiagnostics(const diagnostic_msgs::DiagnosticArray& message) {
  for (const diagnostic_msgs::DiagnosticStatus& status : message.status) {
    for (const diagnostic_msgs::KeyValue& pair : status.values) {
      if (pair.key != "collisions") continue;
      collisions_ = std::strtol(pair.value.c_str(), nullptr, 10);
      ++reports_;
    }
  }
}

std::optional<Error> DemoWatch::WaitUntil(const std::function<bool()>& true_yet, double patience,
                                          const std::string& complaint) {
  const ros::WallTime begun = ros::WallTime::now();
  while (!true_yet()) {
    if (!ros::ok()) return Error{"the nodes ended"};
    if ((ros::WallTime::now() - begun).toSec() > patience) return Error{complaint};
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
  }
  return std::nullopt;
}

std::optional<Error> DemoWatch::WaitForDrive() {
  return WaitUntil([this] { return drive_over_; }, kForever, "");
}

template <class Service>
std::optional<Error> DemoWatch::Ask(const std::string& name, Service* service) {
  const auto offered = [&] { return ros::service::exists(name, false); };
  if (auto problem = WaitUntil(offered, patience_, "nobody offers the service " + name)) return problem;
  if (!ros::service::call(name, *service)) return Error{name + ": the call failed"};
  if (service->response.success == 0) return Error{name + ": " + service->response.message};
  return std::nullopt;
}

std::optional<Error> DemoWatch::AdjustMap() {
  std_srvs::Trigger service;
  return Ask("global_bundle_adjustment", &service);
}

std::optional<Error> DemoWatch::SetMode(const std::string& mode) {
  planar_vslam::SetMode service;
  service.request.mode = mode;
  return Ask("set_mode", &service);
}

std::optional<Error> DemoWatch::SaveMap(const std::string& name) {
  planar_vslam::SaveMap service;
  service.request.name = name;
  return Ask("save_map", &service);
}

std::optional<Error> DemoWatch::LoadMap(const std::string& name) {
  planar_vslam::LoadMap service;
  service.request.name = name;
  return Ask("load_map", &service);
}

Expected<Placement> DemoWatch::PlaceMap() {
  const ros::Time now = ros::Time::now();
  const auto newer = [&] { return path_.header.stamp > now && !path_.poses.empty(); };
  if (auto problem = WaitUntil(newer, patience_, "no path came")) return *problem;
  std::vector<Eigen::Vector3d> mapped, true_places;
  for (const geometry_msgs::PoseStamped& pose : path_.poses) {
    const auto truth = truth_.find(pose.header.stamp);
    if (truth == truth_.end()) continue;
    mapped.emplace_back(pose.pose.position.x, pose.pose.position.y, 0.0);
    true_places.emplace_back(truth->second.translation.x(), truth->second.translation.y(), 0.0);
  }
  constexpr std::size_t kFewest = 10;
  if (mapped.size() < kFewest) return Error{fmt::format("path: {} poses have a truth; expected more", mapped.size())};
  const Similarity3 fit = AlignPoints(mapped, true_places, Alignment::kSe2);
  double sum = 0.0;
  for (std::size_t i = 0; i < mapped.size(); ++i) sum += (fit.Apply(mapped[i]) - true_places[i]).squaredNorm();
  return Placement{ProjectToPlane(fit.T_target_source), mapped.size(),
                   std::sqrt(sum / static_cast<double>(mapped.size()))};
}

std::optional<Error> DemoWatch::FindPlace() {
  const ros::Time loaded = ros::Time::now();
  ros::WallTime told;
  geometry_msgs::Twist turn;
  turn.angular.z = kTurnRate;
  const auto found = [&] {
    constexpr double kEvery = 0.1;  // s of wall time
    if ((ros::WallTime::now() - told).toSec() > kEvery) {
      cmd_vel_.publish(turn);
      told = ros::WallTime::now();
    }
    return state_.header.stamp > loaded && (state_.localised_by == "camera" || state_.localised_by == "laser");
  };
  auto problem = WaitUntil(found, patience_, "the robot was not found in the map");
  cmd_vel_.publish(geometry_msgs::Twist());
  return problem;
}

Expected<OccupancyGrid2d> DemoWatch::Map() {
  nav_msgs::GetMap service;
  ros::WallTime asked;
  const auto given = [&] {
    if (ros::WallTime::now() - asked < ros::WallDuration(0.5)) return false;
    asked = ros::WallTime::now();
    return ros::service::exists("static_map", false) && ros::service::call("static_map", service);
  };
  if (auto problem = WaitUntil(given, patience_, "static_map: there is no grid")) return *problem;
  return ToGrid(service.response.map);
}

Expected<GoalOutcome> DemoWatch::DriveTo(const Rigid2& T_map_goal, double longest) {
  const auto offered = [this] { return action_.isServerConnected(); };
  if (auto problem = WaitUntil(offered, patience_, "nobody offers the action move_base")) return *problem;
  move_base_msgs::MoveBaseGoal goal;
  goal.target_pose.header.frame_id = "map";
  goal.target_pose.header.stamp = ros::Time::now();
  goal.target_pose.pose = ToPose(Embed3(T_map_goal));
  action_.sendGoal(goal);
  const ros::Time begun = ros::Time::now();
  const auto over = [&] { return action_.getState().isDone() || (ros::Time::now() - begun).toSec() > longest; };
  if (auto problem = WaitUntil(over, kForever, "")) return *problem;
  const auto state = action_.getState();
  if (state.isDone()) return GoalOutcome{state == state.SUCCEEDED, state.getText()};
  action_.cancelGoal();
  return GoalOutcome{false, fmt::format("not there after {} s", longest)};
}

void DemoWatch::Settle() {
  constexpr long kReports = 2;  // the first may have been under way
  const long until = reports_ + kReports;
  WaitUntil([&] { return reports_ >= until; }, patience_, "");
}

}  // namespace planar_vslam::ros_face
