// Our orientation and descriptors against cv::ORB's own, bit for bit.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <utility>
#include <vector>

#include "planar_vslam/feature/instruction_set.h"
#include "support/support.h"
#include "test_images.h"

namespace planar_vslam {
namespace {

using test::ExtractFrom;
using test::RandomRectangles;

constexpr int kMargin = 19;  // px; the extractor's own margin, so that cv::ORB drops none of its keypoints
constexpr float kRadiansPerDegree = static_cast<float>(M_PI / 180.0);

Descriptor ToDescriptor(const cv::Mat& descriptors, int row) {
  Descriptor descriptor;
  std::memcpy(descriptor.data(), descriptors.ptr(row), sizeof descriptor);
  return descriptor;
}

// The float in degrees that is exactly `radians` after OpenCV's conversion.
float DegreesThatGive(float radians) {
  float degrees = std::nextafter(std::nextafter(radians / kRadiansPerDegree, -1.0F), -1.0F);
  for (int i = 0; i < 5 && degrees * kRadiansPerDegree != radians; ++i) degrees = std::nextafter(degrees, 1e3F);
  EXPECT_EQ(degrees * kRadiansPerDegree, radians);
  return degrees;
}

// The pixel of `level` at which a keypoint was found.
cv::Point2f LevelPixel(const Keypoint& keypoint, const cv::Size& image, const cv::Size& level) {
  const double x = (keypoint.raw_pixel.x() + 0.5) * level.width / image.width - 0.5;
  const double y = (keypoint.raw_pixel.y() + 0.5) * level.height / image.height - 0.5;
  EXPECT_NEAR(x, std::round(x), 1e-3);
  EXPECT_NEAR(y, std::round(y), 1e-3);
  return {static_cast<float>(std::round(x)), static_cast<float>(std::round(y))};
}

// cv::ORB describes `level` at the places and angles of our keypoints of that octave.
void ExpectSameDescriptors(const FrameFeatures& features, int octave, const cv::Size& image, const cv::Mat& level) {
  std::vector<cv::KeyPoint> keypoints;
  std::vector<Descriptor> ours;
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    const Keypoint& keypoint = features.keypoints[i];
    if (keypoint.octave != octave) continue;
    keypoints.emplace_back(LevelPixel(keypoint, image, level.size()), 31.0F, DegreesThatGive(keypoint.angle),
                           keypoint.response, 0, static_cast<int>(ours.size()));
    ours.push_back(features.descriptors[i]);
  }
  ASSERT_FALSE(keypoints.empty()) << "octave " << octave;
  cv::Mat descriptors;
  cv::ORB::create(1000, 1.2F, 1, kMargin)->compute(level, keypoints, descriptors);
  ASSERT_EQ(keypoints.size(), ours.size()) << "octave " << octave;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    ASSERT_EQ(keypoints[i].class_id, static_cast<int>(i));
    EXPECT_EQ(ToDescriptor(descriptors, static_cast<int>(i)), ours[i]) << "octave " << octave << " keypoint " << i;
  }
}

void ExpectSameOnAllLevels(const cv::Mat& image) {
  const OrbOptions options;
  const FrameFeatures features = ExtractFrom(image, options);
  cv::Mat level = image;
  int octave = 0;
  for (const double scale : options.ScaleFactors()) {
    const cv::Size size(cvRound(image.cols / scale), cvRound(image.rows / scale));
    cv::Mat resized;
    cv::resize(level, resized, size, 0.0, 0.0, cv::INTER_LINEAR);
    level = resized;
    ExpectSameDescriptors(features, octave++, image.size(), level);
  }
}

