// Bags as people's robots record them: what is right about them is used, what is wrong is counted and said.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

class RobotBags : public BagFixture {
 protected:
  // A bag of a robot's camera and its mount, plus whatever `more` adds.
  template <class Add>
  Replay PlayRobot(const Add& more, const RecordingOptions& options = {}) const {
    return Play(Bag([&more](BagWriter& writer) {
                  writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
                  more(writer);
                }),
                options);
  }
};

bool HasNote(const Replay& replay, const std::string& part) {
  for (const std::string& note : replay.info.notes) {
    if (note.find(part) != std::string::npos) return true;
  }
  return false;
}

TEST_P(RobotBags, NeitherOrderNorLatenessOfRecordingCounts) {
  const Replay live = Play(RobotBag());
  // A converter writes one topic after the other; images come 5 s late; a shuffled stream.
  const std::function<double(int, double)> delays[] = {
      [](int stream, double) { return 100.0 * stream; }, [](int stream, double) { return -100.0 * stream; },
      [](int stream, double) { return stream == 2 ? 5.0 : 0.0; }, [](int, double t) { return -2.0 * t; }};
  for (const auto& delay : delays) {
    const Replay replay = Play(Bag([&delay](BagWriter& writer) {
      writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
      writer.PutStatic("base_footprint", "laser_frame", Shift(0, 0, 0.25));
      const double start = 300.0;
      for (int i = 1; i <= 50; ++i)
        writer.PutOdometry(0.02 * i, 0.01 * i, "base_footprint", start + delay(0, 0.02 * i));
      for (int i = 1; i <= 5; ++i) writer.PutScan(0.2 * i, start + delay(1, 0.2 * i));
      for (int i = 1; i <= 10; ++i) {
        writer.PutImage(0.1 * i, RawImage(RampImage(), "mono8"), start + delay(2, 0.1 * i));
      }
    }));
    EXPECT_EQ(replay.order, live.order) << replay.error;
    EXPECT_EQ(replay.stamps, live.stamps);
    EXPECT_EQ(replay.info.first_image, live.info.first_image);
    EXPECT_EQ(replay.info.last_image, live.info.last_image);
    EXPECT_TRUE(replay.skipped.empty());
  }
}

TEST_P(RobotBags, StampsThatGoBackAreSaid) {
  const Replay replay = PlayRobot([](BagWriter& writer) {
    for (int i = 0; i < 10; ++i) writer.PutOdometry(10.0 + 0.02 * i, 0.0);
    for (int i = 0; i < 10; ++i) writer.PutOdometry(5.0 + 0.02 * i, 0.0, "base_footprint", 20.0);
    writer.PutImage(5.1);
  });
  EXPECT_TRUE(HasNote(replay, "/odom: stamps go back by 5.2 s"));
}

TEST_P(RobotBags, AClockThatWasSetBackIsSaid) {
  const Replay replay = PlayRobot([](BagWriter& writer) {
    for (const double x : {0.0, 1.0}) {  // the same seconds twice, at two places
      for (int i = 1; i <= 50; ++i) writer.PutOdometry(0.02 * i, x + 0.01 * i);
      for (int i = 1; i <= 10; ++i) writer.PutImage(0.1 * i);
    }
  });
  EXPECT_EQ(replay.images.size(), 10U) << replay.error;
  EXPECT_TRUE(HasNote(replay, "the clock was set back"));
}

TEST_P(RobotBags, OdometryWithoutStampsIsLeftToTf) {
  const Replay replay = PlayRobot([](BagWriter& writer) {
    for (int i = 1; i <= 10; ++i) {
      nav_msgs::Odometry odometry;
      odometry.child_frame_id = "base_footprint";
      writer.Put("/odom", odometry, 0.02 * i);
      writer.PutTf("odom", "base_footprint", 0.02 * i, Shift(0.5 * i, 0, 0));
    }
    writer.PutImage(0.1);
  });
  EXPECT_EQ(replay.odometry.size(), 10U) << replay.error;
  EXPECT_TRUE(HasNote(replay, "/odom: no message with a stamp"));
}

