#include "planar_vslam/io/carmen_log.h"

#include <fmt/format.h>
#include <zlib.h>

#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/sensor/scan_check.h"

namespace planar_vslam {
namespace {

constexpr int kMostBeams = 10000;              // more is a broken line
constexpr std::size_t kLongestLine = 1 << 20;  // bytes
constexpr double kRangeMax = 80.0;             // m, what the lasers of these logs see; codes for errors lie above
constexpr int kPoseFields = 6;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // of UTF-8

// Lines of a file that may be compressed.
class GzLines {
 public:
  explicit GzLines(const std::filesystem::path& path) : file_(gzopen(path.c_str(), "rb"), &gzclose) {}

  bool open() const { return file_ != nullptr; }
  long number() const { return number_; }

  // The next line without its end; nothing at the end of the file, an error (what is wrong) where it is broken.
  Expected<std::optional<std::string>> Next() {
    std::string line;
    while (true) {
      char piece[4096];
      if (gzgets(file_.get(), piece, sizeof(piece)) == nullptr) break;
      line += piece;
      if (line.size() > kLongestLine) return Error{fmt::format("line longer than {} bytes", kLongestLine)};
      if (!line.empty() && line.back() == '\n') break;
    }
    int status = Z_OK;
    gzerror(file_.get(), &status);
    if (status != Z_OK && status != Z_STREAM_END) return Error{"compressed data damaged or cut off"};
    if (line.empty()) return std::optional<std::string>();
    ++number_;
    while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.pop_back();
    return std::optional<std::string>(std::move(line));
  }

