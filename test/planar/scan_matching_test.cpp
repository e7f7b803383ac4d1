#include "planar_vslam/planar/scan_matching.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

using Segment = std::pair<Eigen::Vector2d, Eigen::Vector2d>;

std::vector<Segment> Closed(const std::vector<Eigen::Vector2d>& corners) {
  std::vector<Segment> walls;
  for (std::size_t i = 0; i < corners.size(); ++i) walls.emplace_back(corners[i], corners[(i + 1) % corners.size()]);
  return walls;
}

// An L-shaped room of 6 x 5 m with a box in it.
std::vector<Segment> Room() {
  std::vector<Segment> walls = Closed({{-3, -2}, {3, -2}, {3, 1}, {0.5, 1}, {0.5, 3}, {-3, 3}});
  const std::vector<Segment> box = Closed({{-1.8, 0.9}, {-1.2, 1.1}, {-1.4, 1.7}, {-2.0, 1.5}});
  walls.insert(walls.end(), box.begin(), box.end());
  return walls;
}

// Two walls without ends in sight.
std::vector<Segment> Corridor() { return {{{-50, -1}, {50, -1}}, {{-50, 1}, {50, 1}}}; }

float RangeTo(const std::vector<Segment>& walls, const Eigen::Vector2d& from, double angle) {
  const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : walls) {
    const Eigen::Vector2d along = b - a, offset = a - from;
    const double cross = ray.x() * along.y() - ray.y() * along.x();
    if (std::abs(cross) < 1e-12) continue;
    const double range = (offset.x() * along.y() - offset.y() * along.x()) / cross;
    const double share = (offset.x() * ray.y() - offset.y() * ray.x()) / cross;
    if (range > 0.0 && share >= 0.0 && share <= 1.0) nearest = std::min(nearest, range);
  }
  return static_cast<float>(nearest);
}

const Rigid3 kT_base_laser(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0.0, 0.25));

PlanarScan Sweep(const std::vector<Segment>& walls, const Rigid2& T_world_base, double noise, std::mt19937* generator) {
  PlanarScan scan;
  scan.angle_min = -0.75 * M_PI;
  scan.angle_increment = 1.5 * M_PI / 540.0;
  scan.range_max = 8.0;
  const Rigid2 T_world_laser = T_world_base * Rigid2(0.1, 0.0, 0.0);
  std::normal_distribution<float> deviation(0.0F, 1.0F);
  for (int beam = 0; beam <= 540; ++beam) {
    const double angle = T_world_laser.angle + scan.angle_min + beam * scan.angle_increment;
    const float range = RangeTo(walls, T_world_laser.translation, angle);
    scan.ranges.push_back(range < 8.0F ? range + static_cast<float>(noise) * deviation(*generator)
                                       : std::numeric_limits<float>::infinity());
  }
  return scan;
}

class ScanMatchingTest : public ::testing::Test {
 protected:
  PreparedScan Prepared(const std::vector<Segment>& walls, const Rigid2& T_world_base, double noise = 0.01) {
    return PrepareScan(Sweep(walls, T_world_base, noise, &generator_), kT_base_laser, options_);
  }
  double Uniform(double limit) { return std::uniform_real_distribution<double>(-limit, limit)(generator_); }
  Rigid2 RandomPlace() { return {-0.5 + Uniform(1.0), -0.5 + Uniform(0.8), Uniform(M_PI)}; }

  std::mt19937 generator_{5};
  ScanMatchOptions options_;
};

TEST_F(ScanMatchingTest, FindsTheMotionFromAGuessThatIsOff) {
  for (int round = 0; round < 40; ++round) {
    const Rigid2 T_world_a = RandomPlace();
    const Rigid2 T_a_b(Uniform(0.5), Uniform(0.3), Uniform(0.4));
    const PreparedScan a = Prepared(Room(), T_world_a), b = Prepared(Room(), T_world_a * T_a_b);
    const Rigid2 guess = T_a_b * Rigid2(Uniform(0.12), Uniform(0.12), Uniform(DegreesToRadians(4.0)));
    const auto match = MatchScans(a, b, guess, options_);
    ASSERT_TRUE(match.has_value()) << round;
    const Rigid2 error = T_a_b.Inverse() * match->T_reference_current;
    EXPECT_LT(error.translation.norm(), 0.012) << round;
    EXPECT_LT(std::abs(error.angle), DegreesToRadians(0.25)) << round;
    EXPECT_GT(match->share, 0.7);
  }
}

// Normalised by the reported covariance, the squared error has mean 3 where that is right.
TEST_F(ScanMatchingTest, ErrorsAreAsLargeAsTheReportedCovariance) {
  constexpr int kRounds = 60;
  options_.range_sigma = 0.01;  // as it is here
  double sum = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    const Rigid2 T_world_a = RandomPlace(), T_a_b(Uniform(0.3), Uniform(0.2), Uniform(0.3));
    const auto match = MatchScans(Prepared(Room(), T_world_a), Prepared(Room(), T_world_a * T_a_b), T_a_b, options_);
    ASSERT_TRUE(match.has_value());
    const Eigen::Vector3d error = LogSe2(T_a_b.Inverse() * match->T_reference_current);
    sum += error.dot(match->covariance.inverse() * error);
  }
  EXPECT_LT(sum / kRounds, 4.5);
  EXPECT_GT(sum / kRounds, 1.5);
}

TEST_F(ScanMatchingTest, WithoutNoiseTheMotionIsExact) {
  const Rigid2 T_world_a(0.2, -0.4, 3.1), T_a_b(0.2, 0.0, 0.1);  // across yaw = pi
  const auto match = MatchScans(Prepared(Room(), T_world_a, 0.0), Prepared(Room(), T_world_a * T_a_b, 0.0),
                                T_a_b * Rigid2(0.03, -0.02, 0.02), options_);
  ASSERT_TRUE(match.has_value());
  EXPECT_LT(LogSe2(T_a_b.Inverse() * match->T_reference_current).norm(), 0.003);
}

