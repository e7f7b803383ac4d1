// sim_node: a robot in a simulated world, with a robot's topics. It makes the clock itself and paces it by wall time.
#include <diagnostic_msgs/DiagnosticStatus.h>
#include <fmt/format.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/Twist.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_msgs/Bool.h>
#include <std_msgs/Float64.h>

#include <ctime>

#include "planar_pose.h"
#include "sim_publisher.h"
#include "sim_settings.h"

namespace planar_vslam::ros_face {
namespace {

// Keeps simulated time at a multiple of wall time. What is late stays late: nothing is hurried to catch up.
class Pacer {
 public:
  explicit Pacer(double rate) : rate_(rate), started_(ros::WallTime::now()) {}

  // Sleeps until wall time has come as far as simulated second `now`.
  void WaitFor(double now) {
    constexpr double kLate = 0.1;  // s
    if (rate_ == 0.0) return;
    const double early = now / rate_ - (ros::WallTime::now() - started_).toSec();
    if (early > 0.0) ros::WallDuration(early).sleep();
    if (early < -kLate) started_ -= ros::WallDuration(early + kLate);
  }

 private:
  double rate_;
  ros::WallTime started_;  // when second 0 was, or would have been
};

class SimNode {
 public:
  SimNode(const ros::NodeHandle& node, SimSettings settings)
      : settings_(std::move(settings)),
        robot_(*settings_.robot),
        node_(node),
        publisher_(&node_, robot_.world()),
        drive_over_(node_.advertise<std_msgs::Bool>("drive_over", 1, true)),
        commands_(node_.subscribe("cmd_vel", 1, &SimNode::OnCommand, this)),
        kidnaps_(node_.subscribe("kidnap", 1, &SimNode::OnKidnap, this)),
        covers_(node_.subscribe("cover_camera", 1, &SimNode::OnCover, this)) {
    PublishDriveOver();
  }

  void Run() {
    publisher_.PublishClock(0.0);
    ros::WallDuration(settings_.start_delay).sleep();
    const ros::WallTime started = ros::WallTime::now();
    const std::clock_t cpu_started = std::clock();
    Pacer pacer(settings_.rate);
    reported_at_ = started;
    while (ros::ok()) {
      ros::getGlobalCallbackQueue()->callAvailable();
      pacer.WaitFor(robot_.now());
      robot_.Step();
      if (robot_.drive_is_over() != said_over_) PublishDriveOver();
      publisher_.PublishClock(robot_.now());
      while (const std::optional<SimulatedEvent> event = robot_.Next()) publisher_.Publish(*event);
      ReportNowAndThen();
    }
    const double wall = (ros::WallTime::now() - started).toSec();
    const double cpu = static_cast<double>(std::clock() - cpu_started) / CLOCKS_PER_SEC;
    fmt::print("{:.1f} s simulated in {:.1f} s ({:.1f} s of CPU): {:.2f} times real time, {} collisions\n",
               robot_.now(), wall, cpu, robot_.now() / wall, robot_.base().collisions);
  }

 private:
  void OnCommand(const geometry_msgs::Twist& twist) {
    const VelocityCommand command{twist.linear.x, twist.linear.y, twist.angular.z};
    robot_.Command(command);
    const bool sideways = robot_.world().drive.base == BaseKind::kDifferential && command.y != 0.0;
    if (command.IsFinite() && !sideways) return;
    ++refused_;
    constexpr double kPause = 5.0;  // s of wall time between warnings
    const ros::WallTime now = ros::WallTime::now();
    if ((now - warned_at_).toSec() < kPause) return;
    warned_at_ = now;
    const std::string topic = commands_.getTopic();
    if (command.IsFinite())
      ROS_WARN("%s: linear.y is %g; expected 0, a differential base cannot move sideways", topic.c_str(), command.y);
    else
      ROS_WARN("%s: linear.x %g, linear.y %g, angular.z %g; expected finite numbers: the robot stops", topic.c_str(),
               command.x, command.y, command.yaw);
  }

  void OnKidnap(const geometry_msgs::PoseStamped& target) {
    const std::string& frame = target.header.frame_id;
    if (!frame.empty() && frame != kSimWorldFrame) {
      ROS_WARN("%s: in frame '%s'; expected '%s'", kidnaps_.getTopic().c_str(), frame.c_str(), kSimWorldFrame);
      return;
    }
    const std::optional<Error> problem = robot_.Carry(PlanarOf(target.pose));
    if (problem.has_value()) ROS_WARN("%s: %s", kidnaps_.getTopic().c_str(), problem->message.c_str());
  }

  void OnCover(const std_msgs::Float64& seconds) {
    if (seconds.data > 0.0 && std::isfinite(seconds.data))
      robot_.CoverCamera(seconds.data);
    else
      ROS_WARN("%s: is %g; expected a number of seconds above 0", covers_.getTopic().c_str(), seconds.data);
  }

  void PublishDriveOver() {
    said_over_ = robot_.drive_is_over();
    std_msgs::Bool message;
    message.data = static_cast<std::uint8_t>(said_over_);
    drive_over_.publish(message);
  }

  // Once a second of wall time.
  void ReportNowAndThen() {
    using diagnostic_msgs::DiagnosticStatus;
    const ros::WallTime now = ros::WallTime::now();
    const double passed = (now - reported_at_).toSec();
    if (passed < 1.0) return;
    const double factor = (robot_.now() - reported_) / passed;
    reported_at_ = now;
    reported_ = robot_.now();
    constexpr double kInTime = 0.95;
    const bool late = factor < kInTime * settings_.rate;
    const BaseState base = robot_.base();
    const bool warn = late || base.touching;
    const std::string message = base.touching            ? "the robot touches something"
                                : late                   ? "slower than ~rate"
                                : robot_.drive_is_over() ? "the drive is over"
                                                         : "running";
    publisher_.PublishDiagnostics(robot_.now(), warn ? DiagnosticStatus::WARN : DiagnosticStatus::OK, message,
                                  {{"world", settings_.world_name},
                                   {"simulated time (s)", fmt::format("{:.1f}", robot_.now())},
                                   {"real-time factor", fmt::format("{:.2f}", factor)},
                                   {"collisions", std::to_string(base.collisions)},
                                   {"caught", std::to_string(base.caught)},
                                   {"bumps", std::to_string(base.bumps)},
                                   {"refused commands", std::to_string(refused_)}});
  }

  SimSettings settings_;
  LiveSimulation& robot_;
  ros::NodeHandle node_;
  SimPublisher publisher_;
  long refused_ = 0;
  ros::WallTime warned_at_, reported_at_;
  double reported_ = 0.0;  // s, simulated time of the last report
  bool said_over_ = false;
  ros::Publisher drive_over_;
  ros::Subscriber commands_, kidnaps_, covers_;
};

int Run() {
  constexpr int kExitBadInput = 2;
  std::vector<std::string> problems;
  const ros::NodeHandle private_node("~");
  SimSettings settings = ReadSimSettings(private_node, &problems);
  for (const std::string& problem : problems) ROS_FATAL("%s", problem.c_str());
  if (!problems.empty()) return kExitBadInput;
  SimNode(ros::NodeHandle(), std::move(settings)).Run();
  return 0;
}

}  // namespace
}  // namespace planar_vslam::ros_face

int main(int argc, char** argv) {
  ros::init(argc, argv, "sim_node");
  return planar_vslam::ros_face::Run();
}
