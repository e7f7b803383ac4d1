// Conversions and the input queue, without a running ROS.
#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <cstring>
#include <random>
#include <thread>

#include "converters.h"
#include "input_queue.h"
#include "support/support.h"

namespace planar_vslam::ros_face {
namespace {

// A small body-axes perturbation moves the pose by the same amount along map axes as the turned covariance says.
TEST(Converters, CovarianceTurnsWithThePose) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 20; ++round) {
    const Rigid3 T = test::RandomRigid3(generator, 10.0);
    Vector6d xi;
    for (double& value : xi) value = 1e-6 * normal(generator);
    const Rigid3 moved = T * ExpSe3(xi);
    Vector6d in_map;
    in_map << moved.translation - T.translation, LogSo3(moved.rotation * T.rotation.conjugate());
    const Matrix6d expected = in_map * in_map.transpose();
    EXPECT_TRUE(CovarianceInMapAxes(T, xi * xi.transpose()).isApprox(expected, 1e-4));
  }
}

TEST(Converters, PosesSurviveThereAndBack) {
  std::mt19937 generator(8);
  const Rigid3 T = test::RandomRigid3(generator, 5.0);
  EXPECT_LT(LogSe3(ToRigid3(ToPose(T)).Inverse() * T).norm(), 1e-12);
  const Timestamp stamp{1'700'000'000'123'456'789};
  EXPECT_EQ(ToTimestamp(ToRosTime(stamp)), stamp);
}

TEST(Converters, CloudHoldsEveryField) {
  const CloudPoint point{{1.0F, 2.0F, 3.0F}, {0.0F, 0.0F, 1.0F}, 7.0F};
  const sensor_msgs::PointCloud2 cloud = ToPointCloud(MakeHeader({1}, "map"), {point, point});
  ASSERT_EQ(cloud.fields.size(), 7U);
  EXPECT_EQ(cloud.data.size(), 2U * cloud.point_step);
  float intensity = 0.0F;
  std::memcpy(&intensity, cloud.data.data() + cloud.point_step + cloud.fields.back().offset, sizeof(float));
  EXPECT_EQ(intensity, 7.0F);
}

Input Image(std::uint32_t number) {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.seq = number;
  return sensor_msgs::ImageConstPtr(image);
}
std::uint32_t NumberOf(const std::optional<Input>& input) {
  return std::get<sensor_msgs::ImageConstPtr>(*input)->header.seq;
}

TEST(InputQueue, DropsTheOldestImagesAndNothingElse) {
  InputQueue queue(2, false);
  queue.Push(boost::make_shared<const nav_msgs::Odometry>());
  for (std::uint32_t i = 0; i < 5; ++i) queue.Push(Image(i));
  EXPECT_TRUE(std::holds_alternative<nav_msgs::OdometryConstPtr>(*queue.Pop()));
  EXPECT_EQ(NumberOf(queue.Pop()), 3U);
  EXPECT_EQ(NumberOf(queue.Pop()), 4U);
  EXPECT_EQ(queue.dropped(), (std::map<std::string, long>{{"images", 3}}));
}

TEST(InputQueue, LosslessDropsNothing) {
  InputQueue queue(2, true);
  for (std::uint32_t i = 0; i < 50; ++i) queue.Push(Image(i));
  for (std::uint32_t i = 0; i < 50; ++i) EXPECT_EQ(NumberOf(queue.Pop()), i);
  EXPECT_TRUE(queue.dropped().empty());
}

TEST(InputQueue, KeepsStaticTransforms) {
  InputQueue queue(1, false);
  queue.Push(TfInput{boost::make_shared<const tf2_msgs::TFMessage>(), true});
  for (int i = 0; i < 5000; ++i) queue.Push(TfInput{boost::make_shared<const tf2_msgs::TFMessage>(), false});
  EXPECT_TRUE(std::get<TfInput>(*queue.Pop()).is_static);
  EXPECT_GT(queue.dropped()["tf"], 0);
}

TEST(InputQueue, CommandsGoFirst) {
  InputQueue queue(2, false);
  queue.Push(Image(1));
  queue.Push(Command([] {}));
  EXPECT_TRUE(std::holds_alternative<Command>(*queue.Pop()));
  EXPECT_EQ(NumberOf(queue.Pop()), 1U);
}

TEST(InputQueue, ClosingWakesWhoWaits) {
  InputQueue queue(2, false);
  std::optional<Input> popped = Image(1);
  std::thread waiting([&] { popped = queue.Pop(); });
  queue.Close();
  waiting.join();
  EXPECT_FALSE(popped.has_value());
}

}  // namespace
}  // namespace planar_vslam::ros_face
