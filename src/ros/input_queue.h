#pragma once
// What the robot sends, in order of arrival, from the callbacks to the tracking thread.
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <variant>

namespace planar_vslam::ros_face {

struct TfInput {
  tf2_msgs::TFMessageConstPtr message;
  bool is_static = false;
};
using Command = std::function<void()>;  // runs on the tracking thread
using Input =
    std::variant<sensor_msgs::ImageConstPtr, sensor_msgs::CompressedImageConstPtr, sensor_msgs::CameraInfoConstPtr,
                 nav_msgs::OdometryConstPtr, sensor_msgs::LaserScanConstPtr, TfInput, Command>;

class InputQueue {
 public:
  // `images`: how many wait at most. Nothing is ever dropped with `lossless`.
  InputQueue(std::size_t images, bool lossless) : image_capacity_(images), lossless_(lossless) {}

  // Over capacity the oldest input of the same kind is dropped. Commands go before everything that waits.
  void Push(Input input);
  // Waits for an input; nothing once the queue is closed.
  std::optional<Input> Pop();
  // What still waits is discarded.
  void Close();

  // By kind of input.
  std::map<std::string, long> dropped() const;

 private:
  std::size_t Capacity(const Input& input) const;

  const std::size_t image_capacity_;
  const bool lossless_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Input> inputs_;
  std::map<std::string, long> dropped_;
  bool closed_ = false;
};

}  // namespace planar_vslam::ros_face