TEST_P(RobotBags, TfIsSortedByItsStampsToo) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutTf("base_footprint", "camera_optical_frame", 0.3, Shift(0, 0, 1.2));
    writer.PutTf("base_footprint", "camera_optical_frame", 0.1, Shift(0, 0, 1.0), 5.0);
    writer.PutImage(0.2);
  }));
  ASSERT_EQ(replay.images.size(), 1U) << replay.error;
  EXPECT_NEAR(replay.images[0].T_base_camera.translation.z(), 1.1, 1e-9);
}

TEST_P(RobotBags, AMountOnTfHoldsAlsoWhereItWasSentOnce) {
  for (const int samples : {1, 2}) {
    const Replay replay = Play(Bag([samples](BagWriter& writer) {
      for (int i = 0; i < samples; ++i) {
        writer.PutTf("base_footprint", "camera_optical_frame", 0.1 + 0.1 * i, Shift(0, 0, 1.2));
      }
      for (const double t : {0.05, 0.15, 0.9}) writer.PutImage(t);
    }));
    EXPECT_EQ(replay.images.size(), 3U) << replay.error;
    EXPECT_EQ(HasNote(replay, "'camera_optical_frame' came once"), samples == 1);
  }
}

// tf_prefix, as robots of a fleet have it: what the options call base_footprint is robot1/base_footprint.
TEST_P(RobotBags, FramesWithAPrefixAreFound) {
  const auto drive = [this](const char* second) {
    return Play(Bag([second](BagWriter& writer) {
      writer.PutStatic("robot1/base_footprint", "robot1/camera_optical_frame", Shift(0, 0, 1.2));
      if (second != nullptr) writer.PutStatic("robot1/base_footprint", second, Shift(0, 0, 0));
      for (int i = 0; i < 5; ++i) {
        writer.PutTf("robot1/odom", "robot1/base_footprint", 0.1 * i, Shift(0.5 * i, 0, 0));
        writer.PutImage(0.1 * i);
      }
    }));
  };
  const Replay replay = drive(nullptr);
  EXPECT_EQ(replay.error, "");
  EXPECT_EQ(replay.images.size(), 5U);
  EXPECT_EQ(replay.odometry.size(), 5U);
  EXPECT_TRUE(HasNote(replay, "'base_footprint' is called 'robot1/base_footprint'"));
  ExpectInError(drive("robot2/base_footprint").error, {"'base_footprint'", "robot1/base_footprint"});
}

nav_msgs::Odometry WithOrientation(double z, double w) {
  nav_msgs::Odometry odometry;
  odometry.pose.pose.orientation.z = z;
  odometry.pose.pose.orientation.w = w;
  return odometry;
}

TEST_P(RobotBags, WhatIsNoRotationIsNoHeading) {
  const double angle = 0.4;
  const double z = std::sin(angle / 2.0), w = std::cos(angle / 2.0);
  const auto drive = [&](double qz, double qw, bool with_tf) {
    return PlayRobot([&](BagWriter& writer) {
      for (int i = 1; i <= 10; ++i) {
        writer.PutOdometryAsIs(0.02 * i, 0.01 * i, WithOrientation(qz, qw));
        if (with_tf) writer.PutTf("odom", "base_footprint", 0.02 * i, Shift(0.5 * i, 0, 0));
      }
      writer.PutImage(0.1);
    });
  };
  const Replay drifted = drive(1.0015 * z, 1.0015 * w, false);
  ASSERT_EQ(drifted.odometry.size(), 10U) << drifted.error;
  EXPECT_NEAR(drifted.odometry[3].T_odom_base.angle, angle, 1e-9);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [qz, qw] : {std::pair(z, 0.0), {1.5 * z, 1.5 * w}, {0.0, 0.0}, {nan, w}}) {
    const Replay alone = drive(qz, qw, false);
    EXPECT_TRUE(alone.odometry.empty() && alone.error.empty());
    EXPECT_FALSE(alone.info.has_odometry);
    long counted = 0;
    for (const auto& [reason, count] : alone.skipped) counted += count;
    EXPECT_EQ(counted, 10);
    const Replay with_tf = drive(qz, qw, true);
    ASSERT_EQ(with_tf.odometry.size(), 10U) << "of tf, which is right";
    EXPECT_NEAR(with_tf.odometry[9].T_odom_base.translation.x(), 5.0, 1e-9);
    EXPECT_TRUE(HasNote(with_tf, "/odom"));
  }
  EXPECT_TRUE(HasNote(drive(1.5 * z, 1.5 * w, true), "has length 1.50 instead of 1"));
  EXPECT_TRUE(HasNote(drive(z, 0.0, true), "has length 0.20 instead of 1"));
  EXPECT_TRUE(HasNote(drive(nan, w, true), "most poses cannot be used"));
}

