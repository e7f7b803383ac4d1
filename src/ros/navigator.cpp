// navigator: move_base's action and topics for the small planner in navigate/. Everything runs in one thread.
#include <actionlib/server/simple_action_server.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/Twist.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <move_base_msgs/MoveBaseAction.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Path.h>
#include <planar_vslam/State.h>
#include <ros/ros.h>
#include <sensor_msgs/LaserScan.h>
#include <std_srvs/Empty.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <utility>

#include "converters.h"
#include "navigator_settings.h"
#include "planar_pose.h"
#include "planar_vslam/io/message_values.h"
#include "planar_vslam/navigate/navigator.h"

namespace planar_vslam::ros_face {
namespace {

constexpr double kPause = 5.0;  // s between two warnings of a kind

using ActionServer = actionlib::SimpleActionServer<move_base_msgs::MoveBaseAction>;

geometry_msgs::Pose ToPlanarPose(const Rigid2& T) { return ToPose(Embed3(T)); }

class NavigatorNode {
 public:
  NavigatorNode(ros::NodeHandle node, const ros::NodeHandle& private_node, const NavigatorSettings& settings)
      : settings_(settings),
        navigator_(settings.options),
        listener_(buffer_),
        private_node_(private_node),
        server_(node, "move_base", false),
        cmd_vel_(node.advertise<geometry_msgs::Twist>("cmd_vel", 1)),
        path_(private_node_.advertise<nav_msgs::Path>("NavfnROS/plan", 1, true)),
        goal_(node.advertise<move_base_msgs::MoveBaseActionGoal>("move_base/goal", 1)),
        map_(node.subscribe("map", 1, &NavigatorNode::OnMap, this)),
        map_updates_(node.subscribe("map_updates", 10, &NavigatorNode::OnMapUpdate, this)),
        scan_(node.subscribe("scan", 5, &NavigatorNode::OnScan, this)),
        pose_(node.subscribe("pose", 10, &NavigatorNode::OnPose, this)),
        state_(node.subscribe("state", 10, &NavigatorNode::OnState, this)),
        simple_goal_(node.subscribe("move_base_simple/goal", 1, &NavigatorNode::OnSimpleGoal, this)),
        clear_(private_node_.advertiseService("clear_costmaps", &NavigatorNode::OnClear, this)) {
    server_.registerGoalCallback([this] { OnGoal(); });
    server_.registerPreemptCallback([this] { OnPreempt(); });
    server_.start();
    timer_ = node.createTimer(ros::Duration(1.0 / settings_.rate), &NavigatorNode::OnTimer, this);
  }

 private:
  struct Ending {
    bool reached;
    std::string text;
  };
  struct Located {
    Rigid2 T;
    ros::Time stamp;  // zero: fixed
  };

  std::optional<Located> Lookup(const std::string& to, const std::string& from, const ros::Time& stamp) const {
    try {
      const geometry_msgs::TransformStamped found = buffer_.lookupTransform(to, from, stamp);
      return Located{ProjectToPlane(io::ToRigid3(found.transform)), found.header.stamp};
    } catch (const tf2::TransformException&) {
      return std::nullopt;
    }
  }

  void OnMap(const nav_msgs::OccupancyGrid& message) {
    OccupancyGrid2d grid;
    const double heading = HeadingOf(message.info.origin.orientation);
    grid.width = static_cast<int>(std::min<std::uint32_t>(message.info.width, 1U << 15U));
    grid.height = static_cast<int>(std::min<std::uint32_t>(message.info.height, 1U << 15U));
    grid.resolution = static_cast<double>(message.info.resolution);
    grid.origin = {message.info.origin.position.x, message.info.origin.position.y};
    grid.cells = message.data;
    const bool turned = std::isfinite(heading) && std::abs(heading) > 1e-6;
    if (turned || message.header.frame_id != settings_.map_frame || !navigator_.costmap().SetMap(std::move(grid)))
      ROS_WARN("map: unusable; expected cells in frame %s, an origin without rotation", settings_.map_frame.c_str());
  }

  void OnMapUpdate(const map_msgs::OccupancyGridUpdate& message) {
    constexpr std::uint32_t kMost = 1U << 15U;
    const GridRegion region{message.x, message.y, static_cast<int>(std::min(message.width, kMost)),
                            static_cast<int>(std::min(message.height, kMost))};
    if (!navigator_.costmap().UpdateMap(region, message.data)) ROS_WARN("map_updates: not a part of the map");
  }

