#include "planar_vslam/sensor/camera_model.h"

#include <cmath>
#include <sstream>
#include <utility>

namespace planar_vslam {

namespace {

constexpr int kUndistortRounds = 20;
constexpr double kUndistortTolerance = 1e-9;  // px

// Brown-Conrady on the plane z = 1, with its Jacobian [xx xy; xy yy] (symmetric for this model).
struct Distorted {
  double x, y;
  double dxx, dxy, dyy;
};

Distorted Distort(const CameraModel& camera, double x, double y) {
  const double xx = x * x;
  const double yy = y * y;
  const double xy = x * y;
  const double r2 = xx + yy;
  const double radial = 1.0 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  const double slope = 2.0 * (camera.k1 + r2 * (2.0 * camera.k2 + r2 * 3.0 * camera.k3));  // 2 d radial / d r2
  Distorted d;
  d.x = x * radial + 2.0 * camera.p1 * xy + camera.p2 * (r2 + 2.0 * xx);
  d.y = y * radial + camera.p1 * (r2 + 2.0 * yy) + 2.0 * camera.p2 * xy;
  d.dxx = radial + slope * xx + 2.0 * camera.p1 * y + 6.0 * camera.p2 * x;
  d.dxy = slope * xy + 2.0 * camera.p1 * x + 2.0 * camera.p2 * y;
  d.dyy = radial + slope * yy + 6.0 * camera.p1 * y + 2.0 * camera.p2 * x;
  return d;
}

// Whether every pixel of the image border, and so of the image, has one ray: the corners are the first to fail.
bool InvertibleOverImage(const CameraModel& camera) {
  constexpr int kSteps = 16;           // per side
  constexpr double kRoundTrip = 1e-3;  // px
  for (int i = 0; i <= kSteps; ++i) {
    const double u = camera.width * static_cast<double>(i) / kSteps;
    const double v = camera.height * static_cast<double>(i) / kSteps;
    const double w = camera.width;
    const double h = camera.height;
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(u, 0.0), Eigen::Vector2d(u, h), Eigen::Vector2d(0.0, v), Eigen::Vector2d(w, v)}) {
      const Eigen::Vector2d again = camera.DistortPixel(camera.UndistortPixel(pixel));
      if (!((again - pixel).norm() < kRoundTrip)) return false;
    }
  }
  return true;
}

}  // namespace

std::vector<std::string> CameraModel::Problems() const {
  std::vector<std::string> problems;
  const auto add = [&problems](const char* field, double value, const char* expected) {
    std::ostringstream line;
    line << "camera " << field << " is " << value << ", expected " << expected;
    problems.push_back(line.str());
  };
  if (width <= 0) add("width", width, "a positive number of pixels");
  if (height <= 0) add("height", height, "a positive number of pixels");
  if (!(std::isfinite(fx) && fx > 0.0)) add("fx", fx, "a positive focal length in pixels");
  if (!(std::isfinite(fy) && fy > 0.0)) add("fy", fy, "a positive focal length in pixels");
  if (!(cx > 0.0 && cx < width)) add("cx", cx, "a principal point inside the image");
  if (!(cy > 0.0 && cy < height)) add("cy", cy, "a principal point inside the image");
  const std::pair<const char*, double> coefficients[] = {{"k1", k1}, {"k2", k2}, {"p1", p1}, {"p2", p2}, {"k3", k3}};
  for (const auto& [name, value] : coefficients) {
    if (!std::isfinite(value)) add(name, value, "a finite distortion coefficient");
  }
  if (problems.empty() && distorted() && !InvertibleOverImage(*this)) {
    problems.emplace_back(
        "camera distortion k1 k2 p1 p2 k3 folds the image over itself before its border, "
        "expected plumb_bob coefficients of this resolution");
  }
  return problems;
}

Eigen::Vector2d CameraModel::Project(const Eigen::Vector3d& p_camera) const {
  if (!distorted()) return ProjectUndistorted(p_camera);
  const Distorted d = Distort(*this, p_camera.x() / p_camera.z(), p_camera.y() / p_camera.z());
  return {fx * d.x + cx, fy * d.y + cy};
}

Eigen::Vector2d CameraModel::DistortPixel(const Eigen::Vector2d& ideal_px) const {
  if (!distorted()) return ideal_px;
  const Distorted d = Distort(*this, (ideal_px.x() - cx) / fx, (ideal_px.y() - cy) / fy);
  return {fx * d.x + cx, fy * d.y + cy};
}

Eigen::Vector2d CameraModel::UndistortPixel(const Eigen::Vector2d& image_px) const {
  if (!distorted()) return image_px;
  // Newton: the usual fixed-point iteration stalls or diverges towards the corners of strongly distorted images.
  const double target_x = (image_px.x() - cx) / fx;
  const double target_y = (image_px.y() - cy) / fy;
  double x = target_x;
  double y = target_y;
  for (int round = 0; round < kUndistortRounds; ++round) {
    const Distorted d = Distort(*this, x, y);
    const double error_x = target_x - d.x;
    const double error_y = target_y - d.y;
    if (std::abs(error_x) * fx < kUndistortTolerance && std::abs(error_y) * fy < kUndistortTolerance) break;
    const double determinant = d.dxx * d.dyy - d.dxy * d.dxy;
    if (!(determinant > 0.0) || !(d.dxx > 0.0)) break;  // at the fold: no ray gives this pixel
    x += (d.dyy * error_x - d.dxy * error_y) / determinant;
    y += (d.dxx * error_y - d.dxy * error_x) / determinant;
  }
  return {fx * x + cx, fy * y + cy};
}

}  // namespace planar_vslam
