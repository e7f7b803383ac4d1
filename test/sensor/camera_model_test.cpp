#include "planar_vslam/sensor/camera_model.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace planar_vslam {
namespace {

CameraModel Plain() {
  CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 500.0;
  camera.fy = 510.0;
  camera.cx = 318.0;
  camera.cy = 243.0;
  return camera;
}

// Wide barrel distortion of an automotive camera at half resolution.
CameraModel Barrel() {
  CameraModel camera;
  camera.width = 835;
  camera.height = 307;
  camera.fx = 590.0;
  camera.fy = 590.0;
  camera.cx = 417.5;
  camera.cy = 153.5;
  camera.k1 = -0.37;
  camera.k2 = 0.2;
  camera.p1 = 0.002;
  camera.p2 = 0.0014;
  camera.k3 = -0.07;
  return camera;
}

CameraModel Pincushion() {
  CameraModel camera = Plain();
  camera.k1 = 0.25;
  camera.k2 = 0.1;
  camera.p1 = -0.003;
  return camera;
}

TEST(CameraModel, WithoutDistortionPixelsAreIdeal) {
  const CameraModel camera = Plain();
  EXPECT_TRUE(camera.Problems().empty());
  EXPECT_FALSE(camera.distorted());
  const Eigen::Vector2d pixel(12.0, 400.0);
  EXPECT_EQ(camera.DistortPixel(pixel), pixel);
  EXPECT_EQ(camera.UndistortPixel(pixel), pixel);
  const Eigen::Vector3d point(0.3, -0.2, 2.0);
  EXPECT_EQ(camera.Project(point), camera.ProjectUndistorted(point));
}

TEST(CameraModel, RayInvertsProjection) {
  const CameraModel camera = Plain();
  const Eigen::Vector3d point(0.3, -0.2, 2.0);
  EXPECT_LT((2.0 * camera.Ray(camera.ProjectUndistorted(point)) - point).norm(), 1e-14);
}

TEST(CameraModel, UndistortionInvertsDistortionOverTheWholeImage) {
  for (const CameraModel& camera : {Barrel(), Pincushion()}) {
    ASSERT_TRUE(camera.Problems().empty()) << camera.Problems().front();
    for (int v = 0; v <= camera.height; v += 4) {
      for (int u = 0; u <= camera.width; u += 4) {
        const Eigen::Vector2d pixel(u, v);
        const Eigen::Vector2d ideal = camera.UndistortPixel(pixel);
        ASSERT_LT((camera.DistortPixel(ideal) - pixel).norm(), 2e-9) << pixel.transpose();
        ASSERT_LT((camera.UndistortPixel(camera.DistortPixel(ideal)) - ideal).norm(), 1e-7) << pixel.transpose();
      }
    }
  }
}

TEST(CameraModel, UndistortionIsMonotonicAlongTheBorder) {
  const CameraModel camera = Barrel();
  for (int u = 1; u <= camera.width; ++u) {
    EXPECT_GT(camera.UndistortPixel({u, 0.0}).x(), camera.UndistortPixel({u - 1.0, 0.0}).x());
  }
}

TEST(CameraModel, ProjectFollowsTheBrownConradyEquations) {
  const CameraModel camera = Barrel();
  const Eigen::Vector3d point(0.6, -0.4, 2.0);
  const double x = 0.3, y = -0.2, r2 = x * x + y * y;
  const double radial = 1.0 + camera.k1 * r2 + camera.k2 * r2 * r2 + camera.k3 * r2 * r2 * r2;
  const double xd = x * radial + 2.0 * camera.p1 * x * y + camera.p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + camera.p1 * (r2 + 2.0 * y * y) + 2.0 * camera.p2 * x * y;
  const Eigen::Vector2d expected(camera.fx * xd + camera.cx, camera.fy * yd + camera.cy);
  EXPECT_LT((camera.Project(point) - expected).norm(), 1e-10);
  EXPECT_LT((camera.DistortPixel(camera.ProjectUndistorted(point)) - expected).norm(), 1e-10);
}

TEST(CameraModel, UndistortionStaysFiniteWhereNoRayExists) {
  CameraModel camera = Barrel();
  camera.k1 = -1.5;
  camera.k2 = camera.k3 = 0.0;
  for (int u = -2000; u <= 3000; u += 50) EXPECT_TRUE(camera.UndistortPixel({u, 100.0}).allFinite()) << u;
}

TEST(CameraModel, NamesEveryProblem) {
  EXPECT_EQ(CameraModel().Problems().size(), 6u);
  CameraModel camera = Plain();
  camera.fx = -1.0;
  ASSERT_EQ(camera.Problems().size(), 1u);
  EXPECT_NE(camera.Problems()[0].find("fx"), std::string::npos);
  camera = Plain();
  camera.k2 = std::numeric_limits<double>::quiet_NaN();
  ASSERT_EQ(camera.Problems().size(), 1u);
  EXPECT_NE(camera.Problems()[0].find("k2"), std::string::npos);
  camera = Plain();
  camera.cx = 900.0;
  ASSERT_EQ(camera.Problems().size(), 1u);
  EXPECT_NE(camera.Problems()[0].find("cx"), std::string::npos);
}

TEST(CameraModel, DistortionThatFoldsTheImageIsAProblem) {
  CameraModel camera = Barrel();
  camera.k1 = -1.5;
  camera.k2 = camera.k3 = 0.0;
  ASSERT_EQ(camera.Problems().size(), 1u);
  EXPECT_NE(camera.Problems()[0].find("distortion"), std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