TEST_P(RobotBags, SingleBadPosesAreSkipped) {
  const Replay replay = PlayRobot([](BagWriter& writer) {
    for (int i = 1; i <= 10; ++i) writer.PutOdometryAsIs(0.02 * i, 0.01 * i, WithOrientation(0.0, i == 4 ? 0.3 : 1.0));
    writer.PutImage(0.1);
  });
  EXPECT_EQ(replay.odometry.size(), 9U) << replay.error;
  const std::map<std::string, long> expected{{"odometry orientation is no unit quaternion", 1}};
  EXPECT_EQ(replay.skipped, expected);
}

TEST_P(RobotBags, ATwistWithoutPosesIsIntegrated) {
  for (const double w : {1.0, 0.0}) {
    const Replay replay = PlayRobot([w](BagWriter& writer) {
      for (int i = 0; i <= 50; ++i) {
        nav_msgs::Odometry odometry = WithOrientation(0.0, w);
        odometry.twist.twist.linear.x = 0.5;
        odometry.twist.twist.angular.z = 0.3;
        writer.PutOdometryAsIs(0.02 * i, 0.0, odometry);
      }
      writer.PutImage(0.1);
    });
    ASSERT_EQ(replay.odometry.size(), 51U) << replay.error;
    EXPECT_TRUE(HasNote(replay, "never changes"));
    const Rigid2 expected = ExpSe2(Eigen::Vector3d(0.5, 0.0, 0.3));
    EXPECT_LT((replay.odometry[50].T_odom_base.translation - expected.translation).norm(), 1e-6);
    EXPECT_NEAR(replay.odometry[50].T_odom_base.angle, expected.angle, 1e-6);
  }
}

TEST_P(RobotBags, ARobotThatStandsIsNoTwistWithoutPoses) {
  const Replay replay = PlayRobot([](BagWriter& writer) {
    for (int i = 0; i <= 50; ++i) writer.PutOdometry(0.02 * i, 7.0);
    writer.PutImage(0.1);
  });
  ASSERT_EQ(replay.odometry.size(), 51U) << replay.error;
  EXPECT_TRUE(replay.info.notes.empty());
  EXPECT_EQ(replay.odometry[50].T_odom_base.translation.x(), 7.0);
}

TEST_P(RobotBags, ConstantCovariancesAreCountedAndNotBelieved) {
  const auto drive = [&](double variance) {
    return PlayRobot([variance](BagWriter& writer) {
      for (int i = 1; i <= 50; ++i) {
        nav_msgs::Odometry odometry;
        for (const std::size_t k : {0U, 7U, 14U, 21U, 28U, 35U}) {
          odometry.pose.covariance[k] = odometry.twist.covariance[k] = variance;
        }
        writer.PutOdometry(0.02 * i, 0.01 * i, "base_footprint", 0.004, odometry);
      }
      writer.PutImage(0.1);
    });
  };
  for (const double variance : {0.1, 1e-3, 0.0, 1e6}) {
    const Replay replay = drive(variance);
    ASSERT_EQ(replay.odometry.size(), 50U) << replay.error;
    for (const OdometryReading& reading : replay.odometry) EXPECT_FALSE(reading.covariance_rate.has_value());
    EXPECT_EQ(replay.skipped.count("odometry covariance that is a placeholder"), variance > 0.0 && variance < 1.0);
  }
}

