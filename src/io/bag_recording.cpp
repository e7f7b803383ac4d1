#include "bag_recording.h"

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>

#include "bag_messages.h"
#include "bag_survey.h"
#include "event_merger.h"

namespace planar_vslam::io {
namespace {

std::vector<std::string> StreamedTopics(const BagSurvey& survey) {
  std::vector<std::string> topics{survey.topics.image};
  if (!survey.topics.scan.empty()) topics.push_back(survey.topics.scan);
  if (!survey.topics.odometry.empty()) {
    topics.push_back(survey.topics.odometry);
  } else if (survey.transforms.odom_to_base.has_value()) {
    topics.insert(topics.end(), survey.topics.tf.begin(), survey.topics.tf.end());
  }
  return topics;
}

class BagRecording : public Recording {
 public:
  BagRecording(std::unique_ptr<rosbag::Bag> bag, std::string file, BagSurvey survey, SkipLog skipped)
      : bag_(std::move(bag)),
        file_(std::move(file)),
        survey_(std::move(survey)),
        skipped_(std::move(skipped)),
        view_(*bag_, rosbag::TopicQuery(StreamedTopics(survey_))),
        position_(view_.begin()),
        merger_({survey_.info.has_odometry, survey_.info.has_laser, true}) {
    if (survey_.transforms.odom_to_base.has_value()) {
      odometry_edge_ = survey_.transforms.tree.FirstMovingEdge(*survey_.transforms.odom_to_base);
    }
  }

  const RecordingInfo& info() const override { return survey_.info; }
  const std::map<std::string, long>& skipped() const override { return skipped_.counts(); }
  Expected<std::optional<RecordedEvent>> Next() override;

 private:
  void ReadMessage(const rosbag::MessageInstance& message);
  void OnImage(const rosbag::MessageInstance& message);
  void OnScan(const rosbag::MessageInstance& message);
  void OnOdometry(const rosbag::MessageInstance& message);
  void OnTf(const rosbag::MessageInstance& message);
  void PushOdometry(const ros::Time& stamp, const Rigid3& T_odom_base, const OdometryMessageCovariance& covariance,
                    const std::string& topic);
  // Counts and refuses a stamp that is zero or not later than the stream's last.
  bool AcceptStamp(Stream stream, const ros::Time& stamp, const std::string& topic);
  void Deliver(Stream stream, Timestamp stamp, RecordedEvent event, const std::string& topic);

