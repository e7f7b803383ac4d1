#include "bag_recording.h"

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>

#include <algorithm>
#include <array>
#include <deque>

#include "bag_messages.h"
#include "bag_survey.h"
#include "stamp_text.h"

namespace planar_vslam::io {
namespace {

// The streams, odometry first: in the order events with equal stamps are handed out. What an image needs comes before
// it.
constexpr std::size_t kLaser = 1, kImage = 2, kStreamCount = 3;
// Events of a stream that are read in one go. Where topics lie far apart in a bag, each change from one to another
// costs the decompression of a chunk.
constexpr std::size_t kReadAhead[kStreamCount] = {200, 20, 1};

class BagRecording : public Recording {
 public:
  BagRecording(Bags bags, std::string file, BagSurvey survey, SkipLog skipped)
      : bags_(std::move(bags)),
        file_(std::move(file)),
        survey_(std::move(survey)),
        skipped_(std::move(skipped)),
        odometry_(survey_.odometry_by_twist) {
    if (survey_.transforms.odom_to_base.has_value()) {
      tf_odometry_ = survey_.transforms.tree.StampsOfMotion(*survey_.transforms.odom_to_base);
    }
  }

  const RecordingInfo& info() const override { return survey_.info; }
  const std::map<std::string, long>& skipped() const override { return skipped_.counts(); }
  Expected<std::optional<RecordedEvent>> Next() override;

 private:
  struct Stream {
    std::size_t next = 0;  // message to read
    std::deque<std::pair<Timestamp, RecordedEvent>> ahead;
  };
  std::size_t Size(std::size_t stream) const;
  void ReadAhead(std::size_t stream);
  // Message i of a stream; nothing, and counted, where it cannot be used.
  std::optional<RecordedEvent> Read(std::size_t stream, std::size_t i);
  std::optional<RecordedEvent> ReadCameraFrame(std::size_t i);
  std::optional<RecordedEvent> ReadLaserFrame(std::size_t i);
  std::optional<RecordedEvent> ReadOdometry(std::size_t i);
  std::optional<RecordedEvent> ReadTfOdometry(std::size_t i);

