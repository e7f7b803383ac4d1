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

// How the values of an encoding become grey, once they are 8 bits wide.
struct Encoding {
  const char* name;
  int bytes_per_value;
  int type;        // OpenCV's, of 8 bits
  int conversion;  // OpenCV's code, or the one below
};
constexpr int kCopy = -1;

// OpenCV names a Bayer pattern by the second row's second and third pixel, ROS by the first row's first two.
constexpr Encoding kEncodings[] = {
    {"mono8", 1, CV_8UC1, kCopy},
    {"8UC1", 1, CV_8UC1, kCopy},
    {"bgr8", 1, CV_8UC3, cv::COLOR_BGR2GRAY},
    {"8UC3", 1, CV_8UC3, cv::COLOR_BGR2GRAY},
    {"rgb8", 1, CV_8UC3, cv::COLOR_RGB2GRAY},
    {"bgra8", 1, CV_8UC4, cv::COLOR_BGRA2GRAY},
    {"8UC4", 1, CV_8UC4, cv::COLOR_BGRA2GRAY},
    {"rgba8", 1, CV_8UC4, cv::COLOR_RGBA2GRAY},
    {"mono16", 2, CV_8UC1, kCopy},
    {"16UC1", 2, CV_8UC1, kCopy},
    {"bgr16", 2, CV_8UC3, cv::COLOR_BGR2GRAY},
    {"rgb16", 2, CV_8UC3, cv::COLOR_RGB2GRAY},
    {"bgra16", 2, CV_8UC4, cv::COLOR_BGRA2GRAY},
    {"rgba16", 2, CV_8UC4, cv::COLOR_RGBA2GRAY},
    {"yuv422", 1, CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
    {"uyvy", 1, CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
    {"yuv422_yuy2", 1, CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
    {"yuyv", 1, CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
    // All rows of grey, then those of colour.
    {"nv12", 1, CV_8UC1, kCopy},
    {"nv21", 1, CV_8UC1, kCopy},
    {"nv24", 1, CV_8UC1, kCopy},
    {"bayer_rggb8", 1, CV_8UC1, cv::COLOR_BayerBG2GRAY},
    {"bayer_bggr8", 1, CV_8UC1, cv::COLOR_BayerRG2GRAY},
    {"bayer_gbrg8", 1, CV_8UC1, cv::COLOR_BayerGR2GRAY},
    {"bayer_grbg8", 1, CV_8UC1, cv::COLOR_BayerGB2GRAY},
    {"bayer_rggb16", 2, CV_8UC1, cv::COLOR_BayerBG2GRAY},
    {"bayer_bggr16", 2, CV_8UC1, cv::COLOR_BayerRG2GRAY},
    {"bayer_gbrg16", 2, CV_8UC1, cv::COLOR_BayerGR2GRAY},
    {"bayer_grbg16", 2, CV_8UC1, cv::COLOR_BayerGB2GRAY},
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

// The 16-bit values of a picture, narrowed.
cv::Mat Narrowed(const RawImage& raw, int type, GreyDepth* depth) {
  cv::Mat narrow(raw.height, raw.width, type);
  const std::size_t high = raw.big_endian ? 0 : 1;
  const std::size_t per_row = static_cast<std::size_t>(raw.width) * narrow.elemSize();
  std::vector<std::uint16_t> values;
  values.reserve(per_row * static_cast<std::size_t>(raw.height));
  for (int row = 0; row < raw.height; ++row) {
    const std::uint8_t* source = raw.data->data() + static_cast<std::size_t>(row) * raw.row_bytes;
    for (std::size_t i = 0; i < 2 * per_row; i += 2) {
      values.push_back(static_cast<std::uint16_t>(source[i + high] << 8U | source[i + 1 - high]));
    }
  }
  depth->Narrow(values, narrow.data);
  return narrow;
}

}  // namespace

std::optional<GrayImage> DecodeImage(const std::vector<std::uint8_t>& bytes, GreyDepth* depth) {
  constexpr std::uint8_t kJpeg = 0xff, kPng = 0x89;
  if (bytes.empty()) return std::nullopt;
  if (bytes[0] == kJpeg) return DecodeJpeg(bytes);
  if (bytes[0] == kPng) return DecodePng(bytes, depth);
  return DecodePnm(bytes, depth);
}

std::optional<GrayImage> DecodeImageFile(const std::filesystem::path& path, GreyDepth* depth) {
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  std::error_code error;
  std::vector<std::uint8_t> bytes(std::filesystem::file_size(path, error));
  if (error) return std::nullopt;
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return DecodeImage(bytes, depth);
}

Expected<GrayImage> ConvertImage(const RawImage& raw, GreyDepth* depth) {
  const Encoding* encoding = nullptr;
  for (const Encoding& known : kEncodings) {
    if (raw.encoding == known.name) encoding = &known;
  }
  if (encoding == nullptr) {
    return Error{
        fmt::format("image encoding '{}' is not supported; expected mono8, mono16, bgr8, rgb8, bgra8, rgba8, "
                    "bgr16, rgb16, yuv422, nv21 or Bayer",
                    raw.encoding)};
  }
  const std::size_t row_needs = static_cast<std::size_t>(raw.width) *
                                static_cast<std::size_t>(CV_MAT_CN(encoding->type) * encoding->bytes_per_value);
  const std::size_t height = static_cast<std::size_t>(raw.height);
  if (raw.width <= 0 || raw.height <= 0 || raw.row_bytes < row_needs || raw.data->size() / height < raw.row_bytes) {
    return Error{fmt::format("image of {} bytes with step {} is too short for {}x{} {}", raw.data->size(),
                             raw.row_bytes, raw.width, raw.height, raw.encoding)};
  }
  // cv::Mat has no view of constant memory; nothing here writes through it.
  auto* bytes = const_cast<std::uint8_t*>(raw.data->data());
  const cv::Mat rows = encoding->bytes_per_value == 2
                           ? Narrowed(raw, encoding->type, depth)
                           : cv::Mat(raw.height, raw.width, encoding->type, bytes, raw.row_bytes);
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
