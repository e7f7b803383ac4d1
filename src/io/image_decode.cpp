#include "image_decode.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <opencv2/imgproc.hpp>

#include "planar_vslam/sensor/jpeg.h"
#include "png_decode.h"
#include "pnm_decode.h"

namespace planar_vslam::io {
namespace {

// How the bytes of an encoding become grey; 16-bit grey keeps its high byte and has no OpenCV conversion.
struct Encoding {
  const char* name;
  int bytes_per_pixel;
  int type;        // OpenCV's
  int conversion;  // OpenCV's code, or one of the two below
};
constexpr int kCopy = -1;
constexpr int kHighByte = -2;

// OpenCV names a Bayer pattern by the second row's second and third pixel, ROS by the first row's first two.
constexpr Encoding kEncodings[] = {
    {"mono8", 1, CV_8UC1, kCopy},
    {"8UC1", 1, CV_8UC1, kCopy},
    {"bgr8", 3, CV_8UC3, cv::COLOR_BGR2GRAY},
    {"8UC3", 3, CV_8UC3, cv::COLOR_BGR2GRAY},
    {"rgb8", 3, CV_8UC3, cv::COLOR_RGB2GRAY},
    {"bgra8", 4, CV_8UC4, cv::COLOR_BGRA2GRAY},
    {"rgba8", 4, CV_8UC4, cv::COLOR_RGBA2GRAY},
    {"mono16", 2, CV_16UC1, kHighByte},
    {"16UC1", 2, CV_16UC1, kHighByte},
    {"yuv422", 2, CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
    {"yuv422_yuy2", 2, CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
    {"bayer_rggb8", 1, CV_8UC1, cv::COLOR_BayerBG2GRAY},
    {"bayer_bggr8", 1, CV_8UC1, cv::COLOR_BayerRG2GRAY},
    {"bayer_gbrg8", 1, CV_8UC1, cv::COLOR_BayerGR2GRAY},
    {"bayer_grbg8", 1, CV_8UC1, cv::COLOR_BayerGB2GRAY},
};

GrayImage ToGrayImage(const cv::Mat& gray) {
  auto pixels = std::make_shared<std::vector<std::uint8_t>>();
  pixels->reserve(gray.total());
  for (int row = 0; row < gray.rows; ++row) {
    const std::uint8_t* first = gray.ptr<std::uint8_t>(row);
    pixels->insert(pixels->end(), first, first + gray.cols);
  }
  return {gray.cols, gray.rows, std::move(pixels)};
}

cv::Mat HighBytes(const RawImage& raw) {
  cv::Mat gray(raw.height, raw.width, CV_8UC1);
  const std::size_t high = raw.big_endian ? 0 : 1;
  for (int row = 0; row < raw.height; ++row) {
    const std::uint8_t* source = raw.data->data() + static_cast<std::size_t>(row) * raw.row_bytes;
    std::uint8_t* target = gray.ptr<std::uint8_t>(row);
    for (int column = 0; column < raw.width; ++column)
      target[column] = source[2 * static_cast<std::size_t>(column) + high];
  }
  return gray;
}

}  // namespace

std::optional<GrayImage> DecodeImage(const std::vector<std::uint8_t>& bytes) {
  constexpr std::uint8_t kJpeg = 0xff, kPng = 0x89;
  if (bytes.empty()) return std::nullopt;
  if (bytes[0] == kJpeg) return DecodeJpeg(bytes);
  if (bytes[0] == kPng) return DecodePng(bytes);
  return DecodePnm(bytes);
}

std::optional<GrayImage> DecodeImageFile(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  std::error_code error;
  std::vector<std::uint8_t> bytes(std::filesystem::file_size(path, error));
  if (error) return std::nullopt;
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return DecodeImage(bytes);
}

Expected<GrayImage> ConvertImage(const RawImage& raw) {
  const Encoding* encoding = nullptr;
  for (const Encoding& known : kEncodings) {
    if (raw.encoding == known.name) encoding = &known;
  }
  if (encoding == nullptr) {
    return Error{
        fmt::format("image encoding '{}' is not supported; expected mono8, mono16, bgr8, rgb8, bgra8, rgba8, "
                    "yuv422 or 8-bit Bayer",
                    raw.encoding)};
  }
  const std::size_t row_needs =
      static_cast<std::size_t>(raw.width) * static_cast<std::size_t>(encoding->bytes_per_pixel);
  const std::size_t height = static_cast<std::size_t>(raw.height);
  if (raw.width <= 0 || raw.height <= 0 || raw.row_bytes < row_needs || raw.data->size() / height < raw.row_bytes) {
    return Error{fmt::format("image of {} bytes with step {} is too short for {}x{} {}", raw.data->size(),
                             raw.row_bytes, raw.width, raw.height, raw.encoding)};
  }
  if (encoding->conversion == kHighByte) return ToGrayImage(HighBytes(raw));
  // cv::Mat has no view of constant memory; nothing here writes through it.
  auto* bytes = const_cast<std::uint8_t*>(raw.data->data());
  const cv::Mat rows(raw.height, raw.width, encoding->type, bytes, raw.row_bytes);
  if (encoding->conversion == kCopy) return ToGrayImage(rows);
  cv::Mat gray;
  try {
    cv::cvtColor(rows, gray, encoding->conversion);
  } catch (const cv::Exception&) {
    return Error{fmt::format("image of {}x{} {} cannot be converted to grey", raw.width, raw.height, raw.encoding)};
  }
  return ToGrayImage(gray);
}

}  // namespace planar_vslam::io
