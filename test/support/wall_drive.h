#pragma once
// A robot drives along a textured wall and looks at it sideways, which shifts the picture by whole pixels: images,
// odometry and truth in a few lines, without rendering.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam::test {

class WallDrive {
 public:
  static constexpr int kWidth = 480, kHeight = 360, kPixelsPerImage = 2;
  static constexpr double kFocalLength = 400.0;                                    // px
  static constexpr double kWallDistance = 2.0;                                     // m
  static constexpr double kStep = kPixelsPerImage * kWallDistance / kFocalLength;  // m between images
  static constexpr std::int64_t kPeriod = 50'000'000;                              // ns between images

  // A wall long enough for so many images.
  explicit WallDrive(int images)
      : width_(kWidth + images * kPixelsPerImage), pixels_(static_cast<std::size_t>(width_) * kHeight, 128) {
    std::mt19937 generator(1);
    const auto below = [&generator](int end) { return static_cast<int>(generator() % static_cast<unsigned>(end)); };
    for (int i = 0; i < 15 * kHeight * width_ / (kWidth * 6); ++i) {
      const int left = below(width_), top = below(kHeight), side = 4 + below(30);
      const auto grey = static_cast<std::uint8_t>(below(256));
      for (int y = top; y < std::min(top + side, kHeight); ++y) {
        std::fill(At(left, y), At(std::min(left + side, width_), y), grey);
      }
    }
  }

  static CameraModel Camera() {
    return {kWidth, kHeight, kFocalLength, kFocalLength, kWidth / 2.0, kHeight / 2.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  }
  static Timestamp StampOf(int image) { return {100'000'000'000 + kPeriod * image}; }
  // T_world_base, and what faultless wheels say.
  static Rigid2 PoseOf(int image) { return {{kStep * image, 0.0}, 0.0}; }
  // The camera half a metre up, looking to the robot's left: x forward, y down.
  static Rigid3 CameraMount() {
    return {Eigen::Quaterniond(std::sqrt(0.5), -std::sqrt(0.5), 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, 0.5)};
  }

  std::vector<std::uint8_t> View(int image) const {
    std::vector<std::uint8_t> view;
    for (int y = 0; y < kHeight; ++y) {
      const auto begin = pixels_.begin() + static_cast<std::ptrdiff_t>(y) * width_ + image * kPixelsPerImage;
      view.insert(view.end(), begin, begin + kWidth);
    }
    return view;
  }
  // What image number `position` shows, as taken at the time of number `image`.
  CameraFrame FrameAt(int image, int position) const {
    auto pixels = std::make_shared<const std::vector<std::uint8_t>>(View(position));
    return {ImageFrame{StampOf(image), GrayImage{kWidth, kHeight, std::move(pixels)}}, CameraMount()};
  }
  static OdometryReading OdometryAt(int image, int position) { return {StampOf(image), PoseOf(position)}; }

 private:
  std::vector<std::uint8_t>::iterator At(int x, int y) {
    return pixels_.begin() + static_cast<std::ptrdiff_t>(y) * width_ + x;
  }

  int width_;  // px, of the wall
  std::vector<std::uint8_t> pixels_;
};

}  // namespace planar_vslam::test
