#include "planar_vslam/pipeline/input_watch.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kMillisecondsPerSecond = 1e3;

// Of every eighth pixel of every eighth row.
double MeanGrey(const GrayImage& image) {
  constexpr int kEvery = 8;
  double sum = 0.0, count = 0.0;
  for (int row = 0; row < image.height; row += kEvery) {
    const std::uint8_t* pixels = image.pixels->data() + static_cast<std::ptrdiff_t>(row) * image.width;
    for (int column = 0; column < image.width; column += kEvery) sum += pixels[column], count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

}  // namespace

void StreamRhythm::Add(Timestamp stamp) {
  constexpr double kHole = 1.0;  // s
  if (last_.has_value() && *last_ < stamp) {
    const double seconds = SecondsBetween(*last_, stamp);
    intervals.Add(kMillisecondsPerSecond * seconds);
    if (seconds > kHole) {
      ++holes;
      all_holes += seconds;
    }
    longest_hole = std::max(longest_hole, seconds);
  }
  if (!first_.has_value()) first_ = stamp;
  last_ = stamp;
}

double StreamRhythm::Apart(const StreamRhythm& other) const {
  if (!first_.has_value() || !other.first_.has_value()) return 0.0;
  const double after = SecondsBetween(*other.last_, *first_), before = SecondsBetween(*last_, *other.first_);
  constexpr double kLeast = 1.0;  // s: streams begin and end apart by less without any clock being wrong
  if (after > kLeast) return after;
  return before > kLeast ? -before : 0.0;
}

void InputWatch::Add(const CameraFrame& frame) {
  constexpr double kDark = 25.0, kBright = 230.0;  // grey levels
  images_.Add(frame.image.stamp);
  if (!T_base_camera_.has_value()) T_base_camera_ = frame.T_base_camera;
  if (frame.image.image.empty()) return;
  const double grey = MeanGrey(frame.image.image);
  looked_at_ += 1.0;
  dark_ += grey < kDark ? 1 : 0;
  bright_ += grey > kBright ? 1 : 0;
}

void InputWatch::Add(const OdometryReading& reading) {
  odometry_.Add(reading.stamp);
  laser_.Add(reading);
  if (last_reading_.has_value() && last_reading_->stamp < reading.stamp) {
    const Eigen::Vector2d step = reading.T_odom_base.translation - last_reading_->T_odom_base.translation;
    const double way = step.norm(), seconds = SecondsBetween(last_reading_->stamp, reading.stamp);
    constexpr double kSeen = 0.005, kFastest = 4.0, kTakenBack = 0.5;  // m, m/s, of the step
    const bool fast = way > kFastest * seconds || last_step_.norm() > kFastest * last_seconds_;
    if (way > kSeen && fast && (step + last_step_).norm() < kTakenBack * way) ++back_and_forth_;
    last_step_ = step;
    last_seconds_ = seconds;
    constexpr double kMoved = 1e-4;  // m
    if (std::isfinite(way) && way > kMoved) {
      speeds_.Add(way / seconds);
      way_ += way;
    }
  }
  last_reading_ = reading;
}

void InputWatch::Add(const LaserFrame& frame) {
  scans_.Add(frame.scan.stamp);
  laser_.Add(frame);
}

double InputWatch::odometry_back_and_forth() const {
  const long steps = odometry_.intervals.count();
  return steps > 0 ? static_cast<double>(back_and_forth_) / static_cast<double>(steps) : 0.0;
}

double InputWatch::wheel_speed() const {
  constexpr double kMost = 0.9;
  return speeds_.Percentile(kMost);
}

}  // namespace planar_vslam
