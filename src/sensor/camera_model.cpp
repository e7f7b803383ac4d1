#include "planar_vslam/sensor/camera_model.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

namespace planar_vslam {

namespace {

constexpr double kUndistortTolerance = 1e-9;  // px
constexpr double kWidestSlope = 2.7475;       // tangent of 70 degrees, see UndistortPixel

// A point of the plane z = 1 through the lens, with the Jacobian [xx xy; xy yy] (symmetric for these models).
struct Distorted {
  double x, y;
  double dxx, dxy, dyy;

  bool folded() const { return !(dxx * dyy - dxy * dxy > 0.0) || !(dxx > 0.0); }
};

// x and y times a factor f of r2, whose derivative by r2 is `slope` / 2.
Distorted Scaled(double x, double y, double factor, double slope) {
  return {x * factor, y * factor, factor + slope * x * x, slope * x * y, factor + slope * y * y};
}

Distorted DistortRadially(const CameraModel& camera, double x, double y) {
  const double r2 = x * x + y * y;
  const double over = 1.0 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  const double under = 1.0 + r2 * (camera.k4 + r2 * (camera.k5 + r2 * camera.k6));
  const double d_over = camera.k1 + r2 * (2.0 * camera.k2 + r2 * 3.0 * camera.k3);
  const double d_under = camera.k4 + r2 * (2.0 * camera.k5 + r2 * 3.0 * camera.k6);
  const double inverse = 1.0 / under, radial = over * inverse;
  Distorted d = Scaled(x, y, radial, 2.0 * inverse * (d_over - radial * d_under));
  d.x += 2.0 * camera.p1 * x * y + camera.p2 * (r2 + 2.0 * x * x);
  d.y += camera.p1 * (r2 + 2.0 * y * y) + 2.0 * camera.p2 * x * y;
  d.dxx += 2.0 * camera.p1 * y + 6.0 * camera.p2 * x;
  d.dxy += 2.0 * camera.p1 * x + 2.0 * camera.p2 * y;
  d.dyy += 6.0 * camera.p1 * y + 2.0 * camera.p2 * x;
  // Beyond a pole, or where the polynomial has turned round, another ray than the lens's gives the pixel.
  if (!(under > 0.0) || !(over > 0.0)) d.dxx = -1.0;
  return d;
}

Distorted DistortEquidistantly(const CameraModel& camera, double x, double y) {
  const double r = std::sqrt(x * x + y * y);
  constexpr double kCentre = 1e-8;  // below it theta is r, to all digits
  if (r < kCentre) return Scaled(x, y, 1.0, 0.0);
  const double theta = std::atan(r), t2 = theta * theta;
  const double k1 = camera.k1, k2 = camera.k2, k3 = camera.k3, k4 = camera.k4;
  const double bent = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))));
  const double d_bent = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)));
  const double factor = bent / r;
  const double d_factor = (d_bent / (1.0 + r * r) - factor) / r;  // by r
  return Scaled(x, y, factor, d_factor / r);
}

Distorted Distort(const CameraModel& camera, double x, double y) {
  return camera.lens == Lens::kEquidistant ? DistortEquidistantly(camera, x, y) : DistortRadially(camera, x, y);
}

// The point of the plane z = 1 that the lens bends to `target`, by Newton from the centre: the steps are cut where they
// would leave the disc around it over which the lens does not fold. Nothing where none is found in it. The lens bends
// nothing at the centre, so the first step is `target` itself.
std::optional<Eigen::Vector2d> Undistort(const CameraModel& camera, const Eigen::Vector2d& target) {
  constexpr int kRounds = 60;
  constexpr double kLongestStep = 0.5;  // on the plane z = 1: short against what a lens bends
  constexpr double kLastStep = 1e-7;    // its square is what Newton leaves: nothing that has to be looked at
  const double tolerance = kUndistortTolerance / std::max(camera.fx, camera.fy);
  Eigen::Vector2d point = Eigen::Vector2d::Zero(), step = target;
  for (int round = 0; round < kRounds; ++round) {
    const double squared = step.squaredNorm();
    if (squared < kLastStep * kLastStep) return Eigen::Vector2d(point + step);
    if (squared > kLongestStep * kLongestStep) step *= kLongestStep / std::sqrt(squared);
    Distorted d = Distort(camera, point.x() + step.x(), point.y() + step.y());
    constexpr int kHalvings = 12;
    for (int k = 0; k < kHalvings && d.folded(); ++k) {
      step *= 0.5;
      d = Distort(camera, point.x() + step.x(), point.y() + step.y());
    }
    if (d.folded()) return std::nullopt;
    point += step;
    const Eigen::Vector2d error = target - Eigen::Vector2d(d.x, d.y);
    if (error.cwiseAbs().maxCoeff() < tolerance) return point;
    const double determinant = d.dxx * d.dyy - d.dxy * d.dxy;
    step = Eigen::Vector2d(d.dyy * error.x() - d.dxy * error.y(), d.dxx * error.y() - d.dxy * error.x()) / determinant;
  }
  return std::nullopt;
}

// Share of the image, on a grid, for whose pixels the lens has no ray at all.
double ShareWithoutRay(const CameraModel& camera) {
  constexpr int kSteps = 32;  // per side
  int without = 0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const double u = camera.width * static_cast<double>(i) / kSteps;
      const double v = camera.height * static_cast<double>(j) / kSteps;
      without += Undistort(camera, {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy}).has_value() ? 0 : 1;
    }
  }
  return without / static_cast<double>((kSteps + 1) * (kSteps + 1));
}

// A fisheye's round picture may leave the corners dark. A polynomial that folds over more than the last pixels of the
// corners is that of another camera or resolution.
double MostWithoutRay(Lens lens) { return lens == Lens::kEquidistant ? 0.5 : 0.03; }

}  // namespace

bool CameraModel::distorted() const {
  if (lens == Lens::kEquidistant) return true;
  for (const double value : {k1, k2, p1, p2, k3, k4, k5, k6}) {
    if (value != 0.0) return true;
  }
  return false;
}

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
  const std::pair<const char*, double> coefficients[] = {{"k1", k1}, {"k2", k2}, {"p1", p1}, {"p2", p2},
                                                         {"k3", k3}, {"k4", k4}, {"k5", k5}, {"k6", k6}};
  for (const auto& [name, value] : coefficients) {
    if (!std::isfinite(value)) add(name, value, "a finite distortion coefficient");
  }
  if (!problems.empty() || !distorted()) return problems;
  const double without = ShareWithoutRay(*this);
  if (without > MostWithoutRay(lens)) {
    std::ostringstream line;
    line << "camera distortion folds the image over itself: " << std::lround(100.0 * without)
         << " % of it have no ray, expected coefficients of this model and resolution";
    problems.push_back(line.str());
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

std::optional<Eigen::Vector2d> CameraModel::UndistortPixel(const Eigen::Vector2d& image_px) const {
  if (!distorted()) return image_px;
  const std::optional<Eigen::Vector2d> point = Undistort(*this, {(image_px.x() - cx) / fx, (image_px.y() - cy) / fy});
  if (!point.has_value() || !(point->squaredNorm() < kWidestSlope * kWidestSlope)) return std::nullopt;
  return Eigen::Vector2d(fx * point->x() + cx, fy * point->y() + cy);
}

}  // namespace planar_vslam
