#pragma once
// A drive to find nothing wrong with, to be spoilt by each test.
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "planar_vslam/pipeline/findings.h"

namespace planar_vslam {

constexpr double kPeriod = 0.1;  // s between images
constexpr int kKeyframes = 40;

// A camera that looks forward: z along x of the base.
inline Rigid3 ForwardCamera() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {Eigen::Quaterniond(R), Eigen::Vector3d(0.1, 0.0, 1.0)};
}

// A camera with the axes of a body: x forward, z up.
inline Rigid3 BodyCamera() { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0.0, 1.0)}; }

inline CameraFrame Image(double t, std::uint8_t grey, const Rigid3& T_base_camera) {
  CameraFrame frame;
  frame.image.stamp = Timestamp::FromSeconds(t);
  frame.image.image = {64, 48, std::make_shared<const std::vector<std::uint8_t>>(64 * 48, grey)};
  frame.T_base_camera = T_base_camera;
  return frame;
}

// Keyframes along a curve, and wheels whose steps are `read` of the true ones.
inline Map Drive(const std::function<Rigid2(const Rigid2&)>& read) {
  Map map;
  map.metric = true;
  std::mt19937 generator(1);
  std::normal_distribution<double> noise(0.0, 0.002);
  Rigid2 T_map_base;
  for (std::uint32_t k = 0; k < kKeyframes; ++k) {
    Keyframe keyframe;
    const Rigid2 step = ExpSe2(Eigen::Vector3d(0.15, 0.01, k % 20 < 10 ? 0.15 : -0.1));
    if (k > 0) {
      T_map_base = T_map_base * step;
      MotionLink link;
      link.from = KeyframeId{k - 1};
      link.motion.T_i_j = read(step) * Rigid2(noise(generator), noise(generator), noise(generator));
      keyframe.odometry_link = link;
    }
    keyframe.T_map_base = Embed3(T_map_base);
    map.keyframes.Insert(KeyframeId{k}, keyframe);
  }
  return map;
}

inline Rigid2 AsItWas(const Rigid2& step) { return step; }

class FindingsTest : public ::testing::Test {
 protected:
  FindingsTest() : map_(Drive(AsItWas)) {
    report_.odometry_by_model = 200;
    report_.keyframes_made = static_cast<long>(map_.keyframes.size());
  }

  void Watch(int images, const std::function<bool(int)>& arrives, std::uint8_t grey = 110,
             const Rigid3& T_base_camera = ForwardCamera(), double speed = 0.5) {
    for (int i = 0; i < images; ++i) {
      const double t = kPeriod * i;
      watch_.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(speed * t, 0.0, 0.0)});
      if (arrives(i)) watch_.Add(Image(t, grey, T_base_camera));
    }
  }
  void WatchSweeps() {
    for (int i = 0; i < 200; ++i) {
      LaserFrame frame;
      frame.scan.stamp = Timestamp::FromSeconds(kPeriod * i);
      watch_.Add(frame);
    }
  }
  std::vector<std::string> Found() const {
    FindingsInput input{report_, watch_, with_map_ ? &map_ : nullptr, unused_, notes_, true, has_laser_};
    return Findings(input);
  }
  void ExpectOne(const std::vector<std::string>& parts) const {
    const std::vector<std::string> found = Found();
    ASSERT_EQ(found.size(), 1U) << (found.empty() ? "nothing" : found[1 % found.size()]);
    for (const std::string& part : parts) EXPECT_NE(found[0].find(part), std::string::npos) << part << ": " << found[0];
  }

  static bool Always(int) { return true; }

  EstimatorReport report_;
  InputWatch watch_;
  Map map_;
  bool with_map_ = true, has_laser_ = false;
  std::map<std::string, long> unused_;
  std::vector<std::string> notes_;
};

}  // namespace planar_vslam
