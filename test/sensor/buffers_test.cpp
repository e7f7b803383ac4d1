#include "planar_vslam/sensor/buffers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

Timestamp At(double seconds) { return Timestamp::FromSeconds(seconds); }

OdometryBuffer DriveAcrossPi() {
  OdometryBuffer buffer;
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.1 * i;
    buffer.Push({At(t), Rigid2(0.5 * t, -0.2 * t, M_PI - 0.45 + 0.9 * t)});
  }
  return buffer;
}

TEST(Timestamp, SecondsRoundTripAndDifferencesAreExact) {
  EXPECT_EQ(At(1.5).nanoseconds, 1500000000);
  const Timestamp late{1700000000123456789};
  const Timestamp later{1700000000123456790};
  EXPECT_DOUBLE_EQ(SecondsBetween(late, later), 1e-9);
  EXPECT_DOUBLE_EQ(SecondsBetween(later, late), -1e-9);
}

TEST(OdometryBuffer, NeverExtrapolates) {
  OdometryBuffer empty;
  EXPECT_TRUE(empty.empty());
  EXPECT_FALSE(empty.Covers(At(0.0)));
  EXPECT_FALSE(empty.Interpolate(At(0.0)));
  const OdometryBuffer buffer = DriveAcrossPi();
  EXPECT_FALSE(buffer.Interpolate({-1}));
  EXPECT_FALSE(buffer.Interpolate({1000000001}));
  EXPECT_TRUE(buffer.Interpolate(buffer.first_stamp()));
  EXPECT_TRUE(buffer.Interpolate(buffer.last_stamp()));
}

TEST(OdometryBuffer, ReturnsTheReadingsAtTheirStamps) {
  const OdometryBuffer buffer = DriveAcrossPi();
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.1 * i;
    const auto pose = buffer.Interpolate(At(t));
    ASSERT_TRUE(pose);
    EXPECT_EQ(pose->translation, Eigen::Vector2d(0.5 * t, -0.2 * t));
  }
}

TEST(OdometryBuffer, InterpolatesAcrossYawPiTheShortWay) {
  const OdometryBuffer buffer = DriveAcrossPi();
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.01 * i;
    const auto pose = buffer.Interpolate(At(t));
    ASSERT_TRUE(pose);
    EXPECT_NEAR(WrapAngle(pose->angle - (M_PI - 0.45 + 0.9 * t)), 0.0, 1e-9) << t;
    EXPECT_LT((pose->translation - Eigen::Vector2d(0.5 * t, -0.2 * t)).norm(), 2e-3) << t;
    EXPECT_LE(std::abs(pose->angle), M_PI);
  }
}

TEST(OdometryBuffer, RefusesReadingsOutOfOrderOrNotFinite) {
  OdometryBuffer buffer = DriveAcrossPi();
  EXPECT_EQ(buffer.Push({At(1.0), Rigid2()}), PushResult::kNotMonotonic);
  EXPECT_EQ(buffer.Push({At(0.5), Rigid2()}), PushResult::kNotMonotonic);
  Rigid2 broken;
  broken.translation.y() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(buffer.Push({At(2.0), broken}), PushResult::kNotFinite);
  broken = Rigid2();
  broken.angle = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(buffer.Push({At(2.0), broken}), PushResult::kNotFinite);
  EXPECT_EQ(buffer.last_stamp(), At(1.0));
  EXPECT_EQ(buffer.Push({At(2.0), Rigid2()}), PushResult::kAccepted);
}

TEST(OdometryBuffer, PartsOfAnIncrementKeepItsCovarianceRate) {
  OdometryBuffer buffer;
  for (int k = 0; k < 4; ++k) {
    OdometryReading reading{At(0.1 * k), Rigid2(0.1 * k, 0.0, 0.0)};
    if (k > 0) reading.covariance_rate = k * Eigen::Matrix3d::Identity();
    buffer.Push(reading);
  }
  const auto slice = buffer.Slice(At(0.05), At(0.25));
  ASSERT_EQ(slice.size(), 4U);
  for (std::size_t k = 1; k < slice.size(); ++k) {
    ASSERT_TRUE(slice[k].covariance_rate.has_value()) << k;
    EXPECT_EQ((*slice[k].covariance_rate)(0, 0), static_cast<double>(k));
  }
  EXPECT_EQ((*buffer.Slice(At(0.0), At(0.2)).back().covariance_rate)(0, 0), 2.0);
}

