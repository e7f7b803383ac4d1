// A camera that turns left and right before a wall of points, its rows taken one after the other.
#include "planar_vslam/pipeline/image_timing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace planar_vslam {
namespace {

constexpr double kInterval = 0.1;  // s between images
constexpr int kImages = 400;

class TurningCamera {
 public:
  explicit TurningCamera(double readout) : readout_(readout) {
    camera_.width = 640;
    camera_.height = 480;
    camera_.fx = camera_.fy = 500.0;
    camera_.cx = 320.0;
    camera_.cy = 240.0;
    map_.metric = true;
    map_.octave_scales = {1.0};
    std::uniform_real_distribution<double> angle(-M_PI, M_PI), height(-1.0, 2.0), distance(2.0, 6.0);
    for (std::uint32_t i = 0; i < 3000; ++i) {
      Landmark landmark;
      const double a = angle(generator_), d = distance(generator_);
      landmark.p_map = {d * std::cos(a), d * std::sin(a), height(generator_)};
      landmark.observations = {{KeyframeId{0}, i}};
      map_.landmarks.Insert(LandmarkId{i}, landmark);
    }
    Keyframe keyframe;  // taken at rest: what it saw stands where it is
    keyframe.stamp = Timestamp::FromSeconds(0.0);
    map_.keyframes.Insert(KeyframeId{0}, keyframe);
  }

  // rad/s: swings, now this way, now that.
  static double RateAt(double t) { return 0.8 * std::sin(0.7 * t) + 0.1; }

  FramePacket PacketAt(double t) const {
    FramePacket packet;
    packet.image.stamp = Timestamp::FromSeconds(t);
    packet.T_base_camera = T_base_camera_;
    for (double s = t - kInterval; s < t + 0.001; s += 0.02) {
      OdometryReading reading;
      reading.stamp = Timestamp::FromSeconds(s);
      reading.T_odom_base = Rigid2(0.0, 0.0, HeadingAt(s));
      packet.odometry.push_back(reading);
    }
    return packet;
  }

  // The features of the image, and a track that knows the pose and which landmark each keypoint shows.
  FrameFeatures See(double t, double shear, TrackResult* track) {
    FrameFeatures features;
    track->T_map_base = BaseAt(t);
    track->status = TrackingState::kTracking;
    std::normal_distribution<double> noise(0.0, 0.5);
    for (const auto& [id, landmark] : map_.landmarks) {
      Eigen::Vector3d p = (BaseAt(t) * T_base_camera_).Inverse() * landmark.p_map;
      if (p.z() < 0.5) continue;
      for (int i = 0; i < 3; ++i) {  // when its row is taken hangs on where it is seen
        const double row = camera_.ProjectUndistorted(p).y();
        const double dt = readout_ * (row / camera_.height - 0.5);
        p = (BaseAt(t + dt) * T_base_camera_).Inverse() * landmark.p_map;
      }
      Eigen::Vector2d pixel = camera_.ProjectUndistorted(p);
      pixel.x() += shear * (pixel.y() / camera_.height - 0.5);
      if (pixel.x() < 0.0 || pixel.x() > camera_.width || pixel.y() < 0.0 || pixel.y() > camera_.height) continue;
      Keypoint keypoint;
      keypoint.pixel = (pixel + Eigen::Vector2d(noise(generator_), noise(generator_))).cast<float>();
      keypoint.raw_pixel = keypoint.pixel;
      features.keypoints.push_back(keypoint);
      features.descriptors.emplace_back();
      track->matches.landmarks.push_back(id);
    }
    track->inliers = static_cast<int>(features.keypoints.size());
    return features;
  }

  // The readout that is known after a drive that began at rest.
  std::optional<Deviation> Readout(double shear = 0.0) {
    ImageTiming timing({}, camera_);
    FramePacket rest = PacketAt(0.0);
    for (OdometryReading& reading : rest.odometry) reading.T_odom_base = Rigid2();
    TrackResult first;
    first.wants_keyframe = true;
    for (int i = 0; i < 2; ++i) timing.Watch(rest, {}, first, map_);
    for (int i = 1; i <= kImages; ++i) {
      const double t = kInterval * i;
      const FramePacket packet = PacketAt(t);
      TrackResult track;
      const auto seen = std::make_shared<const FrameFeatures>(See(t, shear, &track));
      timing.Watch(packet, *seen, track, map_);
    }
    return timing.MissedReadout();
  }

  const CameraModel& camera() const { return camera_; }
  const Map& map() const { return map_; }

 private:
  static double HeadingAt(double t) { return -0.8 / 0.7 * std::cos(0.7 * t) + 0.1 * t; }
  static Rigid3 BaseAt(double t) { return Embed3(Rigid2(0.0, 0.0, HeadingAt(t))); }

