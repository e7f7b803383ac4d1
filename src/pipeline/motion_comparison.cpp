#include "planar_vslam/pipeline/motion_comparison.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kLongestStep = 0.5;        // s between neighbours
constexpr std::size_t kStraightFrames = 5;  // over which a direction is told
constexpr double kFewest = 30.0;            // steps that show something
constexpr double kNearOffset = 0.3;         // s, to either side of a rough offset
constexpr std::size_t kBlock = 25;          // directions ...
constexpr std::size_t kFewestBlocks = 5;    // ... whose blocks tell how well it is known

// The wheels' motion between two stamps of the camera's clock.
std::optional<Rigid2> Driven(const OdometryBuffer& wheels, Timestamp from, Timestamp to, double offset) {
  const std::optional<Rigid2> first = wheels.Interpolate(Shifted(from, offset));
  const std::optional<Rigid2> second = wheels.Interpolate(Shifted(to, offset));
  if (!first.has_value() || !second.has_value()) return std::nullopt;
  return first->Inverse() * *second;
}

// From each pose to the next.
std::vector<SeenTurn> TurnsOf(const std::vector<SeenPose>& seen) {
  std::vector<SeenTurn> turns;
  for (std::size_t i = 1; i < seen.size(); ++i) {
    const SeenPose &a = seen[i - 1], &b = seen[i];
    turns.push_back({a.stamp, b.stamp, WrapAngle(b.T_map_base.angle - a.T_map_base.angle)});
  }
  return turns;
}

struct Turns {
  double gg = 0.0, gr = 0.0, rr = 0.0, ww = 0.0, vv = 0.0, vw = 0.0;  // weighted sums
};

// Of all steps: by how much the turns differ (r) and how that changes with the offset (g).
Turns SumTurns(const std::vector<SeenTurn>& seen, const OdometryBuffer& wheels, double offset) {
  constexpr double kStep = 0.02, kOutlier = 0.01;  // s, rad
  Turns sums;
  for (const SeenTurn& turn : seen) {
    if (SecondsBetween(turn.from, turn.to) > kLongestStep) continue;
    const std::optional<Rigid2> here = Driven(wheels, turn.from, turn.to, offset);
    const std::optional<Rigid2> later = Driven(wheels, turn.from, turn.to, offset + kStep);
    const std::optional<Rigid2> sooner = Driven(wheels, turn.from, turn.to, offset - kStep);
    if (!here.has_value() || !later.has_value() || !sooner.has_value()) continue;
    const double r = WrapAngle(turn.angle - here->angle);
    const double g = WrapAngle(later->angle - sooner->angle) / (2.0 * kStep);
    const double weight = kOutlier / std::max(kOutlier, std::abs(r));
    sums.gg += weight * g * g;
    sums.gr += weight * g * r;
    sums.rr += weight * r * r;
    sums.ww += weight;
    sums.vv += turn.angle * turn.angle;
    sums.vw += turn.angle * here->angle;
  }
  return sums;
}

// How much the turns of single steps differ under an offset, in the mean. Nothing where too few steps are covered.
std::optional<double> TurnDifference(const std::vector<SeenTurn>& seen, const OdometryBuffer& wheels, double offset) {
  constexpr double kMostDifference = 0.1;   // rad, of a step
  constexpr std::size_t kMostSteps = 2000;  // of a long drive, that are looked at
  const std::size_t every = 1 + seen.size() / kMostSteps;
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < seen.size(); i += every) {
    const SeenTurn& turn = seen[i];
    if (SecondsBetween(turn.from, turn.to) > kLongestStep) continue;
    const std::optional<Rigid2> driven = Driven(wheels, turn.from, turn.to, offset);
    if (!driven.has_value()) continue;
    sum += std::min(kMostDifference, std::abs(WrapAngle(turn.angle - driven->angle)));
    count += 1.0;
  }
  if (count < kFewest) return std::nullopt;
  return sum / count;
}

// The offset around which to look exactly: a small one, unless the turns are clearly more alike far from it. Turns that
// repeat themselves are alike under several offsets, hence clearly.
double RoughOffset(const std::vector<SeenTurn>& seen, const OdometryBuffer& wheels) {
  constexpr int kSteps = 50;        // to either side ...
  constexpr double kStep = 0.1;     // ... of s, less than turns last
  constexpr double kClearly = 0.5;  // of the difference near no offset
  std::optional<double> near, best;
  double near_offset = 0.0, best_offset = 0.0;
  for (int k = -kSteps; k <= kSteps; ++k) {
    const double offset = kStep * k;
    const std::optional<double> difference = TurnDifference(seen, wheels, offset);
    if (!difference.has_value()) continue;
    if (std::abs(offset) <= kNearOffset + 0.5 * kStep && (!near.has_value() || *difference < *near)) {
      near = difference;
      near_offset = offset;
    }
    if (best.has_value() && *difference >= *best) continue;
    best = difference;
    best_offset = offset;
  }
  return near.has_value() && *best < kClearly * *near ? best_offset : near_offset;
}

