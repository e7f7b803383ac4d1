#pragma once
// The services of the node, and `initialpose`.
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <functional>
#include <string>
#include <vector>

#include "parameters.h"
#include "publishers.h"
#include "tracking_thread.h"

namespace planar_vslam::ros_face {

// On a queue and thread of their own: a service that waits must not hold up the sensors.
class Services {
 public:
  Services(const ros::NodeHandle& node, const NodeSettings& settings, TrackingThread* tracking, MapPublisher* maps);
  // The tracking thread has been stopped by then: a service that waits for it ends.
  ~Services() { spinner_.stop(); }
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

 private:
  void AdvertiseMaps();
  void AdvertiseCommands();
  // A std_srvs/Trigger that does `act` on the tracking thread and answers with `done`, or with what is wrong.
  void Advertise(const std::string& name, std::function<Expected<bool>(TrackingLoop&)> act, const std::string& done);
  // What `act` says on the tracking thread, or that the node stops.
  Expected<bool> Do(const std::function<Expected<bool>(TrackingLoop&)>& act);
  Expected<std::string> SaveMap(const std::string& name);
  Expected<std::string> LoadMap(const std::string& name);
  Expected<std::string> SetMode(const std::string& mode);

  const NodeSettings settings_;
  TrackingThread* const tracking_;
  MapPublisher* const maps_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  std::vector<ros::ServiceServer> servers_;
  ros::Subscriber initial_pose_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace planar_vslam::ros_face
