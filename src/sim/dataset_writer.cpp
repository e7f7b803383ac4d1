#include "planar_vslam/sim/dataset_writer.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "planar_vslam/sensor/jpeg.h"
#include "planar_vslam/sensor/lens.h"
#include "planar_vslam/sim/solids.h"
#include "planar_vslam/sim/truth_grid.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

constexpr int kJpegQuality = 95;

// The folder's text files, written line by line while the simulation runs.
class Writer {
 public:
  Writer(const fs::path& folder, const World& world, bool with_images) : folder_(folder) {
    if (!world.head.motion.empty())
      base_camera_ = Open("base_camera.txt", "# t x y z qx qy qz qw (camera optical in base_footprint)\n");
    if (with_images) images_ = Open("images.csv", "#t,file\n");
    odometry_ = Open("odometry.csv", "#t,x,y,theta,vx,vy,wz\n");
    if (world.laser.present()) scans_ = Open("scan.csv", "");
    base_truth_ = Open("groundtruth_base.txt", "# t x y z qx qy qz qw (base_footprint in world)\n");
    camera_truth_ = Open("groundtruth_camera.txt", "# t x y z qx qy qz qw (camera optical in world)\n");
  }

  void Write(const SimulatedEvent& event) {
    event_ = &event;
    std::visit(*this, event.measurement);
    counts_.Add(event);
  }
  void operator()(const CameraFrame& frame) {
    const std::string name = fmt::format("images/{:06d}.jpg", counts_.images);
    const std::string stamp = Stamp(frame.image.stamp);
    if (images_.is_open()) images_ << stamp << ',' << name << '\n';
    base_truth_ << stamp << ' ' << Pose(event_->T_world_base) << '\n';
    camera_truth_ << stamp << ' ' << Pose(event_->T_world_camera) << '\n';
    if (base_camera_.is_open()) base_camera_ << stamp << ' ' << Pose(frame.T_base_camera) << '\n';
    const GrayImage& image = frame.image.image;
    if (!image.empty()) WriteJpeg(image, folder_ / name);
  }
  void operator()(const OdometryReading& reading) {
    Eigen::Vector3d twist = Eigen::Vector3d::Zero();
    if (counts_.odometry_readings > 0) {
      twist = LogSe2(last_reading_.T_odom_base.Inverse() * reading.T_odom_base) /
              SecondsBetween(last_reading_.stamp, reading.stamp);
    }
    const Rigid2& T = reading.T_odom_base;
    odometry_ << fmt::format("{},{:.6f},{:.6f},{:.7f},{:.5f},{:.5f},{:.5f}\n", Stamp(reading.stamp), T.translation.x(),
                             T.translation.y(), T.angle, twist.x(), twist.y(), twist.z());
    last_reading_ = reading;
  }
  void operator()(const LaserFrame& frame) {
    scans_ << Stamp(frame.scan.stamp);
    for (const float range : frame.scan.ranges)
      scans_ << (std::isfinite(range) ? fmt::format(",{:.4f}", range) : ",inf");
    scans_ << '\n';
  }

  // Flushes; the first thing that went wrong.
  Expected<DatasetCounts> Finish() {
    for (auto* file : {&images_, &odometry_, &scans_, &base_truth_, &camera_truth_, &base_camera_}) {
      const bool optional = file == &images_ || file == &base_camera_ || file == &scans_;
      if (!file->is_open() && optional) continue;
      file->close();
      if (!*file && failed_.empty()) failed_ = folder_ / "images.csv or one of its companions";
    }
    if (!failed_.empty()) return Error{failed_.string() + ": cannot be written"};
    return counts_;
  }