  std::unique_ptr<rosbag::Bag> bag_;
  std::string file_;
  BagSurvey survey_;
  SkipLog skipped_;
  rosbag::View view_;
  rosbag::View::iterator position_;
  EventMerger merger_;
  std::array<StampGate, kStreamCount> gates_;
  MessageCovarianceReader covariance_;
  std::optional<std::pair<std::string, std::string>> odometry_edge_;  // (parent, child) whose samples time tf odometry
};

const char* StreamName(Stream stream) {
  switch (stream) {
    case Stream::kOdometry:
      return "odometry";
    case Stream::kLaser:
      return "scan";
    case Stream::kImage:
      break;
  }
  return "image";
}

std::string Where(const std::string& topic, const ros::Time& stamp) {
  return fmt::format("{} at {}.{:09d}", topic, stamp.sec, stamp.nsec);
}

Expected<std::optional<RecordedEvent>> BagRecording::Next() {
  try {
    while (true) {
      std::optional<RecordedEvent> event = merger_.Pop();
      if (event.has_value()) return event;
      if (position_ == view_.end()) {
        merger_.Finish();
        return merger_.Pop();
      }
      ReadMessage(*position_);
      ++position_;
    }
  } catch (const std::exception& exception) {
    return Error{fmt::format("{}: cannot be read on: {}; expected an intact rosbag v2", file_, exception.what())};
  }
}

void BagRecording::ReadMessage(const rosbag::MessageInstance& message) {
  const std::string& topic = message.getTopic();
  try {
    if (topic == survey_.topics.image) {
      OnImage(message);
    } else if (topic == survey_.topics.scan) {
      OnScan(message);
    } else if (topic == survey_.topics.odometry) {
      OnOdometry(message);
    } else {
      OnTf(message);
    }
  } catch (const ros::serialization::StreamOverrunException&) {
    skipped_.Count("message cut short", Where(topic, message.getTime()));
  }
}

bool BagRecording::AcceptStamp(Stream stream, const ros::Time& stamp, const std::string& topic) {
  const bool zero = stamp.isZero();
  if (!zero && gates_[static_cast<std::size_t>(stream)].Accept(ToTimestamp(stamp))) return true;
  skipped_.Count(fmt::format("{} stamp {}", StreamName(stream), zero ? "zero" : "not increasing"), Where(topic, stamp));
  return false;
}

void BagRecording::Deliver(Stream stream, Timestamp stamp, RecordedEvent event, const std::string& topic) {
  if (merger_.Push(stream, stamp, std::move(event))) return;
  skipped_.Count(fmt::format("{} more than {} s behind the others", StreamName(stream), EventMerger::kPatienceSeconds),
                 fmt::format("{} at {:.3f}", topic, stamp.Seconds()));
}

void BagRecording::OnImage(const rosbag::MessageInstance& message) {
  StampedImage stored = ReadImage(message, survey_.topics.image_compressed);
  const std::string where = Where(message.getTopic(), stored.stamp);
  if (!stored.image) {
    skipped_.Count("image not decodable", fmt::format("{}: {}", where, stored.image.error().message));
    return;
  }
  const CameraModel& camera = survey_.info.camera;
  if (stored.image->width != camera.width || stored.image->height != camera.height) {
    skipped_.Count("image of changed size", fmt::format("{}: {}x{}, expected {}x{}", where, stored.image->width,
                                                        stored.image->height, camera.width, camera.height));
    return;
  }
  if (!AcceptStamp(Stream::kImage, stored.stamp, message.getTopic())) return;
  const Timestamp stamp = ToTimestamp(stored.stamp);
  const std::optional<Rigid3> T_base_camera = survey_.transforms.tree.At(survey_.transforms.base_to_camera, stamp);
  if (!T_base_camera.has_value()) {
    skipped_.Count("image whose stamp tf does not cover", where);
    return;
  }
  Deliver(Stream::kImage, stamp, CameraFrame{ImageFrame{stamp, std::move(*stored.image)}, *T_base_camera},
          message.getTopic());
}

void BagRecording::OnScan(const rosbag::MessageInstance& message) {
  const auto scan = Instantiate<sensor_msgs::LaserScan>(message);
  if (!AcceptStamp(Stream::kLaser, scan->header.stamp, message.getTopic())) return;
  const Timestamp stamp = ToTimestamp(scan->header.stamp);
  const std::optional<Rigid3> T_base_laser = survey_.transforms.tree.At(survey_.transforms.base_to_laser, stamp);
  if (!T_base_laser.has_value()) {
    skipped_.Count("scan whose stamp tf does not cover", Where(message.getTopic(), scan->header.stamp));
    return;
  }
  Deliver(Stream::kLaser, stamp, LaserFrame{ToPlanarScan(*scan), *T_base_laser}, message.getTopic());
}

void BagRecording::OnOdometry(const rosbag::MessageInstance& message) {
  const auto odometry = Instantiate<nav_msgs::Odometry>(message);
  const ros::Time& stamp = odometry->header.stamp;
  const std::optional<Rigid3> T_child_base =
      survey_.transforms.tree.At(survey_.transforms.odometry_child_to_base, ToTimestamp(stamp));
  if (!T_child_base.has_value()) {
    skipped_.Count("odometry whose stamp tf does not cover", Where(message.getTopic(), stamp));
    return;
  }
  const auto& p = odometry->pose.pose.position;
  const auto& q = odometry->pose.pose.orientation;
  const Rigid3 T_odom_child(Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(p.x, p.y, p.z));
  PushOdometry(stamp, T_odom_child * *T_child_base, ToOdometryCovariance(*odometry, *T_child_base), message.getTopic());
}

void BagRecording::OnTf(const rosbag::MessageInstance& message) {
  const auto tf = Instantiate<tf2_msgs::TFMessage>(message);
  for (const geometry_msgs::TransformStamped& transform : tf->transforms) {
    const auto edge = std::make_pair(FrameName(transform.header.frame_id), FrameName(transform.child_frame_id));
    if (edge != odometry_edge_) continue;
    const ros::Time& stamp = transform.header.stamp;
    const std::optional<Rigid3> T_odom_base =
        survey_.transforms.tree.At(*survey_.transforms.odom_to_base, ToTimestamp(stamp));
    if (T_odom_base.has_value()) {
      PushOdometry(stamp, *T_odom_base, {}, message.getTopic());
    } else {
      skipped_.Count("odometry whose stamp tf does not cover", Where(message.getTopic(), stamp));
    }
  }
}

void BagRecording::PushOdometry(const ros::Time& stamp, const Rigid3& T_odom_base,
                                const OdometryMessageCovariance& covariance, const std::string& topic) {
  const Rigid2 planar = ProjectToPlane(T_odom_base);
  if (!planar.translation.allFinite() || !std::isfinite(planar.angle)) {
    skipped_.Count("odometry pose not finite", Where(topic, stamp));
    return;
  }
  if (!AcceptStamp(Stream::kOdometry, stamp, topic)) return;
  const Timestamp t = ToTimestamp(stamp);
  Deliver(Stream::kOdometry, t, OdometryReading{t, planar, covariance_.Rate(t, planar, covariance)}, topic);
}

}  // namespace

Expected<std::unique_ptr<Recording>> OpenBagRecording(const std::filesystem::path& path,
                                                      const RecordingOptions& options) {
  const std::string file = path.string();
  try {
    SkipLog skipped;
    Expected<std::unique_ptr<rosbag::Bag>> bag = OpenBag(path);
    if (!bag) return bag.error();
    Expected<BagSurvey> survey = SurveyBag(**bag, file, options, &skipped);
    if (!survey) return survey.error();
    return std::unique_ptr<Recording>(
        std::make_unique<BagRecording>(std::move(*bag), file, std::move(*survey), std::move(skipped)));
  } catch (const std::exception& exception) {
    return Error{fmt::format("{}: cannot be read: {}; expected an intact rosbag v2", file, exception.what())};
  }
}

}  // namespace planar_vslam::io
