#pragma once
// Pairs measurements by stamp. An image waits until odometry covers it; odometry is interpolated, never extrapolated.
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/sensor/buffers.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct ScanPacket {
  PlanarScan scan;
  Rigid3 T_base_laser;
  Rigid2 T_frame_base;  // base at the scan's stamp in the base at the packet's image
};

// When images were taken, later on odometry's clock than their stamps say; negative as a rule. Seconds.
struct ImageOffset {
  double value = 0.0, sigma = 0.0;
};

struct FramePacket {
  ImageFrame image;
  Rigid3 T_base_camera;                   // when the image was taken, in the base at its stamp
  std::vector<OdometryReading> odometry;  // from the packet before to this one, both ends interpolated; may be empty
  std::optional<Rigid2> T_odom_base;      // at the image's stamp
  std::vector<ScanPacket> scans;          // since the packet before, up to the image's stamp
  Rigid2 T_base_exposed = {};             // the base when the image was taken, in the base at its stamp...
  ImageOffset image_offset = {};          // ...which follows from this; zero where odometry does not reach there
};

class Synchronizer {
 public:
  // `with_odometry`: images wait for odometry, at most 2 s of newer images; otherwise they pass at once, and odometry
  // and scans are ignored.
  explicit Synchronizer(bool with_odometry) : with_odometry_(with_odometry) {}

  void Push(CameraFrame frame);
  void Push(const OdometryReading& reading);
  void Push(LaserFrame frame);
  // For images that have not been popped yet.
  void SetImageOffset(const ImageOffset& offset) { image_offset_ = offset; }
  // No more input will come: images odometry does not reach are passed on without.
  void Finish() { finished_ = true; }
  std::optional<FramePacket> Pop();
  // Images that wait for odometry.
  std::size_t images_waiting() const { return images_.size(); }

  // Input that could not be used, by reason.
  const std::map<std::string, long>& dropped() const { return dropped_; }

 private:
  FramePacket Assemble(CameraFrame frame);

  bool with_odometry_;
  bool finished_ = false;
  ImageOffset image_offset_;
  OdometryBuffer odometry_;
  std::deque<CameraFrame> images_;
  std::deque<LaserFrame> scans_;
  std::optional<Timestamp> last_packet_;
  std::optional<Timestamp> last_image_;
  std::map<std::string, long> dropped_;
};

}  // namespace planar_vslam
