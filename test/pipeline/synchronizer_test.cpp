#include "planar_vslam/pipeline/synchronizer.h"

#include <gtest/gtest.h>

#include <limits>

namespace planar_vslam {
namespace {

CameraFrame Image(double t) {
  CameraFrame frame;
  frame.image.stamp = Timestamp::FromSeconds(t);
  frame.T_base_camera.translation = Eigen::Vector3d(0.1, 0.2, t);
  return frame;
}

// The base drives along x at 1 m/s.
OdometryReading Odometry(double t) { return {Timestamp::FromSeconds(t), Rigid2(t, 0.0, 0.0)}; }

LaserFrame Scan(double t) {
  LaserFrame frame;
  frame.scan.stamp = Timestamp::FromSeconds(t);
  frame.T_base_laser.translation = Eigen::Vector3d(0.3, 0.0, 0.2);
  return frame;
}

TEST(Synchronizer, CameraWasElsewhereWhenALateImageWasTaken) {
  Synchronizer synchronizer(true);
  synchronizer.SetImageOffset({-0.02, 0.001});
  synchronizer.Push(Odometry(0.0));
  synchronizer.Push(Image(0.5));
  synchronizer.Push(Odometry(0.6));
  const auto packet = synchronizer.Pop();
  ASSERT_TRUE(packet.has_value());
  EXPECT_EQ(packet->image.stamp, Timestamp::FromSeconds(0.5));
  EXPECT_NEAR(packet->T_odom_base->translation.x(), 0.5, 1e-12) << "poses are of the stamp";
  EXPECT_NEAR(packet->T_base_exposed.translation.x(), -0.02, 1e-9);
  EXPECT_NEAR(packet->T_base_camera.translation.x(), 0.08, 1e-9);
  EXPECT_EQ(packet->image_offset.value, -0.02);
}

TEST(Synchronizer, ImageTakenAfterItsStampWaitsForOdometryOfThen) {
  Synchronizer synchronizer(true);
  synchronizer.SetImageOffset({0.05, 0.001});
  synchronizer.Push(Odometry(0.0));
  synchronizer.Push(Image(0.5));
  synchronizer.Push(Odometry(0.52));
  EXPECT_FALSE(synchronizer.Pop().has_value());
  synchronizer.Push(Odometry(0.56));
  const auto packet = synchronizer.Pop();
  ASSERT_TRUE(packet.has_value());
  EXPECT_NEAR(packet->T_base_camera.translation.x(), 0.15, 1e-9);
}

TEST(Synchronizer, ImageWaitsUntilOdometryCoversIt) {
  Synchronizer synchronizer(true);
  synchronizer.Push(Odometry(0.0));
  synchronizer.Push(Image(0.5));
  EXPECT_FALSE(synchronizer.Pop().has_value());
  synchronizer.Push(Odometry(0.4));
  EXPECT_FALSE(synchronizer.Pop().has_value()) << "odometry is never extrapolated";
  synchronizer.Push(Odometry(0.6));
  const auto packet = synchronizer.Pop();
  ASSERT_TRUE(packet.has_value());
  EXPECT_EQ(packet->image.stamp, Timestamp::FromSeconds(0.5));
  ASSERT_TRUE(packet->T_odom_base.has_value());
  EXPECT_NEAR(packet->T_odom_base->translation.x(), 0.5, 1e-12);
  EXPECT_NEAR(packet->T_base_camera.translation.z(), 0.5, 1e-12);
  EXPECT_FALSE(synchronizer.Pop().has_value());
}

TEST(Synchronizer, OdometryOfPacketsJoinsUpWithoutGaps) {
  Synchronizer synchronizer(true);
  for (int i = 0; i <= 20; ++i) synchronizer.Push(Odometry(0.1 * i));
  for (const double t : {0.05, 0.72, 1.33, 1.9}) synchronizer.Push(Image(t));
  auto previous = synchronizer.Pop();
  ASSERT_TRUE(previous.has_value());
  EXPECT_TRUE(previous->odometry.empty()) << "there is no packet before the first";
  int packets = 1;
  while (auto packet = synchronizer.Pop()) {
    ++packets;
    ASSERT_GE(packet->odometry.size(), 2U);
    EXPECT_EQ(packet->odometry.front().stamp, previous->image.stamp);
    EXPECT_EQ(packet->odometry.back().stamp, packet->image.stamp);
    for (const OdometryReading& reading : packet->odometry) {
      EXPECT_NEAR(reading.T_odom_base.translation.x(), reading.stamp.Seconds(), 1e-9);
    }
    for (std::size_t i = 1; i < packet->odometry.size(); ++i)
      EXPECT_LT(packet->odometry[i - 1].stamp, packet->odometry[i].stamp);
    previous = packet;
  }
  EXPECT_EQ(packets, 4);
  EXPECT_TRUE(synchronizer.dropped().empty());
}

TEST(Synchronizer, DropsAndCountsImagesBeforeTheFirstOdometry) {
  Synchronizer synchronizer(true);
  for (const double t : {0.1, 0.2, 1.0}) synchronizer.Push(Image(t));
  synchronizer.Push(Odometry(0.9));
  synchronizer.Push(Odometry(1.1));
  const auto packet = synchronizer.Pop();
  ASSERT_TRUE(packet.has_value());
  EXPECT_EQ(packet->image.stamp, Timestamp::FromSeconds(1.0));
  EXPECT_EQ(synchronizer.dropped().at("image before the first odometry"), 2);
}

TEST(Synchronizer, CountsStampsThatDoNotIncrease) {
  Synchronizer synchronizer(true);
  synchronizer.Push(Odometry(0.0));
  synchronizer.Push(Odometry(1.0));
  synchronizer.Push(Odometry(1.0));
  synchronizer.Push(Odometry(0.5));
  synchronizer.Push(Image(0.6));
  synchronizer.Push(Image(0.6));
  synchronizer.Push(Image(0.3));
  EXPECT_EQ(synchronizer.dropped().at("odometry stamp not increasing"), 2);
  EXPECT_EQ(synchronizer.dropped().at("image stamp not increasing"), 2);
  EXPECT_EQ(synchronizer.Pop()->image.stamp, Timestamp::FromSeconds(0.6));
  EXPECT_FALSE(synchronizer.Pop().has_value());
}

TEST(Synchronizer, CountsOdometryThatIsNotFinite) {
  Synchronizer synchronizer(true);
  synchronizer.Push(OdometryReading{Timestamp{1}, Rigid2(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0)});
  EXPECT_EQ(synchronizer.dropped().at("odometry not finite"), 1);
}

TEST(Synchronizer, ScansArePosedRelativeToTheFrame) {
  Synchronizer synchronizer(true);
  for (int i = 0; i <= 30; ++i) synchronizer.Push(Odometry(0.1 * i));
  synchronizer.Push(Image(1.0));
  for (const double t : {1.25, 1.75, 2.5}) synchronizer.Push(Scan(t));
  synchronizer.Push(Image(2.0));
  synchronizer.Push(Image(3.0));
  EXPECT_TRUE(synchronizer.Pop()->scans.empty());
  const auto second = synchronizer.Pop(), third = synchronizer.Pop();
  ASSERT_EQ(second->scans.size(), 2U);
  ASSERT_EQ(third->scans.size(), 1U);
  EXPECT_NEAR(second->scans[0].T_frame_base.translation.x(), -0.75, 1e-9) << "the base was 0.75 m behind the frame's";
  EXPECT_NEAR(second->scans[1].T_frame_base.translation.x(), -0.25, 1e-9);
  EXPECT_NEAR(third->scans[0].T_frame_base.translation.x(), -0.5, 1e-9);
  EXPECT_NEAR(second->scans[0].T_base_laser.translation.x(), 0.3, 1e-12);
}

TEST(Synchronizer, PlacesAScanThatArrivesAfterANewerImageHasPassed) {
  Synchronizer synchronizer(true);
  for (int i = 0; i <= 10; ++i) synchronizer.Push(Odometry(0.1 * i));
  synchronizer.Push(Image(0.5));
  ASSERT_TRUE(synchronizer.Pop().has_value());
  synchronizer.Push(Scan(0.35));
  synchronizer.Push(Image(0.9));
  const auto packet = synchronizer.Pop();
  ASSERT_EQ(packet->scans.size(), 1U);
  EXPECT_NEAR(packet->scans[0].T_frame_base.translation.x(), -0.55, 1e-9);
  EXPECT_TRUE(synchronizer.dropped().empty());
}

TEST(Synchronizer, CountsScansOdometryDoesNotCover) {
  Synchronizer synchronizer(true);
  synchronizer.Push(Scan(0.2));
  for (const double t : {1.0, 2.0}) synchronizer.Push(Odometry(t));
  synchronizer.Push(Image(1.5));
  EXPECT_TRUE(synchronizer.Pop()->scans.empty());
  EXPECT_EQ(synchronizer.dropped().at("scan not covered by odometry"), 1);
}

TEST(Synchronizer, AfterFinishImagesPassWithoutOdometry) {
  Synchronizer synchronizer(true);
  for (const double t : {0.0, 1.0}) synchronizer.Push(Odometry(t));
  for (const double t : {0.5, 1.5, 2.0}) synchronizer.Push(Image(t));
  EXPECT_TRUE(synchronizer.Pop().has_value());
  EXPECT_FALSE(synchronizer.Pop().has_value());
  synchronizer.Finish();
  for (const double t : {1.5, 2.0}) {
    const auto packet = synchronizer.Pop();
    ASSERT_TRUE(packet.has_value());
    EXPECT_EQ(packet->image.stamp, Timestamp::FromSeconds(t));
    EXPECT_FALSE(packet->T_odom_base.has_value());
    EXPECT_TRUE(packet->odometry.empty());
  }
  EXPECT_TRUE(synchronizer.dropped().empty());
}

TEST(Synchronizer, AfterFinishTheFirstImageMayLieBeyondAllOdometry) {
  Synchronizer synchronizer(true);
  for (const double t : {0.0, 1.0}) synchronizer.Push(Odometry(t));
  synchronizer.Push(Image(1.5));
  synchronizer.Finish();
  EXPECT_TRUE(synchronizer.Pop().has_value());
  EXPECT_EQ(synchronizer.dropped().count("image before the first odometry"), 0U);
}

TEST(Synchronizer, WithoutOdometryImagesPassAtOnceAndScansAreIgnored) {
  Synchronizer synchronizer(false);
  synchronizer.Push(Scan(0.1));
  synchronizer.Push(Image(0.2));
  const auto packet = synchronizer.Pop();
  ASSERT_TRUE(packet.has_value());
  EXPECT_TRUE(packet->scans.empty());
  EXPECT_FALSE(packet->T_odom_base.has_value());
  EXPECT_FALSE(synchronizer.Pop().has_value());
}

}  // namespace
}  // namespace planar_vslam
