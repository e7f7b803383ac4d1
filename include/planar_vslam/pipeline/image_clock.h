#pragma once
// When images were taken, on odometry's clock. A camera's driver stamps an image when it arrives, some 10 to 80 ms
// after it was taken; while the robot turns by 60 degrees a second, 20 ms are a degree. An image stamped t was taken
// when odometry read t + d; where the camera was then is told by the wheels, which bridge so short a time without any
// error that matters: T_base_camera(t) = T_base(t)_base(t + d) T_base_camera. All poses are of the base at t, on
// odometry's clock, which is the laser's and tf's as well.
//
// d shows where turns begin and end. The headings of the base at a stamp by sight, h, for which an offset d' was
// applied, and by the wheels, o, differ by what the odometry frame is turned in the map, and by d - d' times the turn
// rate w:
//   y = (h - o + d' w)_k - (h - o + d' w)_j = d u + s a + e,   u = w_k - w_j,   a = o_k - o_j,
// s the share that the wheels turn too little and e noise. By least squares over pairs of frames more than half a
// second apart, with Huber's weights q: from one frame to the next a pose follows the wheels more than its view. Where
// v pairs overlap, each counts 1 / v. What is off in a turn is off in all of its pairs: the variance of d is that of
// sums over turns (Liang and Zeger 1986),
//   var(d) = n / (n - 1) sum_turns( sum q u' e / v )^2 / (sum q u'^2 / v)^2,
// u' what is left of u once it is regressed on a, n the number of turns, as if all told equally much: at least four.
// Half of the robots are taken to have no offset, the others one of N(0, (3 sigma_clock)^2). It counts once the pairs
// make it nine times as likely as none, until none is the likelier; the variance is that of both cases.
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
  // Whether images that were taken before should follow (map_edit.h, SetImageOffset): that bends the map, so more is
  // asked than for the next image. Chosen by looking: south_hall, which has no offset, comes to 0.93 for a minute.
  bool certain() const { return probability_ > 0.99; }
  // The same once a turn has told something.
  std::optional<ImageOffset> learned() const {
    return pairs_.empty() ? std::nullopt : std::optional<ImageOffset>(offset_);
  }

 private:
  struct Heading {
    Timestamp stamp;
    double off = 0.0;   // rad, h - o, with d' w once the rate is known
    double odom = 0.0;  // rad, o
    double rate = 0.0;  // rad/s, w
  };
  struct Pair {
    Timestamp stamp;                // of the second
    double rate = 0.0, turn = 0.0;  // u in rad/s, a in rad
    double off = 0.0;               // rad, y
    double share = 1.0;             // 1 / v
  };
  void Take(const Heading& heading);
  void Solve();
  void Weigh(double variance);  // of d by the pairs alone
  double Residual(const Pair& pair) const;
  // The variance of sum(q u' e / v), with u' = u - rate_by_turn a, and of how many turns that tell equally much.
  struct Turns {
    double scatter, count;
  };
  Turns SumTurns(double rate_by_turn) const;

  ImageTimingOptions options_;
  OdometryBuffer wheels_;
  std::optional<Heading> waiting_;                   // for what odometry says of the time after it
  double applied_ = 0.0;                             // s, d' of that
  std::deque<Heading> headings_;                     // of the last second
  std::deque<Pair> pairs_;                           // the latest that tell of d or s
  Eigen::Vector2d known_ = Eigen::Vector2d::Zero();  // [d, s] by the pairs alone
  ImageOffset offset_;
  double probability_ = 0.0;  // that there is an offset
};

}  // namespace planar_vslam
