#include "planar_vslam/sensor/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
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

// As of an Azure Kinect's colour camera.
CameraModel Rational() {
  CameraModel camera = Plain();
  camera.k1 = 0.45, camera.k2 = -2.6, camera.p1 = 6e-4, camera.p2 = -3e-4, camera.k3 = 1.5;
  camera.k4 = 0.33, camera.k5 = -2.4, camera.k6 = 1.4;
  return camera;
}

// As of a fisheye module of 125 degrees.
CameraModel Fisheye() {
  CameraModel camera = Plain();
  camera.fx = camera.fy = 360.0;
  camera.lens = Lens::kEquidistant;
  camera.k1 = -0.01, camera.k2 = 0.03, camera.k3 = -0.02, camera.k4 = 0.004;
  return camera;
}

double SlopeOf(const CameraModel& camera, const Eigen::Vector2d& ideal) { return camera.Ray(ideal).head<2>().norm(); }

TEST(CameraModel, UndistortionInvertsDistortionOverTheWholeImage) {
  for (const CameraModel& camera : {Barrel(), Pincushion(), Rational(), Fisheye()}) {
    ASSERT_TRUE(camera.Problems().empty()) << camera.Problems().front();
    for (int v = 0; v <= camera.height; v += 4) {
      for (int u = 0; u <= camera.width; u += 4) {
        const Eigen::Vector2d pixel(u, v);
        const std::optional<Eigen::Vector2d> ideal = camera.UndistortPixel(pixel);
        ASSERT_TRUE(ideal.has_value()) << pixel.transpose();
        ASSERT_LT((camera.DistortPixel(*ideal) - pixel).norm(), 2e-9) << pixel.transpose();
        const std::optional<Eigen::Vector2d> again = camera.UndistortPixel(camera.DistortPixel(*ideal));
        ASSERT_TRUE(again.has_value());
        ASSERT_LT((*again - *ideal).norm(), 1e-6) << pixel.transpose();
      }
    }
  }
}

TEST(CameraModel, UndistortionIsMonotonicAlongTheBorder) {
  const CameraModel camera = Barrel();
  for (int u = 1; u <= camera.width; ++u) {
    EXPECT_GT(camera.UndistortPixel({u, 0.0})->x(), camera.UndistortPixel({u - 1.0, 0.0})->x());
  }
}

TEST(CameraModel, RaysOfAFisheyeStandAtTheirAngle) {
  CameraModel camera = Fisheye();
  camera.k1 = camera.k2 = camera.k3 = camera.k4 = 0.0;
  for (const double theta : {0.0, 1e-9, 0.3, 0.9, 1.2}) {
    const Eigen::Vector3d point(std::sin(theta), 0.0, std::cos(theta));
    EXPECT_NEAR(camera.Project(point).x(), camera.cx + camera.fx * theta, 1e-9);
  }
  EXPECT_TRUE(camera.distorted());
}

TEST(CameraModel, RaysFarFromTheAxisAreLeftOut) {
  CameraModel camera = Fisheye();
  camera.fx = camera.fy = 200.0;  // the corners see beyond a quarter turn
  ASSERT_TRUE(camera.Problems().empty());
  EXPECT_FALSE(camera.UndistortPixel({0.0, 0.0}).has_value());
  for (int u = 0; u <= camera.width; ++u) {
    const std::optional<Eigen::Vector2d> ideal = camera.UndistortPixel({u, camera.cy});
    if (!ideal.has_value()) continue;
    EXPECT_LT(SlopeOf(camera, *ideal), std::tan(70.01 * M_PI / 180.0)) << u;
  }
  EXPECT_TRUE(camera.UndistortPixel({100.0, camera.cy}).has_value());
}

TEST(CameraModel, ARationalLensDividesItsPolynomials) {
  const CameraModel camera = Rational();
  const double x = 0.3, y = -0.2, r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = (1.0 + camera.k1 * r2 + camera.k2 * r4 + camera.k3 * r6) /
                        (1.0 + camera.k4 * r2 + camera.k5 * r4 + camera.k6 * r6);
  const double xd = x * radial + 2.0 * camera.p1 * x * y + camera.p2 * (r2 + 2.0 * x * x);
  EXPECT_NEAR(camera.Project({x, y, 1.0}).x(), camera.fx * xd + camera.cx, 1e-10);
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

TEST(CameraModel, APixelWithoutARayHasNone) {
  CameraModel camera = Barrel();
  camera.k1 = -1.5;
  camera.k2 = camera.k3 = 0.0;
  // The image of the plane z = 1 ends at two thirds of the radius 1 / sqrt(4.5), where it folds.
  const double end = camera.fx * 2.0 / 3.0 / std::sqrt(4.5);
  for (int u = -2000; u <= 3000; u += 50) {
    const std::optional<Eigen::Vector2d> ideal = camera.UndistortPixel({u, camera.cy});
    EXPECT_EQ(ideal.has_value(), std::abs(u - camera.cx) < end) << u;
    if (!ideal.has_value()) continue;
    EXPECT_LT(SlopeOf(camera, *ideal), 1.0 / std::sqrt(4.5) + 1e-2);
  }
}

TEST(CameraModel, ALensThatFoldsInItsCornersOnlyLosesThem) {
  CameraModel camera = Plain();
  camera.fx = camera.fy = 450.0;
  camera.k1 = -0.22, camera.k2 = 0.01, camera.p1 = 1e-3;
  EXPECT_TRUE(camera.Problems().empty());
  EXPECT_FALSE(camera.UndistortPixel({0.0, 479.0}).has_value());
  EXPECT_TRUE(camera.UndistortPixel({0.0, camera.cy}).has_value());
  EXPECT_TRUE(camera.UndistortPixel({60.0, 420.0}).has_value());
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
