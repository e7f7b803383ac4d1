#include "planar_vslam/pipeline/synchronizer.h"

#include <algorithm>
#include <utility>

namespace planar_vslam {

void Synchronizer::Push(CameraFrame frame) {
  if (last_image_.has_value() && frame.image.stamp <= *last_image_) {
    ++dropped_["image stamp not increasing"];
    return;
  }
  last_image_ = frame.image.stamp;
  images_.push_back(std::move(frame));
}

void Synchronizer::Push(const OdometryReading& reading) {
  if (!with_odometry_) return;
  switch (odometry_.Push(reading)) {
    case PushResult::kAccepted:
      break;
    case PushResult::kNotMonotonic:
      ++dropped_["odometry stamp not increasing"];
      break;
    case PushResult::kNotFinite:
      ++dropped_["odometry not finite"];
      break;
  }
}

void Synchronizer::Push(LaserFrame frame) {
  if (!with_odometry_) return;
  scans_.push_back(std::move(frame));
}

FramePacket Synchronizer::Assemble(CameraFrame frame) {
  FramePacket packet;
  const Timestamp stamp = frame.image.stamp;
  packet.image = std::move(frame.image);
  packet.T_base_camera = frame.T_base_camera;
  packet.T_odom_base = odometry_.Interpolate(stamp);
  const std::optional<Rigid2> T_odom_exposed = odometry_.Interpolate(Shifted(stamp, image_offset_.value));
  const bool known = packet.T_odom_base.has_value() && T_odom_exposed.has_value();
  if (known) packet.image_offset = image_offset_;
  if (known && image_offset_.value != 0.0) {
    packet.T_base_exposed = packet.T_odom_base->Inverse() * *T_odom_exposed;
    packet.T_base_camera = Embed3(packet.T_base_exposed) * packet.T_base_camera;
  }
  if (packet.T_odom_base.has_value() && last_packet_.has_value()) {
    packet.odometry = odometry_.Slice(*last_packet_, stamp);
  }
  while (!scans_.empty() && scans_.front().scan.stamp <= stamp) {
    const std::optional<Rigid2> T_odom_scan = odometry_.Interpolate(scans_.front().scan.stamp);
    if (packet.T_odom_base.has_value() && T_odom_scan.has_value()) {
      packet.scans.push_back(
          {std::move(scans_.front().scan), scans_.front().T_base_laser, packet.T_odom_base->Inverse() * *T_odom_scan});
    } else {
      ++dropped_["scan not covered by odometry"];
    }
    scans_.pop_front();
  }
  // A scan may arrive after a newer image has passed: odometry is kept long enough to place it.
  constexpr std::int64_t kScanLatency = 1'000'000'000;  // ns
  if (packet.T_odom_base.has_value()) odometry_.DropBefore(Timestamp{stamp.nanoseconds - kScanLatency});
  last_packet_ = stamp;
  return packet;
}

std::optional<FramePacket> Synchronizer::Pop() {
  while (!images_.empty()) {
    const Timestamp stamp = images_.front().image.stamp;
    const bool waits =
        with_odometry_ && !finished_ &&
        (odometry_.empty() || odometry_.last_stamp() < Shifted(stamp, std::max(0.0, image_offset_.value)));
    constexpr double kPatience = 2.0;  // s of newer images; the next covered image bridges the gap
    if (waits && SecondsBetween(stamp, images_.back().image.stamp) > kPatience) {
      ++dropped_["image waited for odometry in vain"];
      images_.pop_front();
      continue;
    }
    if (waits) return std::nullopt;
    const bool before_odometry =
        with_odometry_ && !last_packet_.has_value() && (odometry_.empty() || stamp < odometry_.first_stamp());
    if (before_odometry) {
      ++dropped_["image before the first odometry"];
      images_.pop_front();
      continue;
    }
    CameraFrame frame = std::move(images_.front());
    images_.pop_front();
    return Assemble(std::move(frame));
  }
  return std::nullopt;
}

}  // namespace planar_vslam
