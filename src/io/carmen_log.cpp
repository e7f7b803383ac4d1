#include "planar_vslam/io/carmen_log.h"

#include <fmt/format.h>
#include <zlib.h>

#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace planar_vslam {
namespace {

constexpr int kMostBeams = 10000;              // more is a broken line
constexpr std::size_t kLongestLine = 1 << 20;  // bytes
constexpr double kRangeMax = 80.0;             // m, what the lasers of these logs see; codes for errors lie above
constexpr int kPoseFields = 6;

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

Expected<double> Finite(const std::vector<std::string_view>& words, std::size_t at, const std::string& name) {
  const std::optional<double> number = Parse<double>(words[at]);
  if (number.has_value() && std::isfinite(*number)) return *number;
  return Error{fmt::format("FLASER {} is '{}': expected a finite number", name, words[at])};
}

Expected<CarmenScan> ParseScan(const std::vector<std::string_view>& words, long index) {
  const std::optional<int> count = words.size() > 1 ? Parse<int>(words[1]) : std::nullopt;
  if (!count.has_value() || *count < 2 || *count > kMostBeams) {
    return Error{fmt::format("FLASER number of ranges: expected a whole number from 2 to {}", kMostBeams)};
  }
  const auto beams = static_cast<std::size_t>(*count);
  if (words.size() < 2 + beams + kPoseFields) {
    return Error{fmt::format("FLASER has {} fields: expected {} ranges and two poses", words.size(), beams)};
  }
  CarmenScan result;
  PlanarScan& scan = result.scan;
  scan.stamp = Timestamp{index};
  for (std::size_t i = 0; i < beams; ++i) {
    const Expected<double> range = Finite(words, 2 + i, fmt::format("range {}", i + 1));
    if (!range) return range.error();
    scan.ranges.push_back(static_cast<float>(*range));
  }
  double pose[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const Expected<double> value = Finite(words, 2 + beams + i, i == 0 ? "x" : (i == 1 ? "y" : "theta"));
    if (!value) return value.error();
    pose[i] = *value;
  }
  result.T_map_laser = Rigid2(pose[0], pose[1], pose[2]);
  // An odd number has a beam at both ends of the half circle, an even one leaves the last out.
  const int intervals = *count % 2 == 1 ? *count - 1 : *count;
  scan.angle_min = -M_PI_2;
  scan.angle_increment = M_PI / intervals;
  scan.range_max = kRangeMax;
  return result;
}

}  // namespace

Expected<std::vector<CarmenScan>> ReadCarmenLog(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    return Error{fmt::format("{}: no such file, expected a CARMEN log (.log or .log.gz)", path.string())};
  }
  GzLines lines(path);
  if (!lines.open()) return Error{fmt::format("{}: cannot be opened for reading", path.string())};
  std::vector<CarmenScan> scans;
  while (true) {
    const Expected<std::optional<std::string>> line = lines.Next();
    if (!line) return Error{fmt::format("{}:{}: {}", path.string(), lines.number() + 1, line.error().message)};
    if (!line->has_value()) break;
    const std::vector<std::string_view> words = Words(**line);
    if (words.empty() || words[0] != "FLASER") continue;
    Expected<CarmenScan> scan = ParseScan(words, static_cast<long>(scans.size()));
    if (!scan) return Error{fmt::format("{}:{}: {}", path.string(), lines.number(), scan.error().message)};
    scans.push_back(std::move(*scan));
  }
  if (scans.empty()) return Error{fmt::format("{}: has no FLASER line, expected a CARMEN log", path.string())};
  return scans;
}

}  // namespace planar_vslam