// cv::ORB's whole pipeline on level 0, from detection to descriptor, wherever both picked the same corner.
int ExpectSameAsWholePipeline(const cv::Mat& image) {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::ORB::create(100000, 1.2F, 1, kMargin, 0, 2, cv::ORB::FAST_SCORE, 31, 7)
      ->detectAndCompute(image, cv::noArray(), keypoints, descriptors);
  std::map<std::pair<float, float>, int> row_at;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    row_at[{keypoints[i].pt.x, keypoints[i].pt.y}] = static_cast<int>(i);
  }
  const FrameFeatures features = ExtractFrom(image);
  int shared = 0;
  for (std::size_t i = 0; i < features.keypoints.size() && features.keypoints[i].octave == 0; ++i) {
    const auto found = row_at.find({features.keypoints[i].raw_pixel.x(), features.keypoints[i].raw_pixel.y()});
    if (found == row_at.end()) continue;
    ++shared;
    const cv::KeyPoint& theirs = keypoints[static_cast<std::size_t>(found->second)];
    EXPECT_EQ(theirs.angle * kRadiansPerDegree, features.keypoints[i].angle);
    EXPECT_EQ(theirs.response, features.keypoints[i].response);
    EXPECT_EQ(ToDescriptor(descriptors, found->second), features.descriptors[i]);
  }
  return shared;
}

// We blur with fused multiply-add everywhere. OpenCV does where the processor has it; elsewhere it rounds a few pixels
// in a million the other way.
bool OpenCvFuses() {
#if defined(__x86_64__)
  return BestInstructionSet() == InstructionSet::kAvx2;
#else
  return true;
#endif
}
constexpr const char* kNotFused = "without fused multiply-add OpenCV rounds differently";

TEST(OrbCompatibility, DescriptorsOfEveryLevel) {
  if (!OpenCvFuses()) GTEST_SKIP() << kNotFused;
  for (const unsigned seed : {1U, 2U}) ExpectSameOnAllLevels(RandomRectangles(640, 480, 600, seed));
  ExpectSameOnAllLevels(RandomRectangles(1241, 376, 600, 3));
}

TEST(OrbCompatibility, WholePipelineOnLevelZero) {
  if (!OpenCvFuses()) GTEST_SKIP() << kNotFused;
  for (const unsigned seed : {4U, 5U}) {
    EXPECT_GT(ExpectSameAsWholePipeline(RandomRectangles(640, 480, 600, seed)), 200);
  }
}

// Asked for more keypoints than there are, the extractor gives all its corners: those of one search of the whole image
// at the low threshold, less the ones below the high threshold that have a stronger one in their cell.
TEST(OrbCompatibility, CornersAreThoseOfOneSearchOfTheImage) {
  cv::Mat image = 0.15 * RandomRectangles(640, 480, 900, 6) + 100;
  RandomRectangles(320, 480, 300, 7).copyTo(image(cv::Rect(160, 0, 320, 480)));
  OrbOptions options;
  options.level_count = 1;
  options.feature_count = 1000000;
  std::map<std::pair<float, float>, float> ours;
  for (const Keypoint& keypoint : ExtractFrom(image, options).keypoints) {
    ours[{keypoint.raw_pixel.x(), keypoint.raw_pixel.y()}] = keypoint.response;
  }
  std::vector<cv::KeyPoint> all;
  cv::FAST(image, all, options.fast_min_threshold, true);
  const cv::Rect2f inner(kMargin, kMargin, 640 - 2 * kMargin, 480 - 2 * kMargin);
  std::size_t known = 0, weak = 0;
  for (const cv::KeyPoint& corner : all) {
    const auto found = ours.find({corner.pt.x, corner.pt.y});
    if (found == ours.end()) {
      EXPECT_TRUE(!inner.contains(corner.pt) || corner.response < static_cast<float>(options.fast_threshold));
      continue;
    }
    EXPECT_EQ(found->second, corner.response);
    ++known;
    if (corner.response < static_cast<float>(options.fast_threshold)) ++weak;
  }
  EXPECT_EQ(known, ours.size());
  EXPECT_GT(weak, 100U);
  EXPECT_GT(known - weak, 100U);
}

TEST(OrbCompatibility, RecordedImage) {
  if (!OpenCvFuses()) GTEST_SKIP() << kNotFused;
  const auto folder = test::SequenceFolder("dev_lab");
  if (!folder) GTEST_SKIP() << "sequence dev_lab is not on this machine";
  const cv::Mat image = cv::imread((*folder / "images/000100.jpg").string(), cv::IMREAD_GRAYSCALE);
  ASSERT_FALSE(image.empty());
  ExpectSameOnAllLevels(image);
  EXPECT_GT(ExpectSameAsWholePipeline(image), 150);
}

}  // namespace
}  // namespace planar_vslam
