#pragma once
// When images were taken, on odometry's clock. A camera's driver stamps an image when it arrives, some 10 to 80 ms
// after it was taken; while the robot turns by 60 degrees a second, 20 ms are a degree. An image stamped t was taken
// when odometry read t + d; where the camera was then is told by the wheels, which bridge so short a time without any
// error that matters: T_base_camera(t) = T_base(t)_base(t + d) T_base_camera. All poses are of the base at t, on
// odometry's clock, which is the laser's and tf's as well.
//
// d shows where turns begin and end. The headings by sight, h, of the base when the image was taken, and by the wheels,
// o, of the base at its stamp, differ by what the odometry frame is turned in the map, and by d times the turn rate w:
//   y = (h - o)_k - (h - o)_j = d u + s a + e,   u = w_k - w_j,   a = o_k - o_j,
// s the share that the wheels turn too little and e noise. By least squares over pairs of frames more than half a
// second apart, with Huber's weights: from one frame to the next a pose follows the wheels more than its view. Where v
// pairs overlap, each counts q / v with its weight q, and the variance of d is that of the residuals it is made of
// (White 1980),
//   var(d) = sum(q^2 u'^2 e^2 / v) / (sum q u'^2 / v)^2,   u' what is left of u once it is regressed on a.
// Half of the robots are taken to have no offset, the others one of N(0, 2 sigma_clock^2). It counts once the pairs
// make it nine times as likely as none; the variance is that of both cases.
#include <Eigen/Core>
#include <deque>
#include <optional>

#include "planar_vslam/pipeline/options.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/sensor/buffers.h"

namespace planar_vslam {

class ImageClock {
 public:
  explicit ImageClock(const ImageTimingOptions& options) : options_(options), offset_{0.0, options.sigma_clock} {}

  // Takes each frame; `T_map_base` at its stamp, where its view told that and nothing else did but the wheels.
  void Watch(const FramePacket& packet, const std::optional<Rigid2>& T_map_base);
  // The map was bent, or the robot was found elsewhere: headings before and after do not belong together.
  void Forget();
  // d in s: the prior as long as nothing turned.
  const ImageOffset& offset() const { return offset_; }
  // The same once a turn has told something.
  std::optional<ImageOffset> learned() const {
    return pairs_.empty() ? std::nullopt : std::optional<ImageOffset>(offset_);
  }

 private:
  struct Heading {
    Timestamp stamp;
    double off = 0.0;   // rad, h - o
    double odom = 0.0;  // rad, o
    double rate = 0.0;  // rad/s, w
  };
  struct Pair {
    double rate = 0.0, turn = 0.0;  // u in rad/s, a in rad
    double off = 0.0;               // rad, y
    double share = 1.0;             // 1 / v
  };
  void Take(const Heading& heading);
  void Solve();
  void Weigh(double variance);  // of d by the pairs alone
  double Residual(const Pair& pair) const;

  ImageTimingOptions options_;
  OdometryBuffer wheels_;
  std::optional<Heading> waiting_;                   // for what odometry says of the time after it
  std::deque<Heading> headings_;                     // of the last second
  std::deque<Pair> pairs_;                           // the latest that tell of d or s
  Eigen::Vector2d known_ = Eigen::Vector2d::Zero();  // [d, s] by the pairs alone
  ImageOffset offset_;
};

}  // namespace planar_vslam
