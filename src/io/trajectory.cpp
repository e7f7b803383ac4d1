#include "planar_vslam/io/trajectory.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>

#include "stamp_text.h"
#include "text_table.h"

namespace planar_vslam {
namespace {

constexpr std::size_t kFields = 8;
// Recordings print quaternions with as few as 4 decimals.
constexpr double kQuaternionLengthTolerance = 1e-2;
// What 9 printed decimals leave: such quaternions stay as they are, so that writing gives the same text again.
constexpr double kPrintedQuaternionTolerance = 1e-8;

Expected<StampedPose> ParsePose(const io::TextTable& table) {
  const auto& fields = table.fields();
  if (fields.size() != kFields) {
    return table.ErrorHere(fmt::format("{} fields; expected 8: t x y z qx qy qz qw", fields.size()));
  }
  const io::StampText stamp = io::ParseStamp(fields[0]);
  if (stamp.kind != io::StampText::Kind::kStamp) {
    return table.ErrorHere(fmt::format("stamp '{}'; expected seconds", fields[0]));
  }
  std::array<double, kFields> v{};
  for (std::size_t i = 1; i < kFields; ++i) {
    const auto number = io::ParseNumber(fields[i]);
    if (!number.has_value() || !std::isfinite(*number)) {
      return table.ErrorHere(fmt::format("field {} is '{}'; expected a finite number", i + 1, fields[i]));
    }
    v[i] = *number;
  }
  Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  const double length_error = std::abs(rotation.norm() - 1.0);
  if (length_error > kQuaternionLengthTolerance) {
    return table.ErrorHere(
        fmt::format("quaternion of length {:.3f}; expected a unit quaternion qx qy qz qw", rotation.norm()));
  }
  if (length_error > kPrintedQuaternionTolerance) rotation.normalize();
  return StampedPose{stamp.stamp, Rigid3{rotation, Eigen::Vector3d(v[1], v[2], v[3])}};
}

}  // namespace

Expected<Trajectory> ReadTrajectory(const std::filesystem::path& path) {
  Expected<io::TextTable> table = io::TextTable::Open(path, io::Separator::kBlank);
  if (!table) return table.error();
  Trajectory trajectory;
  while (table->NextLine()) {
    const Expected<StampedPose> pose = ParsePose(*table);
    if (!pose) return pose.error();
    if (!trajectory.empty() && pose->stamp <= trajectory.back().stamp) {
      return table->ErrorHere(fmt::format("stamp {} is not later than the line before", io::FormatStamp(pose->stamp)));
    }
    trajectory.push_back(*pose);
  }
  if (table->failed()) return Error{fmt::format("{}: reading failed", path.string())};
  return trajectory;
}

Expected<bool> WriteTrajectory(const Trajectory& trajectory, const std::filesystem::path& path) {
  std::ofstream stream(path);
  stream << "# t x y z qx qy qz qw\n";
  for (const StampedPose& pose : trajectory) {
    const Eigen::Vector3d& t = pose.T_map_base.translation;
    const Eigen::Quaterniond& q = pose.T_map_base.rotation;
    stream << fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", io::FormatStamp(pose.stamp), t.x(),
                          t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  stream.flush();
  if (!stream) return Error{fmt::format("{}: cannot be written", path.string())};
  return true;
}

}  // namespace planar_vslam
