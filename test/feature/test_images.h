#pragma once
// Images, cameras and comparisons the feature tests share.
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "planar_vslam/feature/orb_extractor.h"

namespace planar_vslam::test {

// Overlapping rectangles of random grey on mid grey, slightly smoothed and noisy.
inline cv::Mat RandomRectangles(int width, int height, int count, unsigned seed) {
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  std::mt19937 generator(seed);
  std::uniform_int_distribution<int> x(0, width - 1), y(0, height - 1), side(5, 60), grey(20, 235), noise(-2, 2);
  for (int i = 0; i < count; ++i) {
    const int left = x(generator), top = y(generator), box_width = side(generator), box_height = side(generator);
    cv::rectangle(image, cv::Rect(left, top, box_width, box_height), cv::Scalar(grey(generator)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, cv::Size(3, 3), 0.8);
  for (auto pixel = image.begin<std::uint8_t>(); pixel != image.end<std::uint8_t>(); ++pixel) {
    *pixel = static_cast<std::uint8_t>(*pixel + noise(generator));
  }
  return image;
}

inline GrayImage ToGray(const cv::Mat& image) {
  GrayImage gray;
  gray.width = image.cols;
  gray.height = image.rows;
  gray.pixels =
      std::make_shared<const std::vector<std::uint8_t>>(image.begin<std::uint8_t>(), image.end<std::uint8_t>());
  return gray;
}

inline CameraModel PinholeCamera(int width, int height) {
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 500.0;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

inline FrameFeatures ExtractFrom(const cv::Mat& image, const OrbOptions& options = OrbOptions{}) {
  return OrbExtractor(options, PinholeCamera(image.cols, image.rows)).Extract(ToGray(image));
}

inline bool SameFeatures(const FrameFeatures& a, const FrameFeatures& b) {
  if (a.keypoints.size() != b.keypoints.size() || a.descriptors != b.descriptors) return false;
  for (std::size_t i = 0; i < a.keypoints.size(); ++i) {
    const Keypoint &p = a.keypoints[i], &q = b.keypoints[i];
    if (p.pixel != q.pixel || p.raw_pixel != q.raw_pixel || p.angle != q.angle || p.response != q.response ||
        p.octave != q.octave) {
      return false;
    }
  }
  return true;
}

}  // namespace planar_vslam::test
