#include "planar_vslam/mapping2d/grid.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <optional>

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

// map_server's trinary grey values.
constexpr std::uint8_t kGreyOccupied = 0;
constexpr std::uint8_t kGreyUnknown = 205;
constexpr std::uint8_t kGreyFree = 254;
// map_saver's thresholds: 205 reads as (255 - 205) / 255 = 0.1961, just above the second.
constexpr double kOccupiedThreshold = 0.65;
constexpr double kFreeThreshold = 0.196;
constexpr int kYamlDigits = 12;     // 0.05 stays 0.05; a micrometre on a million kilometres
constexpr long kMaxSide = 1 << 15;  // cells along one side of an image; larger is a broken header

std::uint8_t Grey(std::int8_t cell) {
  if (cell < 0) return kGreyUnknown;
  return cell == 0 ? kGreyFree : kGreyOccupied;
}

// Image rows run downwards, grid rows upwards.
std::size_t ImageIndex(int width, int height, int x, int y) {
  return static_cast<std::size_t>(height - 1 - y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

struct MapServerHeader {
  fs::path image;
  double resolution = 0.0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  bool negate = false;
  double occupied_threshold = 0.0;
  double free_threshold = 0.0;
};

struct GreyImage {
  int width = 0;
  int height = 0;
  int max_value = 0;
  std::vector<std::uint8_t> pixels;
};

// The value of `key`, or an Error that names file and key.
template <class T>
Expected<T> Field(const YAML::Node& yaml, const fs::path& path, const std::string& key, const std::string& expected) {
  const std::string where = path.string() + ": " + key + ": ";
  if (!yaml[key]) return Error{where + "missing, expected " + expected};
  try {
    return yaml[key].as<T>();
  } catch (const YAML::Exception&) {
    return Error{where + "expected " + expected};
  }
}

Expected<double> NumberField(const YAML::Node& yaml, const fs::path& path, const std::string& key, double above,
                             double up_to, const std::string& expected) {
  const Expected<double> number = Field<double>(yaml, path, key, expected);
  if (!number) return number;
  if (!(*number > above && *number <= up_to)) return Error{path.string() + ": " + key + ": expected " + expected};
  return number;
}

Expected<Eigen::Vector2d> OriginField(const YAML::Node& yaml, const fs::path& path) {
  const std::string expected = "[x, y, 0], three finite numbers with yaw 0";
  const auto numbers = Field<std::vector<double>>(yaml, path, "origin", expected);
  if (!numbers) return numbers.error();
  const bool good = numbers->size() == 3 && std::isfinite((*numbers)[0]) && std::isfinite((*numbers)[1]);
  if (!good || (*numbers)[2] != 0.0) return Error{path.string() + ": origin: expected " + expected};
  return Eigen::Vector2d((*numbers)[0], (*numbers)[1]);
}

// map_server takes 0 and 1; people also write false and true.
Expected<bool> NegateField(const YAML::Node& yaml, const fs::path& path) {
  const auto text = Field<std::string>(yaml, path, "negate", "0 or 1");
  if (!text) return text.error();
  if (*text == "0" || *text == "false") return false;
  if (*text == "1" || *text == "true") return true;
  return Error{path.string() + ": negate: expected 0 or 1"};
}

Expected<YAML::Node> LoadYaml(const fs::path& path) {
  try {
    YAML::Node yaml = YAML::LoadFile(path.string());
    if (!yaml.IsMap())
      return Error{path.string() + ": expected the keys of a map_server yaml (image, resolution, ...)"};
    return yaml;
  } catch (const YAML::BadFile&) {
    return Error{path.string() + ": cannot be read, expected a map_server yaml file"};
  } catch (const YAML::ParserException& problem) {
    return Error{path.string() + ":" + std::to_string(problem.mark.line + 1) + ": not yaml (" + problem.msg + ")"};
  }
}

Expected<MapServerHeader> ReadHeader(const fs::path& path) {
  constexpr double kMaxResolution = 1000.0;  // m per cell; beyond is a typing error
  const auto yaml = LoadYaml(path);
  if (!yaml) return yaml.error();
  const auto image = Field<std::string>(*yaml, path, "image", "the name of a pgm file");
  if (!image) return image.error();
  const auto resolution = NumberField(*yaml, path, "resolution", 0.0, kMaxResolution, "metres per cell, above 0");
  if (!resolution) return resolution.error();
  const auto origin = OriginField(*yaml, path);
  if (!origin) return origin.error();
  const auto negate = NegateField(*yaml, path);
  if (!negate) return negate.error();
  const auto occupied = NumberField(*yaml, path, "occupied_thresh", 0.0, 1.0, "a probability above 0");
  if (!occupied) return occupied.error();
  const auto free = NumberField(*yaml, path, "free_thresh", 0.0, *occupied, "a probability up to occupied_thresh");
  if (!free) return free.error();
  if ((*yaml)["mode"]) {
    const auto mode = Field<std::string>(*yaml, path, "mode", "trinary");
    if (!mode) return mode.error();
    if (*mode != "trinary") return Error{path.string() + ": mode: expected trinary, not " + *mode};
  }
  return MapServerHeader{path.parent_path() / *image, *resolution, *origin, *negate, *occupied, *free};
}

// The bytes of a pgm file, read as whitespace-separated numbers with # comments, then as pixels.
class PgmReader {
 public:
  explicit PgmReader(const fs::path& path) : path_(path) {}

  Expected<GreyImage> Read() {
    std::ifstream file(path_, std::ios::binary);
    if (!file || fs::is_directory(path_)) return Problem("cannot be read, expected a pgm image");
    bytes_.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    const std::string magic = bytes_.substr(0, 2);
    if (magic != "P5" && magic != "P2") return Problem("expected a pgm image that starts with P5 or P2");
    position_ = 2;
    const auto width = Number(), height = Number(), max_value = Number();
    if (!width || *width < 1 || *width > kMaxSide) return Problem("width: expected 1 to 32768");
    if (!height || *height < 1 || *height > kMaxSide) return Problem("height: expected 1 to 32768");
    if (!max_value || *max_value < 1 || *max_value > 255) return Problem("largest grey value: expected 1 to 255");
    GreyImage image{static_cast<int>(*width), static_cast<int>(*height), static_cast<int>(*max_value), {}};
    const auto count = static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height);
    return magic == "P5" ? Binary(std::move(image), count) : Text(std::move(image), count);
  }

 private:
  Error Problem(const std::string& what) const { return Error{path_.string() + ": " + what}; }

  std::optional<long> Number() {
    bool comment = false;
    while (position_ < bytes_.size()) {
      const char c = bytes_[position_];
      if (c == '#') comment = true;
      if (c == '\n') comment = false;
      if (!comment && std::isspace(static_cast<unsigned char>(c)) == 0) break;
      ++position_;
    }
    long value = 0;
    bool any = false;
    for (; position_ < bytes_.size() && bytes_[position_] >= '0' && bytes_[position_] <= '9'; ++position_) {
      value = std::min(10 * value + (bytes_[position_] - '0'), kMaxSide + 1);
      any = true;
    }
    return any ? std::optional<long>(value) : std::nullopt;
  }

  Expected<GreyImage> Binary(GreyImage image, std::size_t count) {
    ++position_;  // the one whitespace character after the header
    if (bytes_.size() < position_ + count) return Problem("pixels end early, expected " + std::to_string(count));
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(position_);
    image.pixels.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
    return image;
  }

  Expected<GreyImage> Text(GreyImage image, std::size_t count) {
    if (bytes_.size() < position_ + count) return Problem("pixels end early, expected " + std::to_string(count));
    image.pixels.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto value = Number();
      if (!value) return Problem("pixels end early, expected " + std::to_string(count));
      if (*value > image.max_value) return Problem("a pixel is brighter than the largest grey value");
      image.pixels.push_back(static_cast<std::uint8_t>(*value));
    }
    return image;
  }

  fs::path path_;
  std::string bytes_;
  std::size_t position_ = 0;
};

