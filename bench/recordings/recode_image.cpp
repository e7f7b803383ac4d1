#include "recode_image.h"

#include <functional>
#include <map>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace planar_vslam::bench {
namespace {

using Form = std::function<void(const cv::Mat& grey, sensor_msgs::Image* image)>;

void Put(const std::string& encoding, const cv::Mat& pixels, sensor_msgs::Image* image) {
  image->encoding = encoding;
  image->step = static_cast<std::uint32_t>(pixels.step[0]);
  image->data.assign(pixels.datastart, pixels.dataend);
}

cv::Mat Channels(const std::vector<cv::Mat>& channels) {
  cv::Mat merged;
  cv::merge(channels, merged);
  return merged;
}

// A picture in colour whose luma is the grey one's: warm light, cold shadow.
std::vector<cv::Mat> BlueGreenRed(const cv::Mat& grey) {
  constexpr double kTint = 0.12;  // of the grey level
  constexpr double kRed = 0.299, kBlue = 0.114;
  cv::Mat blue, red;
  cv::addWeighted(grey, 1.0 - kTint * kRed / kBlue, grey, 0.0, 0.0, blue);
  cv::addWeighted(grey, 1.0 + kTint, grey, 0.0, 0.0, red);
  return {blue, grey, red};
}

Form Colour(const std::string& encoding, const std::vector<int>& order) {
  return [encoding, order](const cv::Mat& grey, sensor_msgs::Image* image) {
    const std::vector<cv::Mat> bgr = BlueGreenRed(grey);
    const cv::Mat opaque(grey.rows, grey.cols, CV_8UC1, cv::Scalar(255));
    std::vector<cv::Mat> channels;
    channels.reserve(order.size());
    for (const int channel : order) channels.push_back(channel < 3 ? bgr[static_cast<std::size_t>(channel)] : opaque);
    Put(encoding, Channels(channels), image);
  };
}

// Values of so many bits in the low bits of 16.
Form Deep(const std::string& encoding, int bits, bool big_endian = false) {
  return [encoding, bits, big_endian](const cv::Mat& grey, sensor_msgs::Image* image) {
    cv::Mat wide;
    grey.convertTo(wide, CV_16UC1, 1 << (bits - 8));
    if (big_endian) wide.forEach<std::uint16_t>([](std::uint16_t& v, const int*) { v = __builtin_bswap16(v); });
    image->is_bigendian = big_endian ? 1 : 0;
    Put(encoding, wide, image);
  };
}

// Where a pixel lacks a colour the grey stands for it.
Form Single(const std::string& encoding) {
  return [encoding](const cv::Mat& grey, sensor_msgs::Image* image) { Put(encoding, grey, image); };
}

Form Yuv(const std::string& encoding, bool grey_first) {
  return [encoding, grey_first](const cv::Mat& grey, sensor_msgs::Image* image) {
    const cv::Mat no_colour(grey.rows, grey.cols, CV_8UC1, cv::Scalar(128));
    Put(encoding, grey_first ? Channels({grey, no_colour}) : Channels({no_colour, grey}), image);
  };
}

void Planes(const cv::Mat& grey, sensor_msgs::Image* image) {
  Put("nv21", grey, image);
  image->data.resize(image->data.size() * 3 / 2, 128);
}

void Padded(const cv::Mat& grey, sensor_msgs::Image* image) {
  constexpr int kPadding = 64;  // bytes a row
  cv::Mat wider(grey.rows, grey.cols + kPadding, CV_8UC1, cv::Scalar(255));
  grey.copyTo(wider.colRange(0, grey.cols));
  Put("mono8", wider, image);
}

void Stepless(const cv::Mat& grey, sensor_msgs::Image* image) {
  Put("mono8", grey, image);
  image->step = 0;
}

void Floats(const cv::Mat& grey, sensor_msgs::Image* image) {
  cv::Mat wide;
  grey.convertTo(wide, CV_32FC1, 1.0 / 255.0);
  Put("32FC1", wide, image);
}

const std::map<std::string, Form>& Forms() {
  static const std::map<std::string, Form> forms = {
      {"mono8", Single("mono8")},
      {"8UC1", Single("8UC1")},
      {"bgr8", Colour("bgr8", {0, 1, 2})},
      {"rgb8", Colour("rgb8", {2, 1, 0})},
      {"bgra8", Colour("bgra8", {0, 1, 2, 3})},
      {"rgba8", Colour("rgba8", {2, 1, 0, 3})},
      {"mono16", Deep("mono16", 16)},
      {"mono16-10bit", Deep("mono16", 10)},
      {"mono16-12bit", Deep("mono16", 12)},
      {"mono16-bigendian", Deep("mono16", 16, true)},
      {"16UC1-12bit", Deep("16UC1", 12)},
      {"yuv422", Yuv("yuv422", false)},
      {"yuv422_yuy2", Yuv("yuv422_yuy2", true)},
      {"nv21", Planes},
      {"bayer_rggb8", Single("bayer_rggb8")},
      {"bayer_grbg8", Single("bayer_grbg8")},
      {"bayer_rggb16-12bit", Deep("bayer_rggb16", 12)},
      {"padded", Padded},
      {"stepless", Stepless},
      {"32FC1", Floats},
  };
  return forms;
}

}  // namespace

std::vector<std::string> ImageForms() {
  std::vector<std::string> names;
  for (const auto& [name, form] : Forms()) names.push_back(name);
  return names;
}

void ToImage(const cv::Mat& grey, const std::string& form, sensor_msgs::Image* image) {
  const auto found = Forms().find(form);
  if (found == Forms().end()) throw std::invalid_argument(form + ": no such form of an image");
  found->second(grey, image);
}

}  // namespace planar_vslam::bench
