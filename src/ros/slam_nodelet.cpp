// SlamApp as a nodelet: images of a camera's nodelet in the same manager are shared, not copied.
#include <image_transport/exception.h>
#include <nodelet/nodelet.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>
#include <string>
#include <vector>

#include "slam_app.h"

namespace planar_vslam {

class SlamNodelet : public nodelet::Nodelet {
 private:
  // A manager has other nodelets to go on with: what is wrong is said, and this one stays idle.
  void onInit() override {
    std::vector<std::string> problems;
    const ros_face::NodeSettings settings = ros_face::ReadSettings(getPrivateNodeHandle(), &problems);
    for (const std::string& problem : problems) NODELET_FATAL("%s", problem.c_str());
    if (!problems.empty()) return;
    const auto on_map_refused = [this](const std::string& reason) { NODELET_ERROR("map_file: %s", reason.c_str()); };
    try {
      app_ = std::make_unique<ros_face::SlamApp>(getNodeHandle(), getPrivateNodeHandle(), getName(), settings,
                                                 on_map_refused);
    } catch (const image_transport::Exception& exception) {
      NODELET_FATAL("image_transport: %s", exception.what());
    }
  }

  std::unique_ptr<ros_face::SlamApp> app_;
};

}  // namespace planar_vslam

PLUGINLIB_EXPORT_CLASS(planar_vslam::SlamNodelet, nodelet::Nodelet)
