#include "debug_image.h"

#include <fmt/format.h>
#include <sensor_msgs/image_encodings.h>

#include <boost/make_shared.hpp>
#include <string>
#include <utility>
#include <vector>

#include "converters.h"
#include "planar_vslam/io/frame_picture.h"
#include "robot_state.h"

namespace planar_vslam::ros_face {
namespace {

// The lines below the picture: state, what tells the pose (as in msg/State.msg) and how much is seen; what is waited
// for.
std::vector<std::string> DebugText(const FrameReport& report, const FrameView& view, const std::string& localised_by) {
  std::vector<std::string> text{fmt::format("{} by {}: {} followed, {} refused, {} keypoints", ToString(report.state),
                                            localised_by, view.followed.size(), view.refused.size(),
                                            view.features != nullptr ? view.features->keypoints.size() : 0)};
  text.push_back(report.waiting_for.empty() ? "" : "waiting for " + report.waiting_for);
  return text;
}

}  // namespace

DebugImagePublisher::DebugImagePublisher(const ros::NodeHandle& node, const NodeSettings& settings)
    : min_inliers_(settings.pipeline.tracker.min_inliers) {
  try {
    publisher_ = image_transport::ImageTransport(node).advertise("debug_image", 1);
  } catch (const image_transport::Exception& exception) {  // a machine without plugins, which needs none for the rest
    ROS_WARN("debug_image: %s", exception.what());
  }
}

void DebugImagePublisher::OnFrame(const FrameReport& report, const TrackingLoop& loop) {
  if (drawing_ || publisher_.getNumSubscribers() == 0) return;
  const FrameView& last = loop.estimator()->view();
  if (last.image.empty()) return;
  drawing_ = true;
  worker_.Submit([this, header = MakeHeader(report.stamp, loop.image_frame()), view = last,
                  text = DebugText(report, last, LocalisedBy(report, min_inliers_))] {
    io::ColorImage picture = io::DrawFrame(view, text);
    const auto message = boost::make_shared<sensor_msgs::Image>();
    message->header = header;
    message->encoding = sensor_msgs::image_encodings::BGR8;
    message->width = static_cast<std::uint32_t>(picture.width);
    message->height = static_cast<std::uint32_t>(picture.height);
    message->step = message->width * 3;
    message->data = std::move(picture.bgr);
    publisher_.publish(sensor_msgs::ImageConstPtr(message));
    drawing_ = false;
  });
}

}  // namespace planar_vslam::ros_face