TEST(OdometryBuffer, SliceHasBothEndsAndEveryReadingBetween) {
  const OdometryBuffer buffer = DriveAcrossPi();
  const auto slice = buffer.Slice(At(0.25), At(0.55));
  ASSERT_EQ(slice.size(), 5u);  // 0.25 0.3 0.4 0.5 0.55
  EXPECT_EQ(slice.front().stamp, At(0.25));
  EXPECT_EQ(slice.back().stamp, At(0.55));
  for (std::size_t i = 0; i < slice.size(); ++i) {
    if (i > 0) {
      EXPECT_LT(slice[i - 1].stamp, slice[i].stamp);
    }
    EXPECT_EQ(slice[i].T_odom_base.translation, buffer.Interpolate(slice[i].stamp)->translation);
  }
  EXPECT_EQ(buffer.Slice(At(0.2), At(0.4)).size(), 3u);
  EXPECT_EQ(buffer.Slice(At(0.21), At(0.22)).size(), 2u);
  EXPECT_EQ(buffer.Slice(At(0.3), At(0.3)).size(), 1u);
  EXPECT_EQ(buffer.Slice(At(0.0), At(1.0)).size(), 11u);
  EXPECT_TRUE(buffer.Slice(At(0.5), At(1.01)).empty());
  EXPECT_TRUE(buffer.Slice({-1}, At(0.5)).empty());
}

TEST(OdometryBuffer, ForgettingLeavesLaterQueriesUnchanged) {
  const OdometryBuffer before = DriveAcrossPi();
  for (const double cut : {-1.0, 0.0, 0.3, 0.35, 0.999, 1.0, 5.0}) {
    OdometryBuffer after = before;
    after.DropBefore(At(cut));
    ASSERT_FALSE(after.empty());
    EXPECT_EQ(after.last_stamp(), before.last_stamp());
    for (int i = 0; i <= 100; ++i) {
      const Timestamp stamp = At(0.01 * i);
      if (stamp < At(cut)) continue;
      ASSERT_TRUE(after.Covers(stamp)) << cut;
      EXPECT_EQ(after.Interpolate(stamp)->translation, before.Interpolate(stamp)->translation);
    }
  }
  OdometryBuffer after = before;
  after.DropBefore(At(0.35));
  EXPECT_EQ(after.first_stamp(), At(0.3));
}

TEST(TransformBuffer, StaticHoldsAtAnyTime) {
  TransformBuffer buffer;
  EXPECT_TRUE(buffer.empty());
  EXPECT_FALSE(buffer.At(At(0.0)));
  const Rigid3 T(ExpSo3({0.1, 0.2, 0.3}), Eigen::Vector3d(1.0, 2.0, 3.0));
  buffer.SetStatic(T);
  EXPECT_FALSE(buffer.empty());
  EXPECT_TRUE(buffer.is_static());
  for (const double t : {-100.0, 0.0, 1e6}) {
    EXPECT_TRUE(buffer.Covers(At(t)));
    EXPECT_EQ(buffer.At(At(t))->translation, T.translation);
  }
}

TEST(TransformBuffer, InterpolatesBetweenSamplesAndNeverExtrapolates) {
  TransformBuffer buffer;
  const auto turned = [](double yaw) { return Embed3(Rigid2(0.1, 0.0, yaw)); };
  EXPECT_EQ(buffer.Push(At(0.0), turned(M_PI - 0.1)), PushResult::kAccepted);
  EXPECT_EQ(buffer.Push(At(1.0), turned(M_PI + 0.1)), PushResult::kAccepted);
  EXPECT_FALSE(buffer.is_static());
  EXPECT_FALSE(buffer.At({-1}));
  EXPECT_FALSE(buffer.At({1000000001}));
  for (int i = 0; i <= 10; ++i) {
    const auto pose = buffer.At(At(0.1 * i));
    ASSERT_TRUE(pose);
    const double expected = M_PI - 0.1 + 0.02 * i;
    EXPECT_LT(pose->rotation.angularDistance(turned(expected).rotation), 1e-9);
  }
}

TEST(TransformBuffer, RefusesSamplesOutOfOrderOrNotARotation) {
  TransformBuffer buffer;
  EXPECT_EQ(buffer.Push(At(1.0), Rigid3()), PushResult::kAccepted);
  EXPECT_EQ(buffer.Push(At(1.0), Rigid3()), PushResult::kNotMonotonic);
  EXPECT_EQ(buffer.Push(At(2.0), Rigid3(Eigen::Quaterniond(0.0, 0.0, 0.0, 0.0), Eigen::Vector3d::Zero())),
            PushResult::kNotFinite);
  EXPECT_EQ(buffer.Push(At(2.0), Rigid3(Eigen::Quaterniond::Identity(),
                                        Eigen::Vector3d(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0))),
            PushResult::kNotFinite);
}

TEST(TransformBuffer, ForgettingLeavesLaterQueriesUnchanged) {
  TransformBuffer before;
  for (int i = 0; i <= 5; ++i) before.Push(At(i), Rigid3(ExpSo3({0.1 * i, 0.0, 0.0}), Eigen::Vector3d(i, 0.0, 0.0)));
  TransformBuffer after = before;
  after.DropBefore(At(2.5));
  EXPECT_FALSE(after.Covers(At(1.9)));
  for (const double t : {2.0, 2.5, 3.0, 4.9, 5.0}) {
    EXPECT_EQ(after.At(At(t))->translation, before.At(At(t))->translation);
  }
}

}  // namespace
}  // namespace planar_vslam
