#include "planar_vslam/feature/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "corner_detector.h"
#include "orb_descriptor.h"
#include "planar_vslam/geometry/check.h"
#include "quadtree.h"

namespace planar_vslam {
namespace {

constexpr float kRadiansPerDegree = static_cast<float>(M_PI / 180.0);

}  // namespace

std::vector<double> OrbOptions::ScaleFactors() const {
  std::vector<double> factors;
  for (int octave = 0; octave < level_count; ++octave) factors.push_back(std::pow(scale_factor, octave));
  return factors;
}

struct OrbExtractor::Scratch {
  CornerDetector detector;
  Quadtree quadtree;
  PatchOrientation orientation;
  BriefPattern pattern;
  std::vector<cv::Mat> levels;            // level 0 shares the pixels of the image
  std::vector<cv::Mat> buffers;           // memory of the other levels
  cv::Mat blurred;                        // of the level at work
  std::vector<Corner> corners;            // of the level at work
  std::vector<std::vector<Corner>> kept;  // of each level

  void BuildPyramid(const cv::Mat& image, const std::vector<double>& scale_factors);
  void SelectCorners(const OrbOptions& options, int feature_count);
  void Describe(std::size_t octave, const CameraModel& camera, FrameFeatures* features);
};

// Levels too small to hold a patch are left out.
void OrbExtractor::Scratch::BuildPyramid(const cv::Mat& image, const std::vector<double>& scale_factors) {
  buffers.resize(scale_factors.size());
  levels.clear();
  for (std::size_t octave = 0; octave < scale_factors.size(); ++octave) {
    const cv::Size size(cvRound(image.cols / scale_factors[octave]), cvRound(image.rows / scale_factors[octave]));
    if (std::min(size.width, size.height) <= 2 * kOrbMargin) break;
    if (octave == 0) {
      levels.push_back(image);
    } else {
      cv::resize(levels.back(), buffers[octave], size, 0.0, 0.0, cv::INTER_LINEAR);
      levels.push_back(buffers[octave]);
    }
  }
}

// Each level gets its share by area. From coarse to fine: what a level cannot fill falls to the finer ones, which have
// more corners to offer.
void OrbExtractor::Scratch::SelectCorners(const OrbOptions& options, int feature_count) {
  const CornerThresholds thresholds{options.fast_threshold, options.fast_min_threshold, options.cell_pixels};
  kept.resize(levels.size());
  double area_left = 0.0;
  for (const cv::Mat& level : levels) area_left += static_cast<double>(level.total());
  int count_left = feature_count;
  for (std::size_t octave = levels.size(); octave-- > 0;) {
    const cv::Mat& level = levels[octave];
    const double area = static_cast<double>(level.total());
    const int count = octave == 0 ? count_left : cvRound(count_left * area / area_left);
    const cv::Rect inner(kOrbMargin, kOrbMargin, level.cols - 2 * kOrbMargin, level.rows - 2 * kOrbMargin);
    detector.Detect(level, inner, thresholds, &corners);
    quadtree.Thin(corners, inner, count, &kept[octave]);
    count_left -= static_cast<int>(kept[octave].size());
    area_left -= area;
  }
}

// Appends the keypoints of one level and their descriptors.
void OrbExtractor::Scratch::Describe(std::size_t octave, const CameraModel& camera, FrameFeatures* features) {
  if (kept[octave].empty()) return;
  const cv::Mat& level = levels[octave];
  BlurForBrief(level, &blurred);
  // cv::resize lines up the borders of pixels, not their centres: hence the half pixels.
  const Eigen::Array2d ratio(static_cast<double>(levels[0].cols) / level.cols,
                             static_cast<double>(levels[0].rows) / level.rows);
  for (const Corner& corner : kept[octave]) {
    const Eigen::Vector2d raw_pixel = (Eigen::Array2d(corner.x, corner.y) + 0.5) * ratio - 0.5;
    Keypoint keypoint;
    keypoint.raw_pixel = raw_pixel.cast<float>();
    keypoint.pixel = camera.distorted() ? camera.UndistortPixel(raw_pixel).cast<float>() : keypoint.raw_pixel;
    keypoint.angle = orientation.Degrees(level, corner.x, corner.y) * kRadiansPerDegree;
    keypoint.response = corner.response;
    keypoint.octave = static_cast<std::int32_t>(octave);
    features->keypoints.push_back(keypoint);
    features->descriptors.push_back(pattern.Describe(blurred, corner.x, corner.y, keypoint.angle));
  }
}

OrbExtractor::OrbExtractor(const OrbOptions& options, const CameraModel& camera)
    : options_(options), camera_(camera), scratch_(std::make_unique<Scratch>()) {
  const std::vector<std::string> problems = options.Problems();
  PV_CHECK(problems.empty(), problems.front());
}
OrbExtractor::~OrbExtractor() = default;
OrbExtractor::OrbExtractor(OrbExtractor&&) noexcept = default;
OrbExtractor& OrbExtractor::operator=(OrbExtractor&&) noexcept = default;

FrameFeatures OrbExtractor::Extract(const GrayImage& image) { return Extract(image, options_.feature_count); }

FrameFeatures OrbExtractor::Extract(const GrayImage& image, int feature_count) {
  FrameFeatures features;
  if (image.empty() || feature_count <= 0) return features;
  PV_CHECK(image.pixels->size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
           "width=" << image.width << " height=" << image.height << " pixels=" << image.pixels->size());
  // cv::Mat has no view of const pixels; nothing here writes to level 0.
  const cv::Mat view(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels->data()));
  scratch_->BuildPyramid(view, options_.ScaleFactors());
  scratch_->SelectCorners(options_, feature_count);
  features.keypoints.reserve(static_cast<std::size_t>(feature_count));
  features.descriptors.reserve(static_cast<std::size_t>(feature_count));
  for (std::size_t octave = 0; octave < scratch_->levels.size(); ++octave) {
    scratch_->Describe(octave, camera_, &features);
  }
  features.grid = ImageGrid(features.keypoints);
  return features;
}

}  // namespace planar_vslam