  void OnScan(const sensor_msgs::LaserScan& message) {
    constexpr std::size_t kMostWaiting = 10;
    scans_.push_back(message);
    if (scans_.size() > kMostWaiting) scans_.pop_front();
  }

  // Those whose stamp odometry covers by now, in order.
  void UseScans(const std::optional<Located>& T_map_odom) {
    while (!scans_.empty()) {
      const sensor_msgs::LaserScan& message = scans_.front();
      const ros::Time stamp = message.header.stamp;
      if (!buffer_.canTransform(settings_.odom_frame, settings_.base_frame, stamp) ||
          !buffer_.canTransform(settings_.base_frame, message.header.frame_id, stamp)) {
        if (ros::Time::now() - stamp < ros::Duration(settings_.options.max_scan_age)) return;
        scans_.pop_front();
        continue;
      }
      const auto T_odom_base = Lookup(settings_.odom_frame, settings_.base_frame, stamp);
      const auto T_base_laser = Lookup(settings_.base_frame, message.header.frame_id, stamp);
      const Expected<PlanarScan> scan = io::ToPlanarScan(message);
      if (!scan) ROS_WARN_THROTTLE(kPause, "scan: %s", scan.error().message.c_str());
      if (scan.ok() && T_odom_base.has_value() && T_base_laser.has_value()) {
        std::optional<Rigid2> T_map_base;
        if (T_map_odom.has_value()) T_map_base = T_map_odom->T * T_odom_base->T;
        navigator_.AddSweep(stamp.toSec(), *scan, T_base_laser->T, T_odom_base->T, T_map_base);
      }
      scans_.pop_front();
    }
  }

  void OnPose(const geometry_msgs::PoseWithCovarianceStamped& message) {
    constexpr int kSize = 6, kYaw = 35;
    const auto& c = message.pose.covariance;
    // The larger eigenvalue of the position's covariance.
    const double mean = 0.5 * (c[0] + c[kSize + 1]), half = 0.5 * (c[0] - c[kSize + 1]);
    quality_ = PoseQuality{std::sqrt(mean + std::hypot(half, c[1])), std::sqrt(c[kYaw])};
    new_quality_ = true;
  }

  void OnState(const State& message) {
    state_at_ = ros::WallTime::now();
    constexpr double kFresh = 0.5;  // s; while no frame comes the state repeats itself, and only this grows
    const bool told = message.localised_by == "camera" || message.localised_by == "laser";
    source_ = told && message.time_since_fix < kFresh      ? PoseSource::kConfirmed
              : told || message.localised_by == "odometry" ? PoseSource::kWheels
                                                           : PoseSource::kNothing;
  }

  // A state that is no longer repeated, once a second of wall time at least, confirms nothing.
  PoseSource Source() const {
    constexpr double kSilent = 3.0;  // s
    const bool silent = ros::WallTime::now() - state_at_ > ros::WallDuration(kSilent);
    return silent && source_ == PoseSource::kConfirmed ? PoseSource::kWheels : source_;
  }

  void OnSimpleGoal(const geometry_msgs::PoseStamped& message) {
    move_base_msgs::MoveBaseActionGoal goal;
    goal.header.stamp = ros::Time::now();
    goal.goal.target_pose = message;
    goal_.publish(goal);
  }

  void OnGoal() {
    const geometry_msgs::PoseStamped target = server_.acceptNewGoal()->target_pose;
    accepted_ = ros::WallTime::now();
    ending_.reset();
    const auto T_map_frame = target.header.frame_id == settings_.map_frame
                                 ? Located{}
                                 : Lookup(settings_.map_frame, target.header.frame_id, ros::Time());
    if (!T_map_frame.has_value()) {
      navigator_.Cancel();
      Stop();
      ending_ = Ending{false, "the goal is in frame '" + target.header.frame_id + "', which tf does not connect with " +
                                  settings_.map_frame};
      return;
    }
    navigator_.SetGoal(T_map_frame->T * PlanarOf(target.pose));
  }

  void OnPreempt() {
    if (server_.isNewGoalAvailable()) return;  // OnGoal follows
    navigator_.Cancel();
    Stop();
    ending_.reset();
    server_.setPreempted({}, "cancelled");
  }

  bool OnClear(std_srvs::Empty::Request& /*request*/, std_srvs::Empty::Response& /*response*/) {
    navigator_.costmap().ClearMarks();
    return true;
  }

  void Stop() { cmd_vel_.publish(geometry_msgs::Twist()); }

