#include "planar_vslam/pipeline/image_clock.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

// s from the first to the second of a pair. Chosen by looking at five drives: over 0.1 s -3 ms come out of -21.
constexpr double kShortest = 0.6, kLongest = 1.0;

// rad/s, around the stamp.
std::optional<double> TurnRate(const OdometryBuffer& wheels, Timestamp stamp) {
  constexpr double kAround = 0.025;  // s
  const std::optional<Rigid2> before = wheels.Interpolate(Shifted(stamp, -kAround));
  const std::optional<Rigid2> after = wheels.Interpolate(Shifted(stamp, kAround));
  if (!before.has_value() || !after.has_value()) return std::nullopt;
  return WrapAngle(after->angle - before->angle) / (2.0 * kAround);
}

double HuberWeight(double residual) {
  constexpr double kUsual = 5e-3;  // rad: chosen by looking at five drives
  return kUsual / std::max(kUsual, std::abs(residual));
}

// Of N(0, variance), up to a factor.
double Likelihood(double x, double variance) { return std::exp(-0.5 * x * x / variance) / std::sqrt(variance); }

}  // namespace

void ImageClock::Watch(const FramePacket& packet, const std::optional<Rigid2>& T_map_base) {
  if (!options_.learn_clock) return;
  for (const OdometryReading& reading : packet.odometry) (void)wheels_.Push(reading);
  wheels_.DropBefore(Shifted(packet.image.stamp, -kLongest));
  if (waiting_.has_value()) {
    std::optional<double> rate = TurnRate(wheels_, Shifted(waiting_->stamp, applied_));
    if (!rate.has_value()) rate = TurnRate(wheels_, waiting_->stamp);
    if (rate.has_value()) Take({waiting_->stamp, waiting_->off + applied_ * *rate, waiting_->odom, *rate});
  }
  waiting_.reset();
  if (!T_map_base.has_value() || !packet.T_odom_base.has_value()) return;
  const double odom = packet.T_odom_base->angle;
  applied_ = packet.image_offset.value;
  waiting_ = Heading{packet.image.stamp, WrapAngle(T_map_base->angle - odom), odom};
}

void ImageClock::Forget() {
  waiting_.reset();
  headings_.clear();
}

void ImageClock::Take(const Heading& heading) {
  while (!headings_.empty() && SecondsBetween(headings_.front().stamp, heading.stamp) > kLongest) headings_.pop_front();
  const auto later = std::find_if(headings_.begin(), headings_.end(), [&](const Heading& other) {
    return SecondsBetween(other.stamp, heading.stamp) < kShortest;
  });
  const auto overlapping = 1.0 + static_cast<double>(headings_.end() - later);
  const std::optional<Heading> before = later == headings_.begin() ? std::nullopt : std::optional(*std::prev(later));
  headings_.push_back(heading);
  if (!before.has_value()) return;
  constexpr double kLeastRate = 0.03, kLeastTurn = 0.05;  // rad/s, rad: less tells nothing
  constexpr std::size_t kMost = 1000;
  const Pair pair{heading.stamp, heading.rate - before->rate, WrapAngle(heading.odom - before->odom),
                  WrapAngle(heading.off - before->off), 1.0 / overlapping};
  if (std::abs(pair.rate) < kLeastRate && std::abs(pair.turn) < kLeastTurn) return;
  pairs_.push_back(pair);
  if (pairs_.size() > kMost) pairs_.pop_front();
  Solve();
}

// One round of reweighting: the next pair brings the next.
void ImageClock::Solve() {
  constexpr double kOfShare = 0.01;  // (3 mrad / 0.03)^2, what is known of s before
  double uu = 0.0, ua = 0.0, aa = kOfShare, uy = 0.0, ay = 0.0;
  for (const Pair& p : pairs_) {
    const double weight = p.share * HuberWeight(Residual(p));
    uu += weight * p.rate * p.rate;
    ua += weight * p.rate * p.turn;
    aa += weight * p.turn * p.turn;
    uy += weight * p.rate * p.off;
    ay += weight * p.turn * p.off;
  }
  const double left = uu - ua * ua / aa;
  if (!(left > 0.0)) return;
  known_[0] = (uy - ua / aa * ay) / left;
  known_[1] = (ay - ua * known_[0]) / aa;
  const Turns turns = SumTurns(ua / aa);
  constexpr double kFewest = 4.0;  // chosen by looking: with three, south_hall was given an offset it does not have
  if (turns.count < kFewest) return;
  constexpr double kBias = 2e-3;  // s, common to all turns: of rolling shutters, and of poses that follow the wheels
  Weigh(turns.scatter / (left * left) * turns.count / (turns.count - 1.0) + kBias * kBias);
}

ImageClock::Turns ImageClock::SumTurns(double rate_by_turn) const {
  constexpr double kTogether = 4.0;  // s, as long as a turn takes
  constexpr double kLeast = 1e-3;    // rad, that a residual counts for at least: few may be small by chance
  double score = 0.0, told = 0.0, all = 0.0, squares = 0.0, scatter = 0.0;
  Timestamp begin = pairs_.front().stamp;
  const auto end_turn = [&] {
    scatter += score * score;
    all += told;
    squares += told * told;
    score = told = 0.0;
  };
  for (const Pair& p : pairs_) {
    if (SecondsBetween(begin, p.stamp) > kTogether) {
      end_turn();
      begin = p.stamp;
    }
    const double residual = Residual(p), own = p.rate - rate_by_turn * p.turn, weight = HuberWeight(residual);
    score += p.share * weight * own * residual;
    told += p.share * weight * own * own;
    scatter += p.share * weight * weight * own * own * kLeast * kLeast;
  }
  end_turn();
  return {scatter, squares > 0.0 ? all * all / squares : 0.0};
}

void ImageClock::Weigh(double variance) {
  constexpr double kFarthest = 0.15;  // s; beyond, no driver's delay
  const double prior = 9.0 * options_.sigma_clock * options_.sigma_clock, estimate = known_[0];
  const double none = Likelihood(estimate, variance), some = Likelihood(estimate, variance + prior);
  if (!(none + some > 0.0)) return;
  const double probability = some / (some + none), mean = estimate * prior / (prior + variance);
  probability_ = probability;
  constexpr double kSure = 0.9;
  const double sure = offset_.value == 0.0 ? kSure : 0.5;  // what is applied is not taken back at once
  const double value = probability > sure ? std::clamp(mean, -kFarthest, kFarthest) : 0.0;
  const double spread = probability * (variance * prior / (variance + prior) + std::pow(mean - value, 2)) +
                        (1.0 - probability) * value * value;
  offset_ = {value, std::sqrt(spread)};
}

double ImageClock::Residual(const Pair& p) const { return p.off - p.rate * known_[0] - p.turn * known_[1]; }

}  // namespace planar_vslam
