#include "pnm_decode.h"

#include <cctype>

#include "planar_vslam/sensor/jpeg.h"

namespace planar_vslam::io {
namespace {

struct PnmHeader {
  std::size_t width = 0, height = 0;
  std::size_t channels = 1, bytes_per_value = 1;
  std::size_t size = 0;  // of the header
};

// The number behind white space and comments at *next, which then is behind it; nothing above 2^27.
std::optional<std::size_t> TakeNumber(const std::vector<std::uint8_t>& bytes, std::size_t* next) {
  while (*next < bytes.size() && (std::isspace(bytes[*next]) != 0 || bytes[*next] == '#')) {
    if (bytes[*next] == '#') {
      while (*next < bytes.size() && bytes[*next] != '\n') ++*next;
    } else {
      ++*next;
    }
  }
  if (*next >= bytes.size() || std::isdigit(bytes[*next]) == 0) return std::nullopt;
  std::size_t number = 0;
  for (; *next < bytes.size() && std::isdigit(bytes[*next]) != 0; ++*next) {
    number = 10 * number + static_cast<std::size_t>(bytes[*next] - '0');
    if (number > kMaxDecodedPixels) return std::nullopt;
  }
  return number;
}

std::optional<PnmHeader> ReadHeader(const std::vector<std::uint8_t>& bytes) {
  constexpr std::size_t kOneByte = 255, kTwoBytes = 65535;
  if (bytes.size() < 2 || bytes[0] != 'P' || (bytes[1] != '5' && bytes[1] != '6')) return std::nullopt;
  std::size_t next = 2;
  const auto width = TakeNumber(bytes, &next), height = TakeNumber(bytes, &next), greatest = TakeNumber(bytes, &next);
  if (!width || !height || !greatest || *width == 0 || *height == 0) return std::nullopt;
  if (*greatest == 0 || *greatest > kTwoBytes || *width * *height > kMaxDecodedPixels) return std::nullopt;
  const std::size_t channels = bytes[1] == '6' ? 3 : 1;
  const std::size_t separator = 1;  // one white space
  return PnmHeader{*width, *height, channels, *greatest > kOneByte ? 2U : 1U, next + separator};
}

std::uint8_t Grey(std::uint32_t red, std::uint32_t green, std::uint32_t blue) {
  constexpr std::uint32_t kShift = 14, kRed = 4899, kGreen = 9617, kBlue = 1868, kHalf = 1U << (kShift - 1);
  return static_cast<std::uint8_t>((kRed * red + kGreen * green + kBlue * blue + kHalf) >> kShift);
}

}  // namespace

std::optional<GrayImage> DecodePnm(const std::vector<std::uint8_t>& bytes, GreyDepth* depth) {
  const std::optional<PnmHeader> header = ReadHeader(bytes);
  if (!header.has_value()) return std::nullopt;
  const std::size_t value = header->bytes_per_value, pixel = header->channels * value;
  const std::size_t count = header->width * header->height;
  if (bytes.size() < header->size || bytes.size() - header->size < count * pixel) return std::nullopt;
  auto pixels = std::make_shared<std::vector<std::uint8_t>>(count);
  const std::uint8_t* source = bytes.data() + header->size;  // high bytes come first
  if (header->channels == 1 && value == 2) {
    depth->NarrowBigEndian(source, count, pixels->data());
    return GrayImage{static_cast<int>(header->width), static_cast<int>(header->height), std::move(pixels)};
  }
  for (std::uint8_t& grey : *pixels) {
    grey = header->channels == 1 ? source[0] : Grey(source[0], source[value], source[2 * value]);
    source += pixel;
  }
  return GrayImage{static_cast<int>(header->width), static_cast<int>(header->height), std::move(pixels)};
}

}  // namespace planar_vslam::io