Expected<bool> WritePgm(const OccupancyGrid2d& grid, const fs::path& path) {
  std::string pixels(grid.cells.size(), '\0');
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      pixels[ImageIndex(grid.width, grid.height, x, y)] = static_cast<char>(Grey(grid.At(x, y)));
    }
  }
  std::ofstream file(path, std::ios::binary);
  file << "P5\n" << grid.width << " " << grid.height << "\n255\n" << pixels << std::flush;
  if (!file) return Error{path.string() + ": cannot be written (is the folder there, and space left?)"};
  return true;
}

}  // namespace

Expected<bool> WriteMapServerFiles(const OccupancyGrid2d& grid, const fs::path& yaml_path) {
  // Readers of images refuse empty ones.
  if (grid.cells.empty()) return WriteMapServerFiles({1, 1, grid.resolution, grid.origin, {-1}}, yaml_path);
  const bool whole = grid.cells.size() == static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
  PV_CHECK(whole, "width=" << grid.width << " height=" << grid.height << " cells=" << grid.cells.size());
  fs::path pgm_path = yaml_path;
  pgm_path.replace_extension(".pgm");
  const auto written = WritePgm(grid, pgm_path);
  if (!written) return written;
  std::ofstream file(yaml_path);
  file << std::setprecision(kYamlDigits) << "image: " << YAML::Node(pgm_path.filename().string())
       << "\nresolution: " << grid.resolution << "\norigin: [" << grid.origin.x() << ", " << grid.origin.y()
       << ", 0.0]\nnegate: 0\noccupied_thresh: " << kOccupiedThreshold << "\nfree_thresh: " << kFreeThreshold << "\n"
       << std::flush;
  if (!file) return Error{yaml_path.string() + ": cannot be written (is the folder there, and space left?)"};
  return true;
}

Expected<OccupancyGrid2d> ReadMapServerFiles(const fs::path& yaml_path) {
  const auto header = ReadHeader(yaml_path);
  if (!header) return header.error();
  const auto image = PgmReader(header->image).Read();
  if (!image) return image.error();

  OccupancyGrid2d grid;
  grid.width = image->width;
  grid.height = image->height;
  grid.resolution = header->resolution;
  grid.origin = header->origin;
  grid.cells.reserve(image->pixels.size());
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const double grey =
          static_cast<double>(image->pixels[ImageIndex(grid.width, grid.height, x, y)]) / image->max_value;
      const double occupancy = header->negate ? grey : 1.0 - grey;
      const bool occupied = occupancy > header->occupied_threshold, free = occupancy < header->free_threshold;
      grid.cells.push_back(static_cast<std::int8_t>(occupied ? 100 : (free ? 0 : -1)));
    }
  }
  return grid;
}

}  // namespace planar_vslam
