#include "folder_layouts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "planar_vslam/io/trajectory.h"
#include "stamp_text.h"
#include "text_table.h"

namespace planar_vslam::io {
namespace {

namespace fs = std::filesystem;

// A line's stamp, once per list: malformed text is an error, a stamp that cannot be used is counted and left out.
class StampColumn {
 public:
  StampColumn(std::string what, SkipLog* skipped) : what_(std::move(what)), skipped_(skipped) {}

  Expected<std::optional<Timestamp>> Read(const TextTable& table) {
    const std::string_view text = table.fields().front();
    const StampText parsed = ParseStamp(text);
    if (parsed.kind == StampText::Kind::kMalformed) {
      return table.ErrorHere(fmt::format("stamp '{}'; expected seconds", text));
    }
    if (parsed.kind == StampText::Kind::kNotFinite) return Skip(what_ + " stamp not finite", table);
    if (!gate_.Accept(parsed.stamp)) return Skip(what_ + " stamp not increasing", table);
    return std::optional<Timestamp>(parsed.stamp);
  }

 private:
  std::optional<Timestamp> Skip(const std::string& reason, const TextTable& table) {
    skipped_->Count(reason, table.Position());
    return std::nullopt;
  }

  std::string what_;
  SkipLog* skipped_;
  StampGate gate_;
};

Expected<std::vector<ImageFile>> ReadImageList(const fs::path& list, Separator separator, SkipLog* skipped) {
  Expected<TextTable> table = TextTable::Open(list, separator);
  if (!table) return table.error();
  StampColumn stamps("image", skipped);
  std::vector<ImageFile> images;
  while (table->NextLine()) {
    if (table->fields().size() != 2 || table->fields()[1].empty()) {
      return table->ErrorHere("expected two fields: stamp in seconds and image file");
    }
    const auto stamp = stamps.Read(*table);
    if (!stamp) return stamp.error();
    if (stamp->has_value()) images.push_back({**stamp, list.parent_path() / std::string(table->fields()[1])});
  }
  if (images.empty()) return Error{fmt::format("{}: no images; expected lines of stamp and image file", list.string())};
  return images;
}

Expected<std::vector<OdometryReading>> ReadOdometry(const fs::path& path, SkipLog* skipped) {
  Expected<TextTable> table = TextTable::Open(path, Separator::kComma);
  if (!table) return table.error();
  constexpr std::size_t kPoseFields = 4, kPoseAndTwistFields = 7;
  StampColumn stamps("odometry", skipped);
  std::vector<OdometryReading> readings;
  while (table->NextLine()) {
    const auto& fields = table->fields();
    if (fields.size() != kPoseFields && fields.size() != kPoseAndTwistFields) {
      return table->ErrorHere(fmt::format("{} fields; expected t,x,y,theta or t,x,y,theta,vx,vy,wz", fields.size()));
    }
    std::array<double, 3> pose{};
    for (std::size_t i = 0; i < pose.size(); ++i) {
      const auto number = ParseNumber(fields[i + 1]);
      if (!number.has_value()) return table->ErrorHere(fmt::format("'{}' is not a number", fields[i + 1]));
      pose[i] = *number;
    }
    if (!std::isfinite(pose[0]) || !std::isfinite(pose[1]) || !std::isfinite(pose[2])) {
      skipped->Count("odometry pose not finite", table->Position());
      continue;
    }
    const auto stamp = stamps.Read(*table);
    if (!stamp) return stamp.error();
    if (stamp->has_value()) readings.push_back({**stamp, Rigid2{pose[0], pose[1], pose[2]}});
  }
  if (readings.empty())
    return Error{fmt::format("{}: no readings; expected lines t,x,y,theta,vx,vy,wz", path.string())};
  return readings;
}

// The given file (also relative to the folder), else odometry.csv where there is one.
std::optional<fs::path> OdometryFile(const fs::path& folder, const std::optional<fs::path>& given) {
  if (given.has_value()) return !fs::exists(*given) && fs::exists(folder / *given) ? folder / *given : *given;
  if (fs::exists(folder / "odometry.csv")) return folder / "odometry.csv";
  return std::nullopt;
}

// Where odometry or scans are given, it must be known where the camera and the laser are on the base.
std::optional<Error> MissingExtrinsics(const FolderContents& contents) {
  const std::string file = contents.calibration_file.string();
  const Calibration& calibration = contents.calibration;
  if (!contents.odometry.empty() && !contents.has_base_transform()) {
    return Error{file +
                 ": key 'T_base_camera' is missing; expected where the camera is on the base the odometry is about"};
  }
  if (!contents.scans.has_value()) return std::nullopt;
  for (const auto& [present, key] : {std::pair(contents.has_base_transform(), "T_base_camera"),
                                     std::pair(calibration.T_base_laser.has_value(), "T_base_laser"),
                                     std::pair(calibration.laser.has_value(), "laser")}) {
    if (!present) return Error{fmt::format("{}: key '{}' is missing; expected because there is a scan.csv", file, key)};
  }
  return std::nullopt;
}

// base_camera.txt: where the camera is on the base, for a head that moves.
Expected<TransformBuffer> ReadHead(const fs::path& path) {
  const Expected<Trajectory> poses = ReadTrajectory(path);
  if (!poses) return poses.error();
  if (poses->empty())
    return Error{
        fmt::format("{}: no poses; expected lines t x y z qx qy qz qw of the camera on the base", path.string())};
  TransformBuffer head;
  for (const StampedPose& pose : *poses) head.Push(pose.stamp, pose.T_map_base);
  return head;
}

// images.csv or rgb.txt beside a calibration.yaml.
Expected<FolderContents> ReadListedFolder(const fs::path& folder, const char* image_list, Separator separator,
                                          const RecordingOptions& options, SkipLog* skipped) {
  FolderContents contents;
  contents.calibration_file = folder / "calibration.yaml";
  Expected<Calibration> calibration = ReadCalibration(contents.calibration_file);
  if (!calibration) return calibration.error();
  contents.calibration = *calibration;
  Expected<std::vector<ImageFile>> images = ReadImageList(folder / image_list, separator, skipped);
  if (!images) return images.error();
  contents.images = std::move(*images);
  if (const auto odometry_file = OdometryFile(folder, options.odometry_file)) {
    Expected<std::vector<OdometryReading>> odometry = ReadOdometry(*odometry_file, skipped);
    if (!odometry) return odometry.error();
    contents.odometry = std::move(*odometry);
  }
  if (fs::exists(folder / "scan.csv")) contents.scans = folder / "scan.csv";
  if (fs::exists(folder / "base_camera.txt")) {
    Expected<TransformBuffer> head = ReadHead(folder / "base_camera.txt");
    if (!head) return head.error();
    contents.head = std::move(*head);
  }
  if (const auto missing = MissingExtrinsics(contents)) return *missing;
  return contents;
}

// Intrinsics of the left gray camera of a rectified KITTI pair: the 3 x 4 matrix after "P0:".
Expected<CameraModel> ReadKittiCamera(const fs::path& path) {
  Expected<TextTable> table = TextTable::Open(path, Separator::kBlank);
  if (!table) return table.error();
  constexpr std::size_t kFields = 13;
  while (table->NextLine()) {
    const auto& fields = table->fields();
    if (fields.front() != "P0:") continue;
    std::array<double, kFields> p{};
    for (std::size_t i = 1; i < fields.size() && i < kFields; ++i) {
      p[i] = ParseNumber(fields[i]).value_or(std::numeric_limits<double>::quiet_NaN());
    }
    CameraModel camera;
    camera.fx = p[1];
    camera.cx = p[3];
    camera.fy = p[6];
    camera.cy = p[7];
    const bool finite = std::all_of(p.begin(), p.end(), [](double value) { return std::isfinite(value); });
    if (fields.size() != kFields || !finite || camera.fx <= 0.0 || camera.fy <= 0.0) {
      return table->ErrorHere("expected 'P0:' and the 12 numbers of a 3 x 4 projection matrix");
    }
    return camera;
  }
  return Error{
      fmt::format("{}: key 'P0:' is missing; expected the left gray camera's projection matrix", path.string())};
}

Expected<FolderContents> ReadKittiFolder(const fs::path& folder, SkipLog* skipped) {
  FolderContents contents;
  contents.calibration_file = folder / "calib.txt";
  const Expected<CameraModel> camera = ReadKittiCamera(contents.calibration_file);
  if (!camera) return camera.error();
  contents.calibration.camera = *camera;
  Expected<TextTable> table = TextTable::Open(folder / "times.txt", Separator::kBlank);
  if (!table) return table.error();
  StampColumn stamps("image", skipped);
  for (long index = 0; table->NextLine(); ++index) {
    if (table->fields().size() != 1) return table->ErrorHere("expected one stamp in seconds");
    const auto stamp = stamps.Read(*table);
    if (!stamp) return stamp.error();
    if (stamp->has_value()) contents.images.push_back({**stamp, folder / "image_0" / fmt::format("{:06d}.png", index)});
  }
  if (contents.images.empty())
    return Error{fmt::format("{}: no stamps; expected one line an image", (folder / "times.txt").string())};
  return contents;
}

}  // namespace

bool IsFolderLayout(const fs::path& folder) {
  return fs::exists(folder / "images.csv") || fs::exists(folder / "rgb.txt") || fs::exists(folder / "times.txt") ||
         fs::exists(folder / "image_0");
}

Expected<FolderContents> ReadFolder(const fs::path& folder, const RecordingOptions& options, SkipLog* skipped) {
  if (fs::exists(folder / "images.csv")) {
    return ReadListedFolder(folder, "images.csv", Separator::kComma, options, skipped);
  }
  if (fs::exists(folder / "rgb.txt")) return ReadListedFolder(folder, "rgb.txt", Separator::kBlank, options, skipped);
  if (options.odometry_file.has_value()) {
    return Error{fmt::format("{}: an odometry file was given, but a KITTI folder has no base transform to use it with",
                             folder.string())};
  }
  return ReadKittiFolder(folder, skipped);
}

}  // namespace planar_vslam::io
