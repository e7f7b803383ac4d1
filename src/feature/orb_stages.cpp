#include "orb_stages.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr float kRadiansPerDegree = static_cast<float>(M_PI / 180.0);

}  // namespace

// Levels too small to hold a patch are left out.
void OrbExtractor::Stages::BuildPyramid(const cv::Mat& image, const std::vector<double>& scale_factors) {
  resizers_.resize(scale_factors.size(), LevelResizer(set_));
  levels_.clear();
  for (std::size_t octave = 0; octave < scale_factors.size(); ++octave) {
    const cv::Size size(cvRound(image.cols / scale_factors[octave]), cvRound(image.rows / scale_factors[octave]));
    if (std::min(size.width, size.height) <= 2 * kOrbMargin) break;
    if (octave == 0) {
      levels_.push_back(image);
    } else {
      cv::Mat level;
      resizers_[octave].Resize(levels_.back(), size, &level);
      levels_.push_back(level);
    }
  }
}

// Each level gets its share by area. From coarse to fine: what a level cannot fill falls to the finer ones, which have
// more corners to offer.
void OrbExtractor::Stages::SelectCorners(const OrbOptions& options, int feature_count) {
  const CornerThresholds thresholds{options.fast_threshold, options.fast_min_threshold, options.cell_pixels};
  kept_.resize(levels_.size());
  double area_left = 0.0;
  for (const cv::Mat& level : levels_) area_left += static_cast<double>(level.total());
  int count_left = feature_count;
  for (std::size_t octave = levels_.size(); octave-- > 0;) {
    const cv::Mat& level = levels_[octave];
    const double area = static_cast<double>(level.total());
    const int count = octave == 0 ? count_left : cvRound(count_left * area / area_left);
    const cv::Rect inner(kOrbMargin, kOrbMargin, level.cols - 2 * kOrbMargin, level.rows - 2 * kOrbMargin);
    detector_.Detect(level, inner, thresholds, &corners_);
    quadtree_.Thin(corners_, inner, count, &kept_[octave]);
    count_left -= static_cast<int>(kept_[octave].size());
    area_left -= area;
  }
}

// Appends the keypoints of one level and their descriptors.
void OrbExtractor::Stages::Describe(std::size_t octave, const CameraModel& camera, FrameFeatures* features) {
  if (kept_[octave].empty()) return;
  const cv::Mat& level = levels_[octave];
  cv::Mat blurred;
  blur_.Apply(level, kept_[octave], kOrbReach, &blurred);
  // Resizing lines up the borders of pixels, not their centres: hence the half pixels.
  const Eigen::Array2d ratio(static_cast<double>(levels_[0].cols) / level.cols,
                             static_cast<double>(levels_[0].rows) / level.rows);
  for (const Corner& corner : kept_[octave]) {
    const Eigen::Vector2d raw_pixel = (Eigen::Array2d(corner.x, corner.y) + 0.5) * ratio - 0.5;
    const std::optional<Eigen::Vector2d> ideal = camera.UndistortPixel(raw_pixel);
    if (!ideal.has_value()) continue;
    Keypoint keypoint;
    keypoint.raw_pixel = raw_pixel.cast<float>();
    keypoint.pixel = ideal->cast<float>();
    keypoint.angle = orientation_.Degrees(level, corner.x, corner.y) * kRadiansPerDegree;
    keypoint.response = corner.response;
    keypoint.octave = static_cast<std::int32_t>(octave);
    features->keypoints.push_back(keypoint);
    features->descriptors.push_back(pattern_.Describe(blurred, corner.x, corner.y, keypoint.angle));
  }
}

FrameFeatures OrbExtractor::Stages::Extract(const cv::Mat& image, const OrbOptions& options, const CameraModel& camera,
                                            int feature_count) {
  FrameFeatures features;
  BuildPyramid(image, options.ScaleFactors());
  SelectCorners(options, feature_count);
  features.keypoints.reserve(static_cast<std::size_t>(feature_count));
  features.descriptors.reserve(static_cast<std::size_t>(feature_count));
  for (std::size_t octave = 0; octave < levels_.size(); ++octave) Describe(octave, camera, &features);
  features.grid = ImageGrid(features.keypoints);
  return features;
}

}  // namespace planar_vslam