  void OnTimer(const ros::TimerEvent& /*event*/) {
    const auto T_map_odom = Lookup(settings_.map_frame, settings_.odom_frame, ros::Time());
    UseScans(T_map_odom);
    if (!server_.isActive()) return;
    if (ending_.has_value()) {
      End();
      return;
    }
    const auto T_odom_base = Lookup(settings_.odom_frame, settings_.base_frame, ros::Time());
    const ros::Time now = ros::Time::now();
    NavigatorInput input;
    input.time = now.toSec();
    input.transform_age = std::numeric_limits<double>::infinity();
    if (T_odom_base.has_value()) input.T_odom_base = T_odom_base->T;
    if (T_map_odom.has_value() && T_odom_base.has_value()) {
      input.T_map_base = T_map_odom->T * T_odom_base->T;
      input.transform_age = (now - T_odom_base->stamp).toSec();
      if (!T_map_odom->stamp.isZero())
        input.transform_age = std::max(input.transform_age, (now - T_map_odom->stamp).toSec());
    }
    input.quality = quality_;
    input.new_quality = new_quality_;
    input.source = Source();
    new_quality_ = false;
    const NavigatorOutput output = navigator_.Step(input);
    Command(output);
    if (output.new_path) PublishPath(now);
    Report(output, input, now);
  }

  void Command(const NavigatorOutput& output) {
    geometry_msgs::Twist twist;
    twist.linear.x = output.velocity.x;
    twist.linear.y = output.velocity.y;
    twist.angular.z = output.velocity.yaw;
    cmd_vel_.publish(twist);
  }

  void Report(const NavigatorOutput& output, const NavigatorInput& input, const ros::Time& now) {
    if (output.text != said_ && !output.text.empty()) ROS_INFO("%s", output.text.c_str());
    said_ = output.text;
    if (output.state == GoalState::kReached) ending_ = Ending{true, "goal reached"};
    if (output.state == GoalState::kAborted) ending_ = Ending{false, output.text};
    if (ending_.has_value()) End();
    if (output.state != GoalState::kDriving) return;
    move_base_msgs::MoveBaseFeedback feedback;
    feedback.base_position.header.stamp = now;
    feedback.base_position.header.frame_id = settings_.map_frame;
    feedback.base_position.pose = ToPlanarPose(input.T_map_base);
    server_.publishFeedback(feedback);
  }

  // Not before clients can take it: they lose a result that comes while they still send the goal.
  void End() {
    constexpr double kSendingTakes = 0.2;  // s
    if (ros::WallTime::now() - accepted_ < ros::WallDuration(kSendingTakes)) return;
    const Ending ending = *std::exchange(ending_, std::nullopt);
    ending.reached ? server_.setSucceeded({}, ending.text) : server_.setAborted({}, ending.text);
  }

  void PublishPath(const ros::Time& now) {
    nav_msgs::Path message;
    message.header.stamp = now;
    message.header.frame_id = settings_.map_frame;
    for (const Eigen::Vector2d& p : navigator_.path()) {
      geometry_msgs::PoseStamped pose;
      pose.header = message.header;
      pose.pose = ToPlanarPose(Rigid2(p.x(), p.y(), 0.0));
      message.poses.push_back(pose);
    }
    path_.publish(message);
  }

  NavigatorSettings settings_;
  Navigator navigator_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  ros::NodeHandle private_node_;
  ActionServer server_;
  std::deque<sensor_msgs::LaserScan> scans_;
  std::optional<PoseQuality> quality_;
  bool new_quality_ = false;
  PoseSource source_ = PoseSource::kUnsaid;
  ros::WallTime state_at_;        // of the last message
  ros::WallTime accepted_;        // the goal
  std::optional<Ending> ending_;  // of the goal: it is over, its client does not know yet
  std::string said_;
  ros::Publisher cmd_vel_, path_, goal_;
  ros::Subscriber map_, map_updates_, scan_, pose_, state_, simple_goal_;
  ros::ServiceServer clear_;
  ros::Timer timer_;
};

int Run() {
  constexpr int kExitBadInput = 2;
  std::vector<std::string> problems;
  const ros::NodeHandle private_node("~");
  const NavigatorSettings settings = ReadNavigatorSettings(private_node, &problems);
  for (const std::string& problem : problems) ROS_FATAL("%s", problem.c_str());
  if (!problems.empty()) return kExitBadInput;
  const NavigatorNode navigator(ros::NodeHandle(), private_node, settings);
  ros::spin();
  return 0;
}

}  // namespace
}  // namespace planar_vslam::ros_face

int main(int argc, char** argv) {
  ros::init(argc, argv, "move_base");
  return planar_vslam::ros_face::Run();
}
