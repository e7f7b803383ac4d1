#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planar_vslam/sim/sensors.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

// The camera at rest.
CameraShot ShotFrom(const Rigid3& T_world_camera, std::uint64_t noise_seed = 1) {
  CameraShot shot;
  shot.T_world_camera = T_world_camera;
  shot.noise_seed = noise_seed;
  return shot;
}

using test::BareRoom;

cv::Mat Copy(const GrayImage& image) {
  cv::Mat pixels(image.height, image.width, CV_8U);
  std::copy(image.pixels->begin(), image.pixels->end(), pixels.data);
  return pixels;
}

constexpr double kStandOff = 0.004;  // m, how far the first poster hangs off the wall

// Dark squares on the east wall, corner to corner like a chessboard's: y from 1.9 to 3.1, z from 0.9 to 1.5 m.
World RoomWithChessboard() {
  constexpr double kSide = 0.3;  // m
  World world = BareRoom();
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 4; ++column) {
      if ((row + column) % 2 != 0) continue;
      world.posters.push_back({Wall::kEast, 2.05 + kSide * column, 1.05 + kSide * row, {kSide, kSide}, {"plain", 40}});
    }
  }
  return world;
}

// Where two dark and two bright squares meet. (At a single square's corner cornerSubPix itself is off by up to half a
// pixel towards the inside, in any picture.)
std::vector<Eigen::Vector3d> InnerCorners() {
  return {{6.0 - kStandOff, 2.2, 1.2}, {6.0 - kStandOff, 2.5, 1.2}, {6.0 - kStandOff, 2.8, 1.2}};
}

TEST(CameraSensor, ShowsKnownCornersWhereTheModelProjectsThem) {
  const World world = RoomWithChessboard();
  const Scene scene(world, 1);
  const CameraSensor camera(world.camera);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (const Rigid2& T_world_base : {Rigid2(3.6, 2.5, 0.0), Rigid2(3.8, 1.9, 0.25), Rigid2(3.0, 3.1, -0.2),
                                     Rigid2(4.4, 2.62, 0.02), Rigid2(1.2, 2.0, 0.3)}) {
    const Rigid3 T_world_camera = Embed3(T_world_base) * world.camera.T_base_camera();
    const cv::Mat image = Copy(camera.Render(scene, ShotFrom(T_world_camera)));
    for (const Eigen::Vector3d& corner : InnerCorners()) {
      const Eigen::Vector2d expected = world.camera.model.Project(T_world_camera.Inverse() * corner);
      ASSERT_TRUE(expected.minCoeff() > 15.0 && expected.x() < 625.0 && expected.y() < 465.0) << expected.transpose();
      // Off by a pixel and a half to begin with: the refinement must find it, not keep it.
      std::vector<cv::Point2f> found = {
          {static_cast<float>(expected.x() + 1.5), static_cast<float>(expected.y() - 1.0)}};
      cv::cornerSubPix(image, found, {5, 5}, {-1, -1}, {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 50, 1e-3});
      EXPECT_NEAR(found[0].x, expected.x(), 0.3) << "corner at " << corner.transpose();
      EXPECT_NEAR(found[0].y, expected.y(), 0.3) << "corner at " << corner.transpose();
      sum += Eigen::Vector2d(found[0].x, found[0].y) - expected;
      ++count;
    }
  }
  EXPECT_LT((sum / count).norm(), 0.1) << "no common shift, such as half a pixel from another convention";
}

TEST(CameraSensor, SmoothsEdgesBetweenFaces) {
  const World world = RoomWithChessboard();
  const Scene scene(world, 1);
  // A slightly rolled camera: the squares' edges cross pixels at all fractions.
  const Rigid3 T_roll(ExpSo3({0, 0, 0.05}), Eigen::Vector3d::Zero());
  const cv::Mat image =
      Copy(CameraSensor(world.camera)
               .Render(scene, ShotFrom(Embed3(Rigid2(3.6, 2.5, 0.0)) * world.camera.T_base_camera() * T_roll)));
  int between = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x)
      between += image.at<std::uint8_t>(y, x) > 60 && image.at<std::uint8_t>(y, x) < 110 ? 1 : 0;
  }
  EXPECT_GT(between, 100);
}

