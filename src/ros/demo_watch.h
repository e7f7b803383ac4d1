#pragma once
// What demo_goals sees of the other nodes, and what it asks of them. One thread: callbacks run while it waits.
#include <actionlib/client/simple_action_client.h>
#include <diagnostic_msgs/DiagnosticArray.h>
#include <move_base_msgs/MoveBaseAction.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <planar_vslam/State.h>
#include <ros/ros.h>
#include <std_msgs/Bool.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam::ros_face {

struct Placement {
  Rigid2 T_world_map;
  std::size_t poses;
  double rms;  // m, of the poses off the truth
};

struct GoalOutcome {
  bool reached;
  std::string text;
};

class DemoWatch {
 public:
  explicit DemoWatch(double patience);  // s of wall time that anything may take but driving

  // Each says what went wrong.
  std::optional<Error> WaitForDrive();
  std::optional<Error> AdjustMap();
  std::optional<Error> SetMode(const std::string& mode);
  std::optional<Error> SaveMap(const std::string& name);
  std::optional<Error> LoadMap(const std::string& name);
  // Turns in place until camera or laser say where the robot is.
  std::optional<Error> FindPlace();
  // Lays the path of the mapping drive, as it is now, over the truth.
  Expected<Placement> PlaceMap();
  Expected<OccupancyGrid2d> Map();
  // `longest` in s of simulated time.
  Expected<GoalOutcome> DriveTo(const Rigid2& T_map_goal, double longest);
  // Until the simulator has said how often the robot collided.
  void Settle();

  Rigid2 T_world_base() const { return truth_.empty() ? Rigid2() : truth_.rbegin()->second; }
  long collisions() const { return collisions_; }

 private:
  // An Error with `complaint` where it has not become true in time, or ROS ends.
  std::optional<Error> WaitUntil(const std::function<bool()>& true_yet, double patience, const std::string& complaint);
  template <class Service>
  std::optional<Error> Ask(const std::string& name, Service* service);
  void OnDiagnostics(const diagnostic_msgs::DiagnosticArray& message);

  double patience_;
  ros::NodeHandle node_;
  actionlib::SimpleActionClient<move_base_msgs::MoveBaseAction> action_;
  std::map<ros::Time, Rigid2> truth_;  // T_world_base by stamp
  nav_msgs::Path path_;
  State state_;
  long collisions_ = 0, reports_ = 0;
  bool drive_over_ = false;
  ros::Publisher cmd_vel_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace planar_vslam::ros_face