class Scans : public RobotBags {
 protected:
  Replay PlayScan(const std::function<void(sensor_msgs::LaserScan*)>& change) const {
    return PlayRobot([&change](BagWriter& writer) {
      writer.PutStatic("base_footprint", "laser_frame", Shift(0, 0, 0.25));
      sensor_msgs::LaserScan scan;
      scan.header.stamp = At(0.1);
      scan.header.frame_id = "laser_frame";
      scan.angle_min = -1.0F;
      scan.angle_max = 1.0F;
      scan.angle_increment = 0.5F;
      scan.range_max = 8.0F;
      scan.ranges = {1.0F, 2.0F, 3.0F, std::numeric_limits<float>::infinity(), 0.0F};
      change(&scan);
      writer.Put("/scan", scan, 0.1);
      writer.PutImage(0.2);
    });
  }
};

TEST_P(Scans, ARangeThatIsNotStatedIsUnlimited) {
  for (const float range_max :
       {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    const Replay replay = PlayScan([range_max](sensor_msgs::LaserScan* scan) { scan->range_max = range_max; });
    ASSERT_EQ(replay.scans.size(), 1U) << replay.error;
    const PlanarScan& scan = replay.scans[0].scan;
    EXPECT_TRUE(std::isfinite(scan.range_max) && scan.range_max > 100.0);
    EXPECT_EQ(scan.ranges[2], 3.0F);
    EXPECT_TRUE(std::isnan(scan.ranges[3])) << "without a range, no return clears nothing";
    EXPECT_TRUE(HasNote(replay, "range_max"));
  }
  const Replay stated = PlayScan([](sensor_msgs::LaserScan*) {});
  EXPECT_TRUE(std::isinf(stated.scans[0].scan.ranges[3]));
  EXPECT_TRUE(std::isnan(stated.scans[0].scan.ranges[4])) << "zero measures nothing";
  EXPECT_TRUE(stated.info.notes.empty());
}

TEST_P(Scans, AnIncrementThatIsNotStatedFollowsFromTheEnds) {
  const Replay replay = PlayScan([](sensor_msgs::LaserScan* scan) { scan->angle_increment = 0.0F; });
  ASSERT_EQ(replay.scans.size(), 1U) << replay.error;
  EXPECT_NEAR(replay.scans[0].scan.angle_increment, 0.5, 1e-6);
}

TEST_P(Scans, DirectionsThatMakeNoSenseAreCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::function<void(sensor_msgs::LaserScan*)> faults[] = {
      [](sensor_msgs::LaserScan* scan) { scan->ranges.clear(); },
      [nan](sensor_msgs::LaserScan* scan) { scan->angle_min = nan; },
      [nan](sensor_msgs::LaserScan* scan) { scan->angle_increment = nan; },
      [](sensor_msgs::LaserScan* scan) { scan->angle_min = -135.0F; },
      [](sensor_msgs::LaserScan* scan) { scan->angle_increment = 2.0F; },
      [](sensor_msgs::LaserScan* scan) { scan->angle_increment = scan->angle_max = scan->angle_min = 0.0F; }};
  for (const auto& fault : faults) {
    const Replay replay = PlayScan(fault);
    EXPECT_TRUE(replay.scans.empty() && replay.error.empty());
    ASSERT_EQ(replay.skipped.size(), 1U);
    EXPECT_EQ(replay.skipped.begin()->first.rfind("scan ", 0), 0U) << replay.skipped.begin()->first;
  }
}

TEST_P(Scans, AnglesThatContradictEachOtherAreCounted) {
  const std::function<void(sensor_msgs::LaserScan*)> faults[] = {
      [](sensor_msgs::LaserScan* scan) { scan->angle_increment = -0.5F; },
      [](sensor_msgs::LaserScan* scan) { scan->angle_min = 0.0F; },
      [](sensor_msgs::LaserScan* scan) { scan->ranges.resize(3); }};
  for (const auto& fault : faults) {
    const Replay replay = PlayScan(fault);
    EXPECT_TRUE(replay.scans.empty() && replay.error.empty());
    const std::map<std::string, long> expected{{"scan whose angle_max contradicts angle_min and angle_increment", 1}};
    EXPECT_EQ(replay.skipped, expected);
  }
  const std::function<void(sensor_msgs::LaserScan*)> fine[] = {
      [](sensor_msgs::LaserScan* scan) { scan->angle_max = 0.0F; },
      [](sensor_msgs::LaserScan* scan) { scan->angle_max = 1.1F; },
      [](sensor_msgs::LaserScan* scan) {
        std::swap(scan->angle_min, scan->angle_max);
        scan->angle_increment = -0.5F;
      }};
  for (const auto& change : fine) EXPECT_EQ(PlayScan(change).scans.size(), 1U);
}

TEST_P(Scans, ALeastRangeBeyondTheLargestIsNone) {
  const Replay replay = PlayScan([](sensor_msgs::LaserScan* scan) { scan->range_min = 50.0F; });
  ASSERT_EQ(replay.scans.size(), 1U) << replay.error;
  EXPECT_EQ(replay.scans[0].scan.range_min, 0.0);
  EXPECT_EQ(replay.scans[0].scan.range_max, 8.0);
  EXPECT_TRUE(HasNote(replay, "range_min is 50"));
}

TEST_P(Scans, WithoutAFrameTheirMountIsNotGuessed) {
  const Replay replay = PlayScan([](sensor_msgs::LaserScan* scan) { scan->header.frame_id = ""; });
  ExpectInError(replay.error, {"/scan", "frame_id", "empty"});
}

TEST_P(RobotBags, GreysOfFewBitsFillTheRange) {
  for (const int bits : {8, 10, 12, 16}) {
    for (const char* encoding : {"mono16", "16UC1"}) {
      cv::Mat wide;
      RampImage().convertTo(wide, CV_16UC1, 2.0 * static_cast<double>(1 << (bits - 8)));
      const Replay replay = PlayRobot([&](BagWriter& writer) { writer.PutImage(0.1, RawImage(wide, encoding)); });
      ASSERT_EQ(replay.images.size(), 1U) << replay.error;
      EXPECT_EQ((*replay.images[0].image.image.pixels)[7], 2 * 28) << bits;
    }
  }
}

TEST_P(RobotBags, RectifiedImagesAreKnownByTheirTopicOrBySetting) {
  const auto focal_length = [this](const std::string& topic, RectifiedImages said) {
    RecordingOptions options;
    options.bag.rectified = said;
    options.bag.camera_info_topic = "/camera/camera_info";
    const Replay replay = PlayRobot(
        [&topic](BagWriter& writer) {
          sensor_msgs::Image image = RawImage(RampImage(), "mono8");
          image.header.stamp = At(0.1);
          writer.Put(topic, image, 0.1);
        },
        options);
    EXPECT_EQ(replay.error, "");
    EXPECT_EQ(replay.info.camera.distorted(), replay.info.camera.fx == Info().K[0]);
    return replay.info.camera.fx;
  };
  const double raw = Info().K[0], rectified = Info().P[0];
  for (const char* topic : {"/camera/image_rect", "/camera/image_rect_color", "/qhd/image_color_rect", "/a/rect",
                            "/left/image_rectified"}) {
    EXPECT_EQ(focal_length(topic, RectifiedImages::kAuto), rectified) << topic;
    EXPECT_EQ(focal_length(topic, RectifiedImages::kNo), raw) << topic;
  }
  for (const char* topic : {"/camera/image_raw", "/rect/image", "/camera/direct"}) {
    EXPECT_EQ(focal_length(topic, RectifiedImages::kAuto), raw) << topic;
    EXPECT_EQ(focal_length(topic, RectifiedImages::kYes), rectified) << topic;
  }
}

PV_WITH_EVERY_KIND_OF_BAG(RobotBags);
PV_WITH_EVERY_KIND_OF_BAG(Scans);

}  // namespace
}  // namespace planar_vslam::test
