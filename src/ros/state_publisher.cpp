#include "state_publisher.h"

#include <planar_vslam/Event.h>

#include <algorithm>

#include "converters.h"

namespace planar_vslam::ros_face {
namespace {

constexpr double kPeriodSeconds = 1.0;  // while no frame comes

const char* ToText(RunMode mode) { return mode == RunMode::kMapping ? "mapping" : "localization"; }

}  // namespace

StatePublisher::StatePublisher(ros::NodeHandle* node, const NodeSettings& settings)
    : settings_(settings),
      state_(node->advertise<State>("state", 10, true)),
      events_(node->advertise<Event>("events", 100)),
      last_(ros::WallTime::now()) {
  message_.header.frame_id = settings_.map_frame;
  message_.state = ToString(TrackingState::kInitializing);
  message_.mode = ToText(settings_.pipeline.mode);
  message_.localised_by = "nothing";
  message_.time_since_fix = -1.0;
  message_.waiting_for = "images";
  state_.publish(message_);
  timer_ = node->createWallTimer(ros::WallDuration(kPeriodSeconds),
                                 [this](const ros::WallTimerEvent&) { PublishWhileNoFrameComes(); });
}

void StatePublisher::OnFrame(const FrameReport& report, const TrackingLoop& loop) {
  const std_msgs::Header header = MakeHeader(report.stamp, settings_.map_frame);
  for (const RobotEvent& found : finder_.OnFrame(report, loop.estimator()->report().loops.size())) {
    Event event;
    event.header = header;
    event.kind = found.kind;
    event.text = found.text;
    events_.publish(event);
  }
  State message;
  message.header = header;
  message.state = ToString(report.state);
  message.mode = ToText(loop.mode());
  message.paused = static_cast<std::uint8_t>(loop.paused());
  message.localised_by = LocalisedBy(report, settings_.pipeline.tracker.min_inliers);
  message.quality = Quality(report);
  if (report.T_map_base.has_value()) {
    const auto pose = ToPoseWithCovariance(header, *report.T_map_base, report.covariance);
    std::copy(pose.pose.covariance.begin(), pose.pose.covariance.end(), message.covariance.begin());
  }
  if (message.localised_by == "camera" || message.localised_by == "laser") fix_ = report.stamp;
  message.time_since_fix = fix_.has_value() ? SecondsBetween(*fix_, report.stamp) : -1.0;
  message.waiting_for = report.waiting_for;
  const std::lock_guard<std::mutex> lock(mutex_);
  message_ = message;
  time_since_fix_ = message.time_since_fix;
  last_ = ros::WallTime::now();
  state_.publish(message_);
}

void StatePublisher::OnInput(const TrackingLoop& loop) {
  const std::lock_guard<std::mutex> lock(mutex_);
  missing_ = loop.waiting_for();
  message_.mode = ToText(loop.mode());
  message_.paused = static_cast<std::uint8_t>(loop.paused());
}

void StatePublisher::OnRestart() {
  finder_.OnRestart();
  fix_.reset();
  const std::lock_guard<std::mutex> lock(mutex_);
  message_.state = ToString(TrackingState::kInitializing);
  message_.localised_by = "nothing";
  message_.quality = 0.0;
  std::fill(message_.covariance.begin(), message_.covariance.end(), 0.0);
  message_.time_since_fix = time_since_fix_ = -1.0;
  message_.waiting_for = "images";
  state_.publish(message_);
}

void StatePublisher::PublishWhileNoFrameComes() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double silent = (ros::WallTime::now() - last_).toSec();
  if (silent < kPeriodSeconds) return;
  message_.waiting_for = missing_.empty() ? "images" : missing_;
  if (message_.paused != 0) message_.waiting_for = "resume";
  if (time_since_fix_ >= 0.0) message_.time_since_fix = time_since_fix_ + silent;
  state_.publish(message_);
}

}  // namespace planar_vslam::ros_face