  Bags bags_;
  std::string file_;
  BagSurvey survey_;
  SkipLog skipped_;
  std::array<Stream, kStreamCount> streams_;
  OdometryMessages odometry_;
  std::vector<Timestamp> tf_odometry_;
  GreyDepth depth_;
};

Timestamp StampOf(const RecordedEvent& event) {
  if (const auto* frame = std::get_if<CameraFrame>(&event)) return frame->image.stamp;
  if (const auto* frame = std::get_if<LaserFrame>(&event)) return frame->scan.stamp;
  return std::get<OdometryReading>(event).stamp;
}

std::string Where(const std::string& topic, Timestamp stamp) {
  return fmt::format("{} at {}", topic, FormatStamp(stamp));
}

Expected<std::optional<RecordedEvent>> BagRecording::Next() {
  try {
    Stream* earliest = nullptr;
    for (std::size_t i = 0; i < kStreamCount; ++i) {
      ReadAhead(i);
      Stream& stream = streams_[i];
      if (stream.ahead.empty()) continue;
      if (earliest == nullptr || stream.ahead.front().first < earliest->ahead.front().first) earliest = &stream;
    }
    if (earliest == nullptr) return std::optional<RecordedEvent>();
    std::optional<RecordedEvent> event = std::move(earliest->ahead.front().second);
    earliest->ahead.pop_front();
    return event;
  } catch (const std::exception& exception) {
    return Error{fmt::format("{}: cannot be read on: {}; expected an intact recording", file_, exception.what())};
  }
}

std::size_t BagRecording::Size(std::size_t stream) const {
  if (stream == kImage) return survey_.index.images.size();
  if (stream == kLaser) return survey_.index.scans.size();
  return tf_odometry_.empty() ? survey_.index.odometry.size() : tf_odometry_.size();
}

void BagRecording::ReadAhead(std::size_t number) {
  Stream& stream = streams_[number];
  while (stream.ahead.empty() && stream.next < Size(number)) {
    const std::size_t end = std::min(stream.next + kReadAhead[number], Size(number));
    for (; stream.next < end; ++stream.next) {
      std::optional<RecordedEvent> event = Read(number, stream.next);
      if (event.has_value()) stream.ahead.emplace_back(StampOf(*event), std::move(*event));
    }
  }
}

std::optional<RecordedEvent> BagRecording::Read(std::size_t stream, std::size_t i) {
  try {
    if (stream == kImage) return ReadCameraFrame(i);
    if (stream == kLaser) return ReadLaserFrame(i);
    return tf_odometry_.empty() ? ReadOdometry(i) : ReadTfOdometry(i);
  } catch (const DamagedMessage& damaged) {
    const bool image = stream == kImage;
    skipped_.Count(damaged.what(), image ? Where(survey_.topics.image, survey_.index.images.stamp(i))
                                         : Where(survey_.topics.scan, survey_.index.scans.stamp(i)));
    return std::nullopt;
  }
}

std::optional<RecordedEvent> BagRecording::ReadCameraFrame(std::size_t i) {
  const Timestamp stamp = survey_.index.images.stamp(i);
  StampedImage stored = ReadImage(survey_.index.images.message(i), survey_.topics.image_compressed, &depth_);
  const std::string where = Where(survey_.topics.image, stamp);
  if (!stored.image) {
    skipped_.Count("image not decodable", fmt::format("{}: {}", where, stored.image.error().message));
    return std::nullopt;
  }
  if (FrameName(stored.frame_id) != survey_.said.camera) {
    skipped_.Count("image of another frame", fmt::format("{}: '{}', expected '{}': two cameras on one topic?", where,
                                                         stored.frame_id, survey_.said.camera));
    return std::nullopt;
  }
  const CameraModel& camera = survey_.info.camera;
  if (stored.image->width != camera.width || stored.image->height != camera.height) {
    skipped_.Count("image of changed size", fmt::format("{}: {}x{}, expected {}x{}", where, stored.image->width,
                                                        stored.image->height, camera.width, camera.height));
    return std::nullopt;
  }
  const std::optional<Rigid3> T_base_camera = survey_.transforms.tree.At(survey_.transforms.base_to_camera, stamp);
  if (!T_base_camera.has_value()) {
    skipped_.Count("image whose stamp tf does not cover", where);
    return std::nullopt;
  }
  return CameraFrame{ImageFrame{stamp, std::move(*stored.image)}, *T_base_camera};
}

std::optional<RecordedEvent> BagRecording::ReadLaserFrame(std::size_t i) {
  const Timestamp stamp = survey_.index.scans.stamp(i);
  const auto message = survey_.index.scans.message(i).Read<sensor_msgs::LaserScan>();
  if (FrameName(message->header.frame_id) != survey_.said.laser) {
    skipped_.Count("scan of another frame",
                   fmt::format("{}: '{}', expected '{}': two lasers on one topic?", Where(survey_.topics.scan, stamp),
                               message->header.frame_id, survey_.said.laser));
    return std::nullopt;
  }
  Expected<PlanarScan> scan = ToPlanarScan(*message);
  if (!scan) {
    skipped_.Count(scan.error().message, Where(survey_.topics.scan, stamp));
    return std::nullopt;
  }
  const std::optional<Rigid3> T_base_laser = survey_.transforms.tree.At(survey_.transforms.base_to_laser, stamp);
  if (!T_base_laser.has_value()) {
    skipped_.Count("scan whose stamp tf does not cover", Where(survey_.topics.scan, stamp));
    return std::nullopt;
  }
  return LaserFrame{std::move(*scan), *T_base_laser};
}

std::optional<RecordedEvent> BagRecording::ReadOdometry(std::size_t i) {
  const Timestamp stamp = survey_.index.odometry.stamp(i);
  const std::string where = Where(survey_.topics.odometry, stamp);
  const std::optional<Rigid3> T_child_base =
      survey_.transforms.tree.At(survey_.transforms.odometry_child_to_base, stamp);
  if (!T_child_base.has_value()) {
    skipped_.Count("odometry whose stamp tf does not cover", where);
    return std::nullopt;
  }
  const auto message = survey_.index.odometry.message(i).Read<nav_msgs::Odometry>();
  const std::string child = OdometryChild(*message, survey_.said.base);
  if (child != survey_.said.odometry_child) {
    skipped_.Count("odometry of another child frame", fmt::format("{}: '{}', expected '{}': two sources on one topic?",
                                                                  where, child, survey_.said.odometry_child));
    return std::nullopt;
  }
  const Expected<OdometryReading> reading = odometry_.Read(*message, *T_child_base);
  if (!reading) {
    skipped_.Count(reading.error().message, where);
    return std::nullopt;
  }
  if (odometry_.placeholder_covariance()) skipped_.Count("odometry covariance that is a placeholder", where);
  return *reading;
}

std::optional<RecordedEvent> BagRecording::ReadTfOdometry(std::size_t i) {
  const Timestamp stamp = tf_odometry_[i];
  const std::optional<Rigid3> T_odom_base = survey_.transforms.tree.At(*survey_.transforms.odom_to_base, stamp);
  if (T_odom_base.has_value()) return OdometryReading{stamp, ProjectToPlane(*T_odom_base)};
  skipped_.Count("odometry whose stamp tf does not cover", Where("tf", stamp));
  return std::nullopt;
}

}  // namespace

Expected<std::unique_ptr<Recording>> OpenBagRecording(const std::vector<std::filesystem::path>& paths,
                                                      const RecordingOptions& options) {
  const std::string file = NameOf(paths);
  try {
    SkipLog skipped;
    Expected<Bags> bags = OpenBags(paths);
    if (!bags) return bags.error();
    Expected<BagSurvey> survey = SurveyBag(*bags, file, options, &skipped);
    if (!survey) return survey.error();
    return std::unique_ptr<Recording>(
        std::make_unique<BagRecording>(std::move(*bags), file, std::move(*survey), std::move(skipped)));
  } catch (const std::exception& exception) {
    return Error{fmt::format("{}: cannot be read: {}; expected an intact recording", file, exception.what())};
  }
}

}  // namespace planar_vslam::io