TEST(CameraSensor, NoiseHasTheStatedDeviationAndFollowsItsSeed) {
  World world = BareRoom();
  world.room.walls.shade = 160;  // about mid grey in the picture
  const Scene scene(world, 1);
  const Rigid3 T_world_camera = Embed3(Rigid2(3.0, 2.5, 0.0)) * world.camera.T_base_camera();
  const cv::Mat clean = Copy(CameraSensor(world.camera).Render(scene, ShotFrom(T_world_camera)));
  world.camera.noise = 4.0;
  const CameraSensor noisy_camera(world.camera);
  const cv::Mat first = Copy(noisy_camera.Render(scene, ShotFrom(T_world_camera))),
                again = Copy(noisy_camera.Render(scene, ShotFrom(T_world_camera))),
                second = Copy(noisy_camera.Render(scene, ShotFrom(T_world_camera, 2)));
  EXPECT_EQ(cv::countNonZero(first != again), 0);
  EXPECT_GT(cv::countNonZero(first != second), 100000);
  cv::Mat difference, at_mid_grey;
  cv::subtract(first, clean, difference, cv::noArray(), CV_32F);
  cv::inRange(clean, 118, 138, at_mid_grey);
  ASSERT_GT(cv::countNonZero(at_mid_grey), 1000);
  cv::Scalar mean, deviation;
  cv::meanStdDev(difference, mean, deviation, at_mid_grey);
  EXPECT_NEAR(mean[0], 0.0, 0.3);
  EXPECT_NEAR(deviation[0], 4.0, 0.3);
}

TEST(CameraSensor, ExposureScalesGreyLevels) {
  World world = BareRoom();
  const Scene scene(world, 1);
  const Rigid3 T_world_camera = Embed3(Rigid2(3.0, 2.5, 0.0)) * world.camera.T_base_camera();
  const double full = cv::mean(Copy(CameraSensor(world.camera).Render(scene, ShotFrom(T_world_camera))))[0];
  CameraShot dark = ShotFrom(T_world_camera);
  dark.exposure.factor = 0.5;
  EXPECT_NEAR(cv::mean(Copy(CameraSensor(world.camera).Render(scene, dark)))[0], 0.5 * full, 1.0);
}

TEST(CameraSensor, ThreadsDoNotChangeThePicture) {
  World world = RoomWithChessboard();
  world.camera.noise = 3.0;
  const Scene scene(world, 1);
  CameraShot shot = ShotFrom(Embed3(Rigid2(3.0, 2.3, 0.4)) * world.camera.T_base_camera());
  shot.velocity << 0.1, 0.0, 0.3, 0.0, 0.5, 0.0;
  shot.exposure.time = 0.02;
  const GrayImage alone = CameraSensor(world.camera, 1).Render(scene, shot);
  for (const int threads : {2, 3, 7}) {
    EXPECT_EQ(*CameraSensor(world.camera, threads).Render(scene, shot).pixels, *alone.pixels) << threads;
  }
}

// How wide the step between a dark square and the wall beside it is, px: from a quarter to three quarters.
double EdgeWidth(const cv::Mat& image, int row, int from, int to) {
  const double low = image.at<std::uint8_t>(row, to), high = image.at<std::uint8_t>(row, from);
  const auto crossing = [&](double share) {
    for (int x = from; x < to; ++x) {
      const double a = image.at<std::uint8_t>(row, x), b = image.at<std::uint8_t>(row, x + 1);
      const double level = high + share * (low - high);
      if (a >= level && b < level) return x + (a - level) / (a - b);
    }
    return -1.0;
  };
  return crossing(0.75) - crossing(0.25);
}