TEST_F(ScanMatchingTest, AlongACorridorItClaimsNothing) {
  const Rigid2 T_a_b(0.2, 0.05, 0.02), guess(0.27, 0.05, 0.02);
  const auto match = MatchScans(Prepared(Corridor(), Rigid2()), Prepared(Corridor(), T_a_b), guess, options_);
  ASSERT_TRUE(match.has_value());
  EXPECT_LT(std::abs(match->T_reference_current.translation.y() - 0.05), 0.01);
  const Eigen::Matrix2d position = match->covariance.topLeftCorner<2, 2>();
  EXPECT_GT(position(0, 0), 100.0 * position(1, 1));
  EXPECT_LT(std::abs(match->T_reference_current.translation.x() - 0.27), 0.05) << "stays near the guess";
}

// Round pillars seen from the front only: taken for flat, their front would push the robot at them.
TEST_F(ScanMatchingTest, PillarsInACorridorDoNotPushForward) {
  std::vector<Segment> walls = Corridor();
  for (const Eigen::Vector2d& center : {Eigen::Vector2d(2.5, 0.6), Eigen::Vector2d(4.0, -0.6)}) {
    std::vector<Eigen::Vector2d> corners;
    constexpr int kSides = 48;
    constexpr double kRadius = 0.3;
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2.0 * M_PI * k / kSides;
      corners.emplace_back(center + kRadius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    const std::vector<Segment> pillar = Closed(corners);
    walls.insert(walls.end(), pillar.begin(), pillar.end());
  }
  double sum = 0.0, nees = 0.0;
  int matched = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Rigid2 T_a_b(0.5, 0.0, 0.0), guess(0.5 + Uniform(0.05), Uniform(0.05), Uniform(0.02));
    const auto match = MatchScans(Prepared(walls, Rigid2()), Prepared(walls, T_a_b), guess, options_);
    if (!match.has_value()) continue;  // little to match by: saying nothing is right, too
    const double error = match->T_reference_current.translation.x() - 0.5;
    sum += error;
    nees += error * error / match->covariance(0, 0);
    ++matched;
  }
  ASSERT_GT(matched, kTrials / 2);
  EXPECT_LT(std::abs(sum / matched), 0.01);  // taken for flat they push by several centimetres
  EXPECT_LT(nees / matched, 1.5) << "along the corridor it claims no more than it knows";
}

// A robot that goes through a door sees one face of the wall before and the other one after.
TEST_F(ScanMatchingTest, TheTwoFacesOfAWallAreNoOneSurface) {
  constexpr double kThick = 0.1;  // m
  std::vector<Segment> walls = Corridor();
  for (const double side : {-1.0, 1.0}) {
    const std::vector<Segment> jamb = Closed({{0, side}, {0, 0.6 * side}, {kThick, 0.6 * side}, {kThick, side}});
    walls.insert(walls.end(), jamb.begin(), jamb.end());
  }
  for (int round = 0; round < 10; ++round) {
    const Rigid2 T_world_a(-0.5 + Uniform(0.1), Uniform(0.1), M_PI / 2.0 + Uniform(0.1));
    const Rigid2 T_world_b(0.6 + Uniform(0.1), Uniform(0.1), M_PI / 2.0 + Uniform(0.1));
    const Rigid2 T_a_b = T_world_a.Inverse() * T_world_b;
    const auto match = MatchScans(Prepared(walls, T_world_a), Prepared(walls, T_world_b), T_a_b, options_);
    if (!match.has_value()) continue;  // right, too: few points are common
    EXPECT_LT((match->T_reference_current.translation - T_a_b.translation).norm(), 0.03) << round;
  }
}

TEST_F(ScanMatchingTest, SaysNothingWhereSweepsDoNotOverlap) {
  const std::vector<Segment> elsewhere = Closed({{-1, -4}, {0.4, -4}, {1.5, 0}, {0.2, 2.2}, {-0.9, 0.3}});
  EXPECT_FALSE(MatchScans(Prepared(Room(), Rigid2()), Prepared(elsewhere, Rigid2()), Rigid2(), options_).has_value());
  const PreparedScan nothing = Prepared({}, Rigid2());
  EXPECT_TRUE(nothing.points.empty());
  EXPECT_FALSE(MatchScans(Prepared(Room(), Rigid2()), nothing, Rigid2(), options_).has_value());
  EXPECT_FALSE(MatchScans(nothing, Prepared(Room(), Rigid2()), Rigid2(), options_).has_value());
}

TEST_F(ScanMatchingTest, ReturnsThatAreNoneAreNoPoints) {
  PlanarScan scan = Sweep(Room(), Rigid2(), 0.0, &generator_);
  const std::size_t all = PrepareScan(scan, kT_base_laser, options_).points.size();
  scan.ranges[10] = std::numeric_limits<float>::quiet_NaN();
  scan.ranges[20] = -1.0F;
  scan.ranges[30] = 8.0F;
  EXPECT_EQ(PrepareScan(scan, kT_base_laser, options_).points.size(), all - 3);
}

TEST(ScanMatchOptions, NamesEveryProblem) {
  EXPECT_TRUE(ScanMatchOptions{}.Problems().empty());
  ScanMatchOptions options;
  options.range_sigma = 0.0;
  options.max_offset = std::numeric_limits<double>::quiet_NaN();
  options.min_share = 1.0;
  options.min_points = 3;
  EXPECT_EQ(options.Problems().size(), 4U);
}

}  // namespace
}  // namespace planar_vslam
