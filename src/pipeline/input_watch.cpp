#include "planar_vslam/pipeline/input_watch.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

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

bool AreSame(const std::vector<float>& a, const std::vector<float>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

// Of every fourth word, which another picture has by chance only (FNV-1a). Nothing where it shows nothing: all black,
// say.
std::optional<std::uint64_t> SumOf(const std::vector<std::uint8_t>& pixels) {
  constexpr std::uint64_t kStart = 14695981039346656037U, kPrime = 1099511628211U;
  std::uint64_t sum = kStart, first = 0, word = 0;
  bool shows = false;
  for (std::size_t i = 0; i + sizeof(word) <= pixels.size(); i += 4 * sizeof(word)) {
    std::memcpy(&word, pixels.data() + i, sizeof(word));
    if (i == 0) first = word;
    shows = shows || word != first;
    sum = (sum ^ word) * kPrime;
  }
  return shows ? std::optional<std::uint64_t>(sum) : std::nullopt;
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

double StreamRhythm::StartsAfter(const StreamRhythm& other) const {
  return first_.has_value() && other.first_.has_value() ? SecondsBetween(*other.first_, *first_) : 0.0;
}

double StreamRhythm::EndsBefore(const StreamRhythm& other) const {
  return last_.has_value() && other.last_.has_value() ? SecondsBetween(*last_, *other.last_) : 0.0;
}

template <class Content, class Same>
bool InputWatch::IsOld(const Content& content, Timestamp stamp, const Same& same, StandStill<Content>* since) const {
  constexpr double kMoved = 0.05;  // m or rad
  const Rigid2 T_odom_base = last_reading_.has_value() ? last_reading_->T_odom_base : Rigid2();
  if (!since->content.has_value() || !same(content, *since->content)) {
    *since = {content, T_odom_base, std::nullopt, since->longest};
    return false;
  }
  const Rigid2 moved = since->T_odom_base.Inverse() * T_odom_base;
  if (moved.translation.norm() <= kMoved && std::abs(moved.angle) <= kMoved) return false;
  if (!since->old.has_value()) since->old = stamp;
  since->longest = std::max(since->longest, SecondsBetween(*since->old, stamp));
  return true;
}

// No two images or sweeps of a real sensor are the same while it moves, but for sweeps that see nothing.
void InputWatch::Add(const CameraFrame& frame) {
  constexpr double kDark = 25.0, kBright = 230.0;  // grey levels
  images_.Add(frame.image.stamp);
  if (!T_base_camera_.has_value()) T_base_camera_ = frame.T_base_camera;
  if (frame.image.image.empty()) return;
  const std::optional<std::uint64_t> sum = SumOf(*frame.image.image.pixels);
  if (sum.has_value() && IsOld(*sum, frame.image.stamp, std::equal_to<>(), &image_)) ++old_images_;
  const double grey = MeanGrey(frame.image.image);
  looked_at_ += 1.0;
  dark_ += grey < kDark ? 1 : 0;
  bright_ += grey > kBright ? 1 : 0;
}

bool InputWatch::Add(const LaserFrame& frame) {
  scans_.Add(frame.scan.stamp);
  constexpr std::ptrdiff_t kFewest = 20;  // beams that hit something: a few may well read the same again
  const std::vector<float>& ranges = frame.scan.ranges;
  const auto hits = std::count_if(ranges.begin(), ranges.end(), [&frame](float range) {
    return std::isfinite(range) && range >= frame.scan.range_min && range < frame.scan.range_max;
  });
  if (hits >= kFewest && IsOld(ranges, frame.scan.stamp, AreSame, &sweep_)) {
    ++old_sweeps_;
    return false;
  }
  laser_.Add(frame);
  return true;
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
  AddBend(reading);
}

void InputWatch::AddBend(const OdometryReading& reading) {
  constexpr double kStep = 0.2, kLongest = 0.5, kBend = 0.02;  // s, s, rad
  if (!bend_start_.has_value()) bend_start_ = reading;
  const double seconds = SecondsBetween(bend_start_->stamp, reading.stamp);
  if (seconds >= 0.0 && seconds < kStep) return;
  const Rigid2 driven = bend_start_->T_odom_base.Inverse() * reading.T_odom_base;
  bend_start_ = reading;
  if (seconds < 0.0 || seconds > kLongest || std::abs(driven.angle) < kBend) return;
  const double sideways = driven.translation.norm() * std::abs(driven.angle) / (seconds * seconds);
  if (std::isfinite(sideways)) sideways_.Add(sideways);
}

double InputWatch::odometry_back_and_forth() const {
  const long steps = odometry_.intervals.count();
  return steps > 0 ? static_cast<double>(back_and_forth_) / static_cast<double>(steps) : 0.0;
}

double InputWatch::wheel_sideways() const {
  constexpr double kMost = 0.9;
  return sideways_.Percentile(kMost);
}

double InputWatch::wheel_speed() const {
  constexpr double kMost = 0.9;
  return speeds_.Percentile(kMost);
}

}  // namespace planar_vslam