  double readout_;
  CameraModel camera_;
  Map map_;
  std::mt19937 generator_{3};
  // Looking ahead, half a metre up, tilted down a little.
  const Rigid3 T_base_camera_ =
      Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(-M_PI / 2.0, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(-M_PI / 2.0 - 0.1, Eigen::Vector3d::UnitX())),
             Eigen::Vector3d(0.1, 0.0, 0.5));
};

TEST(ImageTiming, TellsHowLongTheRowsTake) {
  for (const double readout : {0.025, 0.0, -0.015}) {
    const std::optional<Deviation> told = TurningCamera(readout).Readout();
    ASSERT_TRUE(told.has_value());
    EXPECT_NEAR(told->value, readout, 0.001);
    EXPECT_LT(told->sigma, 0.001);
  }
}

TEST(ImageTiming, AnErrorOfTheLensIsNoShutter) {
  const std::optional<Deviation> told = TurningCamera(0.0).Readout(2.0);
  ASSERT_TRUE(told.has_value());
  EXPECT_NEAR(told->value, 0.0, 0.001);
}

TEST(ImageTiming, TellsNothingBeforeAnythingWasSeen) {
  EXPECT_FALSE(ImageTiming({}, TurningCamera(0.0).camera()).MissedReadout().has_value());
}

TEST(ImageTiming, StraightensWhatItIsTold) {
  TurningCamera camera(0.03);
  ImageTimingOptions options;
  options.readout = 0.03;
  const ImageTiming timing(options, camera.camera());
  const double t = 4.0;
  const FramePacket packet = camera.PacketAt(t);
  TrackResult track;
  const auto seen = std::make_shared<const FrameFeatures>(camera.See(t, 0.0, &track));
  const FrameFeaturesPtr straight = timing.Straightened(seen, packet);
  const Rigid3 T_camera_map = (track.T_map_base * packet.T_base_camera).Inverse();
  double before = 0.0, after = 0.0;
  for (std::size_t i = 0; i < seen->keypoints.size(); ++i) {
    const Eigen::Vector2d expected =
        camera.camera().ProjectUndistorted(T_camera_map * camera.map().landmarks.At(track.matches.landmarks[i]).p_map);
    before += (seen->keypoints[i].pixel.cast<double>() - expected).squaredNorm();
    after += (straight->keypoints[i].pixel.cast<double>() - expected).squaredNorm();
  }
  EXPECT_LT(std::sqrt(after / static_cast<double>(seen->keypoints.size())), 0.8);  // the noise alone: 0.71
  EXPECT_GT(before, 4.0 * after);
}

TEST(ImageTiming, LeavesFeaturesAloneWithoutAReadout) {
  TurningCamera camera(0.0);
  const ImageTiming timing({}, camera.camera());
  TrackResult track;
  const auto seen = std::make_shared<const FrameFeatures>(camera.See(4.0, 0.0, &track));
  EXPECT_EQ(timing.Straightened(seen, camera.PacketAt(4.0)), seen);
}

TEST(ImageTiming, ClocksThatDisagreeBlurAPoseAlongItsWay) {
  TurningCamera camera(0.0);
  ImageTimingOptions options;
  const ImageTiming timing(options, camera.camera());
  const double t = 4.0;
  FramePacket packet = camera.PacketAt(t);
  packet.image_offset.sigma = 0.02;
  const Eigen::Matrix3d covariance = timing.ClockCovariance(packet);
  EXPECT_NEAR(std::sqrt(covariance(2, 2)), 0.02 * std::abs(TurningCamera::RateAt(t)), 0.001);
  EXPECT_EQ(timing.ClockCovariance({}), Eigen::Matrix3d::Zero());
}

TEST(VelocityAt, IsAlongTheAxesOfTheBase) {
  FramePacket packet;
  for (int i = 0; i <= 5; ++i) {  // 0.5 m/s ahead and 0.2 to the left, looking along the odometry's y axis
    OdometryReading reading;
    reading.stamp = Timestamp::FromSeconds(0.02 * i);
    reading.T_odom_base = Rigid2(-0.2 * 0.02 * i, 0.5 * 0.02 * i, M_PI / 2.0);
    packet.odometry.push_back(reading);
  }
  EXPECT_LT((*VelocityAt(packet) - Eigen::Vector3d(0.5, 0.2, 0.0)).norm(), 1e-6);
}

TEST(VelocityAt, IsOfTheLastReadings) {
  TurningCamera camera(0.0);
  const std::optional<Eigen::Vector3d> velocity = VelocityAt(camera.PacketAt(4.0));
  ASSERT_TRUE(velocity.has_value());
  EXPECT_NEAR(velocity->z(), TurningCamera::RateAt(4.0), 0.02);
  EXPECT_FALSE(VelocityAt({}).has_value());
}

}  // namespace
}  // namespace planar_vslam