// The offset under which the wheels' turns are most like the images', by Gauss and Newton.
std::optional<Deviation> TimeOffset(const std::vector<SeenTurn>& seen, const OdometryBuffer& wheels) {
  constexpr int kRounds = 6;
  const double rough = RoughOffset(seen, wheels);
  Deviation offset{rough, 0.0};
  for (int round = 0; round < kRounds; ++round) {
    const Turns sums = SumTurns(seen, wheels, offset.value);
    if (sums.ww < kFewest || sums.gg == 0.0) return std::nullopt;
    offset.value = std::clamp(offset.value + sums.gr / sums.gg, rough - kNearOffset, rough + kNearOffset);
    offset.sigma = std::sqrt(sums.rr / sums.ww / sums.gg);
  }
  constexpr double kTold = 0.02;  // s; where little turns, the rest is noise
  if (offset.sigma > kTold || std::abs(offset.value - rough) >= kNearOffset) return std::nullopt;
  return offset;
}

std::optional<Deviation> Turn(const std::vector<SeenTurn>& seen, const OdometryBuffer& wheels, double offset) {
  constexpr double kTurned = 0.05;  // rad^2, of all steps
  const Turns sums = SumTurns(seen, wheels, offset);
  if (sums.ww < kFewest || sums.vv < kTurned) return std::nullopt;
  return Deviation{sums.vw / sums.vv - 1.0, std::sqrt(sums.rr / sums.ww / sums.vv)};
}

// The mean direction, and how well it is known by the scatter of blocks: noise of neighbours cancels inside one.
std::optional<Deviation> MeanOfBlocks(const std::vector<Eigen::Vector2d>& turns) {
  const std::size_t count = turns.size() / kBlock;
  if (count < kFewestBlocks) return std::nullopt;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& turn : turns) sum += turn;
  const double mean = std::atan2(sum.y(), sum.x());
  double squares = 0.0, weights = 0.0;
  for (std::size_t block = 0; block < count; ++block) {
    Eigen::Vector2d part = Eigen::Vector2d::Zero();
    for (std::size_t i = block * kBlock; i < (block + 1) * kBlock; ++i) part += turns[i];
    squares += part.norm() * std::pow(WrapAngle(std::atan2(part.y(), part.x()) - mean), 2);
    weights += part.norm();
  }
  return Deviation{mean, std::sqrt(squares / weights / static_cast<double>(count - 1))};
}

// By the chords of nearly straight stretches, longer ones counting more.
std::optional<Deviation> Direction(const std::vector<SeenPose>& seen, const OdometryBuffer& wheels, double offset) {
  constexpr double kShortest = 0.05, kStraight = 0.15;  // m, rad
  std::vector<Eigen::Vector2d> turns;                   // from the view's chord to the wheels', as long as the wheels'
  for (std::size_t i = kStraightFrames; i < seen.size(); ++i) {
    const SeenPose &first = seen[i - kStraightFrames], &second = seen[i];
    if (SecondsBetween(first.stamp, second.stamp) > kLongestStep * static_cast<double>(kStraightFrames)) continue;
    const std::optional<Rigid2> driven = Driven(wheels, first.stamp, second.stamp, offset);
    const Rigid2 viewed = first.T_map_base.Inverse() * second.T_map_base;
    if (!driven.has_value() || driven->translation.norm() < kShortest || std::abs(viewed.angle) > kStraight) continue;
    const Eigen::Vector2d &a = viewed.translation, &b = driven->translation;
    if (a.norm() == 0.0) continue;
    turns.emplace_back(a.dot(b) / a.norm(), (a.x() * b.y() - a.y() * b.x()) / a.norm());
  }
  return MeanOfBlocks(turns);
}

}  // namespace

MotionAgreement CompareMotions(const std::vector<SeenPose>& seen, const OdometryBuffer& wheels) {
  MotionAgreement agreement;
  const std::vector<SeenTurn> turns = TurnsOf(seen);
  agreement.time_offset = TimeOffset(turns, wheels);
  const double offset = agreement.time_offset.has_value() ? agreement.time_offset->value : 0.0;
  agreement.turn = Turn(turns, wheels, offset);
  agreement.direction = Direction(seen, wheels, offset);
  return agreement;
}

std::optional<Deviation> CompareTurns(const std::vector<SeenTurn>& turns, const OdometryBuffer& wheels) {
  return TimeOffset(turns, wheels);
}

}  // namespace planar_vslam
