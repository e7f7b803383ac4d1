// demo_goals: after the simulated robot's mapping drive it saves the map, has slam_node localise in it, drives to goals
// by the action move_base, and measures where the robot truly ends. Exit status 0 where all went well, 1 where not.
#include <fmt/format.h>
#include <ros/ros.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "demo_settings.h"
#include "demo_watch.h"
#include "planar_vslam/navigate/goal_drawing.h"

namespace planar_vslam::ros_face {
namespace {

struct GoalResult {
  bool reached;
  double error_m, error_rad;  // true, at the end
  long collisions;
};

class Demo {
 public:
  explicit Demo(const DemoSettings& settings) : settings_(settings), watch_(settings.patience) {}

  Expected<bool> Run() {
    fmt::print("the robot follows its mapping drive\n");
    if (auto problem = watch_.WaitForDrive()) return *problem;
    const Expected<Rigid2> T_world_map = MapToLocalization();
    if (!T_world_map.ok()) return T_world_map.error();
    if (auto problem = watch_.FindPlace()) return *problem;
    const Expected<OccupancyGrid2d> map = watch_.Map();
    if (!map.ok()) return map.error();
    Costmap costmap{NavigateOptions()};
    if (!costmap.SetMap(*map)) return Error{"static_map: the grid is unusable"};
    const Rigid2 T_map_base = T_world_map->Inverse() * watch_.T_world_base();
    const std::vector<Rigid2> goals = DrawGoals(costmap, T_map_base.translation, settings_.drawing);
    if (goals.empty()) return Error{"no free place can be reached in the map"};
    std::vector<GoalResult> results;
    for (const Rigid2& T_map_goal : goals) {
      const Expected<GoalResult> result = DriveTo(static_cast<int>(results.size()) + 1, T_map_goal, *T_world_map);
      if (!result.ok()) return result.error();
      results.push_back(*result);
    }
    return Summarise(results);
  }

 private:
  // The map is adjusted, saved and loaded. T_world_map, by the truth of all poses of the drive.
  Expected<Rigid2> MapToLocalization() {
    for (const auto& ask : {watch_.AdjustMap(), watch_.SetMode("localization")}) {
      if (ask.has_value()) return *ask;
    }
    const Expected<Placement> placement = watch_.PlaceMap();
    if (!placement.ok()) return placement.error();
    fmt::print("mapped: {} poses, {:.3f} m RMS off the truth\n", placement->poses, placement->rms);
    for (const auto& ask : {watch_.SaveMap(settings_.map_name), watch_.LoadMap(settings_.map_name)}) {
      if (ask.has_value()) return *ask;
    }
    return placement->T_world_map;
  }

  Expected<GoalResult> DriveTo(int number, const Rigid2& T_map_goal, const Rigid2& T_world_map) {
    const double begun = ros::Time::now().toSec();
    const ros::WallTime wall = ros::WallTime::now();
    const long collisions = watch_.collisions();
    const Expected<GoalOutcome> outcome = watch_.DriveTo(T_map_goal, settings_.longest);
    if (!outcome.ok()) return outcome.error();
    const double seconds = ros::Time::now().toSec() - begun, passed = (ros::WallTime::now() - wall).toSec();
    watch_.Settle();
    const Rigid2 off = (T_world_map * T_map_goal).Inverse() * watch_.T_world_base();
    const GoalResult result{outcome->reached, off.translation.norm(), std::abs(off.angle),
                            watch_.collisions() - collisions};
    fmt::print("goal {:2}  {:<40} {:6.1f} s   off by {:.3f} m, {:4.1f} deg   {} collisions   {:.2f} of real time\n",
               number, outcome->reached ? "reached" : outcome->text, seconds, result.error_m,
               RadiansToDegrees(result.error_rad), result.collisions, seconds / passed);
    return result;
  }

  Expected<bool> Summarise(const std::vector<GoalResult>& results) const {
    std::size_t reached = 0;
    long collisions = 0;
    double worst_m = 0.0, worst_rad = 0.0;
    for (const GoalResult& result : results) {
      reached += result.reached ? 1U : 0U;
      collisions += result.collisions;
      if (!result.reached) continue;
      worst_m = std::max(worst_m, result.error_m);
      worst_rad = std::max(worst_rad, result.error_rad);
    }
    const bool good = reached == results.size() && collisions == 0 && worst_m <= settings_.largest_error &&
                      worst_rad <= settings_.largest_turn;
    fmt::print(
        "{} of {} goals reached, {} collisions, at most {:.3f} m (limit {:.2f}), {:.1f} deg (limit {:.0f}): {}\n",
        reached, results.size(), collisions, worst_m, settings_.largest_error, RadiansToDegrees(worst_rad),
        RadiansToDegrees(settings_.largest_turn), good ? "well" : "NOT WELL");
    return good;
  }

  DemoSettings settings_;
  DemoWatch watch_;
};

int Run() {
  constexpr int kExitBadInput = 2;
  std::vector<std::string> problems;
  const ros::NodeHandle private_node("~");
  const DemoSettings settings = ReadDemoSettings(private_node, &problems);
  for (const std::string& problem : problems) ROS_FATAL("%s", problem.c_str());
  if (!problems.empty()) return kExitBadInput;
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // lines as they come, also into a file
  const Expected<bool> result = Demo(settings).Run();
  if (!result.ok()) ROS_FATAL("%s", result.error().message.c_str());
  return result.ok() && *result ? 0 : 1;
}

}  // namespace
}  // namespace planar_vslam::ros_face

int main(int argc, char** argv) {
  ros::init(argc, argv, "demo_goals");
  return planar_vslam::ros_face::Run();
}
