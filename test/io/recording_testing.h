#pragma once
// Small recordings for the tests, and what comes out of them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "planar_vslam/io/recording.h"

namespace planar_vslam::test {

constexpr int kTestWidth = 32, kTestHeight = 24;  // px

// Horizontal ramp, so that a decoded pixel can be recognised.
inline cv::Mat RampImage(int width = kTestWidth, int height = kTestHeight) {
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(4 * x);
  }
  return image;
}

inline void WriteText(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

// The error of opening, or an empty string.
inline std::string OpenError(const std::filesystem::path& path, const RecordingOptions& options = {}) {
  const auto recording = OpenRecording(path, options);
  return recording ? "" : recording.error().message;
}

inline void ExpectInError(const std::string& error, const std::vector<std::string>& parts) {
  EXPECT_FALSE(error.empty());
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  for (const std::string& part : parts)
    EXPECT_NE(error.find(part), std::string::npos) << "'" << part << "' in: " << error;
}

struct Replay {
  std::vector<CameraFrame> images;
  std::vector<OdometryReading> odometry;
  std::vector<LaserFrame> scans;
  std::vector<Timestamp> stamps;  // of all events in the order they came
  std::string order;              // o, l, i: their kinds
  RecordingInfo info;
  std::map<std::string, long> skipped;
  std::string error;  // of opening or reading on
};

inline void Take(CameraFrame frame, Replay* replay) {
  replay->order += 'i';
  replay->stamps.push_back(frame.image.stamp);
  replay->images.push_back(std::move(frame));
}
inline void Take(OdometryReading reading, Replay* replay) {
  replay->order += 'o';
  replay->stamps.push_back(reading.stamp);
  replay->odometry.push_back(reading);
}
inline void Take(LaserFrame frame, Replay* replay) {
  replay->order += 'l';
  replay->stamps.push_back(frame.scan.stamp);
  replay->scans.push_back(std::move(frame));
}

inline Replay Play(const std::filesystem::path& path, const RecordingOptions& options = {}) {
  Replay replay;
  auto recording = OpenRecording(path, options);
  if (!recording) {
    replay.error = recording.error().message;
    return replay;
  }
  replay.info = (*recording)->info();
  while (true) {
    auto event = (*recording)->Next();
    if (!event) {
      replay.error = event.error().message;
      break;
    }
    if (!event->has_value()) break;
    std::visit([&replay](auto&& content) { Take(std::move(content), &replay); }, std::move(**event));
  }
  replay.skipped = (*recording)->skipped();
  for (std::size_t i = 1; i < replay.stamps.size(); ++i) EXPECT_LE(replay.stamps[i - 1], replay.stamps[i]);
  return replay;
}

}  // namespace planar_vslam::test