 private:
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file_;
  long number_ = 0;
};

std::vector<std::string_view> Words(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t at = line.find_first_not_of(" \t");
  while (at != std::string_view::npos) {
    const std::size_t end = line.find_first_of(" \t", at);
    words.push_back(line.substr(at, end == std::string_view::npos ? end : end - at));
    at = end == std::string_view::npos ? end : line.find_first_not_of(" \t", end);
  }
  return words;
}

template <class Number>
std::optional<Number> Parse(std::string_view word) {
  Number number{};
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (failure != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return number;
}

// The fields of a line, read by name in their order.
class Fields {
 public:
  explicit Fields(const std::vector<std::string_view>& words) : words_(words) {}

  std::size_t left() const { return words_.size() - next_; }
  Expected<double> Number(const std::string& name) {
    const std::string_view word = next_ < words_.size() ? words_[next_++] : std::string_view();
    const std::optional<double> number = Parse<double>(word);
    if (number.has_value() && std::isfinite(*number)) return *number;
    return Error{fmt::format("{} {} is '{}': expected a finite number", words_[0], name, word)};
  }
  Expected<std::size_t> Count(const char* of, int least) {
    const std::optional<int> count = next_ < words_.size() ? Parse<int>(words_[next_++]) : std::nullopt;
    if (count.has_value() && *count >= least && *count <= kMostBeams) return static_cast<std::size_t>(*count);
    return Error{
        fmt::format("{} number of {}: expected a whole number from {} to {}", words_[0], of, least, kMostBeams)};
  }
  std::optional<Error> Ranges(std::size_t count, PlanarScan* scan) {
    for (std::size_t i = 0; i < count; ++i) {
      const Expected<double> range = Number(fmt::format("range {}", i + 1));
      if (!range) return range.error();
      scan->ranges.push_back(static_cast<float>(*range));
    }
    return std::nullopt;
  }
  std::optional<Error> Pose(Rigid2* T) {
    double pose[3];
    for (std::size_t i = 0; i < 3; ++i) {
      const Expected<double> value = Number(i == 0 ? "x" : (i == 1 ? "y" : "theta"));
      if (!value) return value.error();
      pose[i] = *value;
    }
    *T = Rigid2(pose[0], pose[1], pose[2]);
    return std::nullopt;
  }

 private:
  const std::vector<std::string_view>& words_;
  std::size_t next_ = 1;
};

// Directions of the beams of a FLASER line, which has none. It means the half circle ahead, unless a PARAM line before
// it has said otherwise: an odd number has a beam at both ends of it, an even one leaves the last out.
Expected<bool> SetDirections(int count, std::optional<double> field_of_view, PlanarScan* scan) {
  if (field_of_view.has_value()) {
    scan->angle_min = -0.5 * *field_of_view;
    scan->angle_increment = *field_of_view / (count - 1);
    return true;
  }
  const int intervals = count % 2 == 1 ? count - 1 : count;
  // Lasers step by whole degrees or by a half, a quarter, an eighth of one. More beams than that are of a laser that
  // sees more than the half circle.
  constexpr double kFinest = 8.0;  // steps in a degree
  const double per_step = kFinest * 180.0 / intervals;
  if (intervals > 180 && per_step != std::floor(per_step)) {
    return Error{
        fmt::format("FLASER of {} ranges does not divide the 180 degrees it stands for; expected a line "
                    "'PARAM laser_front_laser_fov DEGREES' before it",
                    count)};
  }
  scan->angle_min = -M_PI_2;
  scan->angle_increment = M_PI / intervals;
  return true;
}

// FLASER count ranges laser_pose robot_pose ...
Expected<CarmenScan> ParseFlaser(const std::vector<std::string_view>& words, std::optional<double> field_of_view) {
  Fields fields(words);
  const Expected<std::size_t> count = fields.Count("ranges", 2);
  if (!count) return count.error();
  if (fields.left() < *count + kPoseFields) {
    return Error{fmt::format("FLASER has {} fields: expected {} ranges and two poses", words.size(), *count)};
  }
  CarmenScan result;
  if (const auto error = fields.Ranges(*count, &result.scan)) return *error;
  if (const auto error = fields.Pose(&result.T_map_laser)) return *error;
  const Expected<bool> directed = SetDirections(static_cast<int>(*count), field_of_view, &result.scan);
  if (!directed) return directed.error();
  result.scan.range_max = kRangeMax;
  return result;
}

// ROBOTLASER1 type start_angle field_of_view resolution range_max accuracy mode count ranges count remissions
// laser_pose robot_pose ...
Expected<CarmenScan> ParseRobotLaser(const std::vector<std::string_view>& words) {
  Fields fields(words);
  double values[7];
  const char* const names[] = {"type", "start angle", "field of view", "resolution", "range_max", "accuracy", "mode"};
  for (std::size_t i = 0; i < std::size(names); ++i) {
    const Expected<double> value = fields.Number(names[i]);
    if (!value) return value.error();
    values[i] = *value;
  }
  CarmenScan result;
  PlanarScan& scan = result.scan;
  const Expected<std::size_t> count = fields.Count("ranges", 2);
  if (!count) return count.error();
  if (const auto error = fields.Ranges(*count, &scan)) return *error;
  const Expected<std::size_t> remissions = fields.Count("remissions", 0);
  if (!remissions) return remissions.error();
  for (std::size_t i = 0; i < *remissions; ++i) {
    const Expected<double> value = fields.Number("remission");
    if (!value) return value.error();
  }
  if (const auto error = fields.Pose(&result.T_map_laser)) return *error;
  scan.angle_min = values[1];
  scan.angle_increment = values[3];
  scan.range_max = values[4];
  Expected<PlanarScan> checked = CheckedScan(std::move(scan));
  if (!checked) return Error{"ROBOTLASER1: " + checked.error().message};
  scan = std::move(*checked);
  return result;
}

// rad, of the front laser, from "PARAM ..._fov DEGREES": carmen's own name is laser_front_laser_fov.
std::optional<double> FieldOfView(const std::vector<std::string_view>& words) {
  constexpr std::string_view kEnd = "_fov";
  if (words.size() < 3 || words[0] != "PARAM" || words[1].find("rear") != std::string_view::npos) return std::nullopt;
  if (words[1].size() < kEnd.size() || words[1].substr(words[1].size() - kEnd.size()) != kEnd) return std::nullopt;
  const std::optional<double> degrees = Parse<double>(words[2]);
  if (!degrees.has_value() || !(*degrees > 0.0 && *degrees <= 360.0)) return std::nullopt;
  return DegreesToRadians(*degrees);
}

}  // namespace

Expected<std::vector<CarmenScan>> ReadCarmenLog(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    return Error{fmt::format("{}: no such file, expected a CARMEN log (.log or .log.gz)", path.string())};
  }
  GzLines lines(path);
  if (!lines.open()) return Error{fmt::format("{}: cannot be opened for reading", path.string())};
  std::vector<CarmenScan> flaser, robot_laser;  // newer loggers write each scan as both
  std::optional<double> field_of_view;
  while (true) {
    Expected<std::optional<std::string>> line = lines.Next();
    if (!line) return Error{fmt::format("{}:{}: {}", path.string(), lines.number() + 1, line.error().message)};
    if (!line->has_value()) break;
    if (lines.number() == 1 && (*line)->compare(0, kByteOrderMark.size(), kByteOrderMark) == 0) {
      (*line)->erase(0, kByteOrderMark.size());
    }
    const std::vector<std::string_view> words = Words(**line);
    if (const auto said = FieldOfView(words)) field_of_view = said;
    if (words.empty() || (words[0] != "FLASER" && words[0] != "ROBOTLASER1")) continue;
    std::vector<CarmenScan>& scans = words[0] == "FLASER" ? flaser : robot_laser;
    if (&scans == &flaser && !robot_laser.empty()) continue;
    Expected<CarmenScan> scan = &scans == &flaser ? ParseFlaser(words, field_of_view) : ParseRobotLaser(words);
    if (!scan) return Error{fmt::format("{}:{}: {}", path.string(), lines.number(), scan.error().message)};
    scan->scan.stamp = Timestamp{static_cast<long>(scans.size())};
    scans.push_back(std::move(*scan));
  }
  if (!robot_laser.empty()) return robot_laser;
  if (flaser.empty()) {
    return Error{fmt::format("{}: has no FLASER or ROBOTLASER1 line, expected a CARMEN log", path.string())};
  }
  return flaser;
}

}  // namespace planar_vslam