TEST(CameraSensor, TurningBlursByTheWayOnTheSensor) {
  World world = BareRoom();
  world.posters.push_back({Wall::kEast, 2.2, 1.1, {0.6, 0.6}, {"plain", 40}});
  const Scene scene(world, 1);
  const Rigid3 T_world_camera = Embed3(Rigid2(3.0, 2.5, 0.0)) * world.camera.T_base_camera();
  const Eigen::Vector2d edge =
      world.camera.model.Project(T_world_camera.Inverse() * Eigen::Vector3d(6.0 - kStandOff, 2.5, 1.1));
  CameraShot shot = ShotFrom(T_world_camera);
  shot.velocity[4] = 0.6;  // rad/s about the camera's y axis
  shot.exposure.time = 0.03;
  const int row = static_cast<int>(edge.y()), column = static_cast<int>(edge.x());
  const cv::Mat blurred = Copy(CameraSensor(world.camera).Render(scene, shot));
  const double way = 0.6 * 0.03 * world.camera.model.fx;
  EXPECT_NEAR(EdgeWidth(blurred, row, column - 15, column + 15), 0.5 * way, 1.0);
  shot.exposure.time = 0.0;
  EXPECT_LT(EdgeWidth(Copy(CameraSensor(world.camera).Render(scene, shot)), row, column - 15, column + 15), 1.0);
}

TEST(CameraSensor, RollingShutterShearsUprightEdges) {
  World world = BareRoom();
  world.posters.push_back({Wall::kEast, 1.7, 1.35, {1.6, 2.0}, {"plain", 40}});
  const Rigid3 T_world_camera = Embed3(Rigid2(3.0, 2.5, 0.0)) * world.camera.T_base_camera();
  world.camera.rolling_shutter = 0.03;
  const Scene scene(world, 1);
  CameraShot shot = ShotFrom(T_world_camera);
  shot.velocity[4] = 0.5;
  const cv::Mat image = Copy(CameraSensor(world.camera).Render(scene, shot));
  const auto edge = [&](int row) {
    int column = 0;
    while (image.at<std::uint8_t>(row, column) > 120) ++column;
    return column;
  };
  // Turning right moves the edge left, the more the later the row.
  const double expected = -0.5 * 0.03 * world.camera.model.fx * 200.0 / 480.0;
  EXPECT_NEAR(edge(340) - edge(140), expected, 1.6);
}

TEST(ExposureControl, SettlesAtItsTargetAndLengthensTheExposureInTheDark) {
  CameraSpec spec;
  spec.auto_exposure = true;
  spec.exposure_time = 0.01;
  ExposureControl control(spec);
  constexpr double kScene = 40.0;  // mean grey level at factor 1
  for (int i = 0; i < 60; ++i) {
    const auto level = static_cast<std::uint8_t>(std::min(255.0, kScene * control.Next().factor));
    control.Observe({2, 2, std::make_shared<const std::vector<std::uint8_t>>(4, level)});
  }
  EXPECT_NEAR(control.Next().factor, spec.exposure_target / kScene, 0.1);
  EXPECT_EQ(control.Next().time, spec.longest_exposure);
  EXPECT_GT(control.Next().noise_gain, 1.2);
  spec.auto_exposure = false;
  ExposureControl fixed(spec);
  fixed.Observe({1, 1, std::make_shared<const std::vector<std::uint8_t>>(1, std::uint8_t{3})});
  EXPECT_EQ(fixed.Next().factor, spec.exposure);
  EXPECT_EQ(fixed.Next().noise_gain, 1.0);
}

TEST(CameraSensor, WrittenTextIsNotMirrored) {
  // A door's handle is on its right: in the picture, dark pixels right of the middle at half height.
  World world = BareRoom();
  world.posters.push_back({Wall::kWest, 2.5, 1.05, {0.9, 2.1}, {"door"}});
  const Scene scene(world, 1);
  const cv::Mat image =
      Copy(CameraSensor(world.camera)
               .Render(scene, ShotFrom(Embed3(Rigid2(2.5, 2.5, M_PI)) * world.camera.T_base_camera())));
  const Rigid3 T_camera_world = (Embed3(Rigid2(2.5, 2.5, M_PI)) * world.camera.T_base_camera()).Inverse();
  // Facing west, north (larger y) is to the right.
  const auto darkest = [&](double y_low, double y_high) {
    int level = 255;
    for (double y = y_low; y < y_high; y += 0.005) {
      const Eigen::Vector2d px = world.camera.model.Project(T_camera_world * Eigen::Vector3d(0.004, y, 1.05));
      level = std::min<int>(
          level, image.at<std::uint8_t>(static_cast<int>(std::lround(px.y())), static_cast<int>(std::lround(px.x()))));
    }
    return level;
  };
  EXPECT_LT(darkest(2.70, 2.86) + 40, darkest(2.14, 2.30));
}

}  // namespace
}  // namespace planar_vslam