 private:
  static std::string Stamp(Timestamp stamp) { return fmt::format("{:.6f}", stamp.Seconds()); }
  static std::string Pose(const Rigid3& T) {
    const Eigen::Vector3d& t = T.translation;
    const Eigen::Quaterniond& q = T.rotation;
    return fmt::format("{:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                       q.w());
  }
  std::ofstream Open(const char* name, const char* header) const {
    std::ofstream file(folder_ / name);
    file << header;
    return file;
  }
  void WriteJpeg(const GrayImage& image, const fs::path& path) {
    std::ofstream file(path, std::ios::binary);
    const std::optional<std::vector<std::uint8_t>> bytes = EncodeJpeg(image, kJpegQuality);
    if (bytes.has_value()) {
      file.write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
    }
    file.close();
    if ((!bytes.has_value() || !file) && failed_.empty()) failed_ = path;
  }

  fs::path folder_;
  std::ofstream images_, odometry_, scans_, base_truth_, camera_truth_, base_camera_;
  const SimulatedEvent* event_ = nullptr;
  OdometryReading last_reading_;
  DatasetCounts counts_;
  fs::path failed_;  // first file that could not be written
};

std::string Transform(const Rigid3& T) {
  const Eigen::Quaterniond& q = T.rotation;
  return fmt::format("{{t: [{:.6f}, {:.6f}, {:.6f}], q_xyzw: [{:.9f}, {:.9f}, {:.9f}, {:.9f}]}}", T.translation.x(),
                     T.translation.y(), T.translation.z(), q.x(), q.y(), q.z(), q.w());
}

// Those that only some lenses have.
std::string MoreCoefficients(const CameraModel& c) {
  std::string text;
  for (const auto& [name, value] : {std::pair("k3", c.k3), {"k4", c.k4}, {"k5", c.k5}, {"k6", c.k6}}) {
    if (value != 0.0) text += fmt::format("{}: {}, ", name, value);
  }
  return text;
}

Expected<bool> WriteCalibration(const World& world, const fs::path& path) {
  const CameraModel& c = world.camera.model;
  const LaserSpec& laser = world.laser;
  std::ofstream file(path);
  file << fmt::format(
              "camera: {{width: {}, height: {}, fx: {}, fy: {}, cx: {}, cy: {}, k1: {}, k2: {}, p1: {}, p2: {}, "
              "{}model: "
              "{}}}\n",
              c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, MoreCoefficients(c),
              DescribeLens(c).model)
       << "T_base_camera: " << Transform(world.camera.T_base_camera()) << '\n';
  if (laser.present()) {
    file << "T_base_laser: " << Transform(laser.T_base_laser())
         << fmt::format("\nlaser: {{angle_min: {}, angle_increment: {}, beams: {}, range_max: {}}}\n",
                        laser.angle_min(), laser.angle_increment(), laser.beams, laser.range_max);
  }
  file.close();
  if (!file) return Error{path.string() + ": cannot be written"};
  return true;
}

// What the body would hit, and what the laser sees. Without a laser, nothing of an earlier one stays.
Expected<bool> WriteTruthGrids(const World& world, const fs::path& folder) {
  constexpr double kSlice = 1e-6;  // m, thickness of the laser's plane
  const Expected<bool> body =
      WriteTruthGrid(MakeTruthGrid(world, kBodyLow, kBodyHigh), folder / "groundtruth_grid.yaml");
  if (!body) return body.error();
  const LaserSpec& laser = world.laser;
  if (laser.present()) {
    return WriteTruthGrid(MakeTruthGrid(world, laser.height - kSlice, laser.height + kSlice),
                          folder / "groundtruth_grid_laser.yaml");
  }
  std::error_code was_not_there;
  for (const char* name : {"scan.csv", "groundtruth_grid_laser.yaml", "groundtruth_grid_laser.pgm"})
    fs::remove(folder / name, was_not_there);
  return true;
}

}  // namespace

void DatasetCounts::Add(const SimulatedEvent& event) {
  images += std::holds_alternative<CameraFrame>(event.measurement) ? 1 : 0;
  odometry_readings += std::holds_alternative<OdometryReading>(event.measurement) ? 1 : 0;
  scans += std::holds_alternative<LaserFrame>(event.measurement) ? 1 : 0;
}

Expected<DatasetCounts> WriteDataset(Simulation& simulation, const fs::path& folder,
                                     const std::function<void(const SimulatedEvent&)>& observer) {
  std::error_code failure;
  fs::create_directories(simulation.renders() ? folder / "images" : folder, failure);
  if (failure) return Error{fmt::format("{}: cannot be created: {}", folder.string(), failure.message())};
  const World& world = simulation.world();
  const Expected<bool> calibration = WriteCalibration(world, folder / "calibration.yaml");
  if (!calibration) return calibration.error();
  const Expected<bool> grids = WriteTruthGrids(world, folder);
  if (!grids) return grids.error();
  Writer writer(folder, world, simulation.renders());
  while (const std::optional<SimulatedEvent> event = simulation.Next()) {
    writer.Write(*event);
    if (observer) observer(*event);
  }
  return writer.Finish();
}

}  // namespace planar_vslam
