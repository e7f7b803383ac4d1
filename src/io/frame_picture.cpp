#include "planar_vslam/io/frame_picture.h"

#include <opencv2/imgproc.hpp>

namespace planar_vslam::io {
namespace {

const cv::Scalar kGreen(80, 220, 60), kRed(60, 60, 255), kGrey(170, 170, 170), kWhite(255, 255, 255);
constexpr int kLineHeight = 18;  // px of a line of text

cv::Point ToPoint(double x, double y) { return {cvRound(x), cvRound(y)}; }
cv::Point PointOf(const Keypoint& keypoint) { return ToPoint(keypoint.raw_pixel.x(), keypoint.raw_pixel.y()); }

void DrawKeypoints(const FrameView& view, cv::Mat* image) {
  constexpr int kDot = 1, kRing = 3;  // px
  const std::vector<Keypoint>& keypoints = view.features->keypoints;
  for (const Keypoint& keypoint : keypoints) cv::circle(*image, PointOf(keypoint), kDot, kGrey, cv::FILLED);
  for (const std::size_t i : view.followed) cv::circle(*image, PointOf(keypoints[i]), kRing, kGreen);
  for (const FrameView::Refused& refused : view.refused) {
    const cv::Point seen = PointOf(keypoints[refused.keypoint]);
    cv::circle(*image, seen, kRing, kRed);
    cv::line(*image, seen, ToPoint(refused.expected.x(), refused.expected.y()), kRed);
  }
}

}  // namespace

ColorImage DrawFrame(const FrameView& view, const std::vector<std::string>& text) {
  if (view.image.empty()) return {};
  const cv::Size size(view.image.width, view.image.height);
  const cv::Mat grey(size, CV_8UC1, const_cast<std::uint8_t*>(view.image.pixels->data()));  // read only
  const int lines = static_cast<int>(text.size());
  ColorImage result{size.width, size.height + lines * kLineHeight, {}};
  result.bgr.resize(static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height) * 3);
  const cv::Mat canvas(result.height, result.width, CV_8UC3, result.bgr.data());
  cv::Mat image = canvas.rowRange(0, size.height);
  cv::cvtColor(grey, image, cv::COLOR_GRAY2BGR);
  if (view.features != nullptr) DrawKeypoints(view, &image);
  constexpr double kFont = 1.1;
  constexpr int kMargin = 4;  // px
  for (int line = 0; line < lines; ++line) {
    const cv::Point at(kMargin, size.height + (line + 1) * kLineHeight - kMargin);
    cv::putText(canvas, text[static_cast<std::size_t>(line)], at, cv::FONT_HERSHEY_PLAIN, kFont, kWhite);
  }
  return result;
}

}  // namespace planar_vslam::io
