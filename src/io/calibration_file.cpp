#include "calibration_file.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "planar_vslam/sensor/lens.h"

namespace planar_vslam::io {
namespace {

// Six printed decimals leave a unit quaternion this far from unit length, with room to spare.
constexpr double kQuaternionLengthTolerance = 1e-3;

// One message on its way up to ReadCalibration, which puts the file name in front.
struct BadCalibration {
  std::string message;
};

void CheckKeys(const YAML::Node& node, const std::string& section, const std::vector<std::string>& known) {
  if (!node.IsMap()) throw BadCalibration{fmt::format("{} must be a map of keys", section)};
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    bool found = false;
    for (const std::string& name : known) found = found || name == key;
    if (found) continue;
    throw BadCalibration{
        fmt::format("unknown key '{}' in {}; expected one of {}", key, section, fmt::join(known, ", "))};
  }
}

double ToNumber(const YAML::Node& node, const std::string& name) {
  double value = 0.0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    throw BadCalibration{fmt::format("{} must be a finite number", name)};
  }
  return value;
}

double RequiredNumber(const YAML::Node& section, const std::string& name, const std::string& key) {
  if (!section[key]) throw BadCalibration{fmt::format("{}.{} is missing; expected a number", name, key)};
  return ToNumber(section[key], name + "." + key);
}

double NumberOr(const YAML::Node& section, const std::string& name, const std::string& key, double absent) {
  return section[key] ? ToNumber(section[key], name + "." + key) : absent;
}

int RequiredPixels(const YAML::Node& section, const std::string& key) {
  const double value = RequiredNumber(section, "camera", key);
  constexpr double kLargestImage = 65536.0;  // px, a bound against typing errors
  if (value < 1.0 || value > kLargestImage || value != std::floor(value)) {
    throw BadCalibration{fmt::format("camera.{} is {}; expected a whole number of pixels", key, value)};
  }
  return static_cast<int>(value);
}

// The coefficients of a lens have names here, and in a camera_info an order.
LensText ToLens(const YAML::Node& node) {
  LensText lens{node["model"] ? node["model"].as<std::string>() : "plumb_bob", {}};
  const bool equidistant = lens.model == "equidistant" || lens.model == "fisheye";
  const auto names = equidistant ? std::vector<std::string>{"k1", "k2", "k3", "k4"}
                                 : std::vector<std::string>{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  for (const std::string& name : names) lens.coefficients.push_back(NumberOr(node, "camera", name, 0.0));
  return lens;
}

CameraModel ToCamera(const YAML::Node& node) {
  CheckKeys(node, "camera",
            {"width", "height", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "model"});
  CameraModel camera;
  camera.width = RequiredPixels(node, "width");
  camera.height = RequiredPixels(node, "height");
  camera.fx = RequiredNumber(node, "camera", "fx");
  camera.fy = RequiredNumber(node, "camera", "fy");
  camera.cx = RequiredNumber(node, "camera", "cx");
  camera.cy = RequiredNumber(node, "camera", "cy");
  const std::set<std::string> models = {"plumb_bob", "rational_polynomial", "equidistant", "fisheye"};
  const std::string model = ToLens(node).model;
  if (models.count(model) == 0) {
    throw BadCalibration{
        fmt::format("camera.model is '{}'; expected plumb_bob, rational_polynomial or equidistant", model)};
  }
  const Expected<bool> lens = SetLens(ToLens(node), &camera);
  if (!lens) throw BadCalibration{"camera.model: " + lens.error().message};
  const std::vector<std::string> problems = camera.Problems();
  if (!problems.empty()) throw BadCalibration{fmt::format("camera: {}", fmt::join(problems, "; "))};
  return camera;
}

std::vector<double> ToNumbers(const YAML::Node& section, const std::string& name, const std::string& key,
                              std::size_t count) {
  const YAML::Node list = section[key];
  if (!list || !list.IsSequence() || list.size() != count) {
    throw BadCalibration{fmt::format("{}.{} must be a list of {} numbers", name, key, count)};
  }
  std::vector<double> numbers;
  for (const YAML::Node& item : list) numbers.push_back(ToNumber(item, name + "." + key));
  return numbers;
}

Rigid3 ToTransform(const YAML::Node& node, const std::string& name) {
  CheckKeys(node, name, {"t", "q_xyzw"});
  const std::vector<double> t = ToNumbers(node, name, "t", 3);
  const std::vector<double> q = ToNumbers(node, name, "q_xyzw", 4);
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1.0) > kQuaternionLengthTolerance) {
    throw BadCalibration{
        fmt::format("{}.q_xyzw has length {}; expected a unit quaternion x y z w", name, rotation.norm())};
  }
  return {rotation.normalized(), Eigen::Vector3d(t[0], t[1], t[2])};
}

LaserGeometry ToLaser(const YAML::Node& node) {
  CheckKeys(node, "laser", {"angle_min", "angle_increment", "beams", "range_min", "range_max"});
  LaserGeometry laser;
  laser.angle_min = RequiredNumber(node, "laser", "angle_min");
  laser.angle_increment = RequiredNumber(node, "laser", "angle_increment");
  laser.range_min = NumberOr(node, "laser", "range_min", 0.0);
  laser.range_max = RequiredNumber(node, "laser", "range_max");
  if (node["beams"]) laser.beams = std::lround(ToNumber(node["beams"], "laser.beams"));
  if (laser.angle_increment == 0.0) throw BadCalibration{"laser.angle_increment is 0; expected radians between beams"};
  if (laser.range_min < 0.0 || laser.range_max <= laser.range_min) {
    throw BadCalibration{
        fmt::format("laser.range_max is {}; expected metres beyond range_min {}", laser.range_max, laser.range_min)};
  }
  return laser;
}

Calibration ToCalibration(const YAML::Node& root) {
  CheckKeys(root, "calibration", {"camera", "T_base_camera", "T_base_laser", "laser"});
  if (!root["camera"]) throw BadCalibration{"key 'camera' is missing; expected the intrinsics of the images"};
  Calibration calibration;
  calibration.camera = ToCamera(root["camera"]);
  if (root["T_base_camera"]) calibration.T_base_camera = ToTransform(root["T_base_camera"], "T_base_camera");
  if (root["T_base_laser"]) calibration.T_base_laser = ToTransform(root["T_base_laser"], "T_base_laser");
  if (root["laser"]) calibration.laser = ToLaser(root["laser"]);
  return calibration;
}

}  // namespace

Expected<Calibration> ReadCalibration(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    return Error{fmt::format(
        "{}: no such file; expected the camera's intrinsics (camera: width height fx fy cx cy ...)", path.string())};
  }
  try {
    return ToCalibration(YAML::LoadFile(path.string()));
  } catch (const BadCalibration& bad) {
    return Error{fmt::format("{}: {}", path.string(), bad.message)};
  } catch (const YAML::Exception& exception) {
    return Error{fmt::format("{}:{}: {}; expected YAML", path.string(), exception.mark.line + 1, exception.msg)};
  }
}

}  // namespace planar_vslam::io
