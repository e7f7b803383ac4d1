#include "planar_vslam/feature/orb_extractor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <tuple>
#include <utility>

#include "planar_vslam/geometry/angles.h"
#include "test_images.h"

namespace planar_vslam {
namespace {

using test::ExtractFrom;
using test::PinholeCamera;
using test::RandomRectangles;
using test::SameFeatures;
using test::ToGray;

TEST(OrbOptions, DefaultsHaveNoProblems) { EXPECT_TRUE(OrbOptions{}.Problems().empty()); }

TEST(OrbOptions, EachBadFieldIsNamed) {
  OrbOptions options;
  options.feature_count = 0;
  options.scale_factor = 1.0;
  options.level_count = 0;
  options.fast_threshold = 0;
  options.fast_min_threshold = 5;
  options.cell_pixels = 1;
  const std::vector<std::string> problems = options.Problems();
  ASSERT_EQ(problems.size(), 6U);
  EXPECT_EQ(problems[0], "feature_count is 0; expected at least 1");
  EXPECT_EQ(problems[1], "scale_factor is 1; expected more than 1 and at most 2");
  EXPECT_EQ(problems[4], "fast_min_threshold is 5; expected at least 1 and at most fast_threshold (0)");
  options = OrbOptions{};
  options.scale_factor = std::nan("");
  EXPECT_EQ(options.Problems().size(), 1U);
}

TEST(OrbOptions, ScaleFactorsArePowers) {
  OrbOptions options;
  options.scale_factor = 1.5;
  options.level_count = 3;
  EXPECT_EQ(options.ScaleFactors(), (std::vector<double>{1.0, 1.5, 2.25}));
}

TEST(OrbExtractor, SameImageSameBytes) {
  const cv::Mat image = RandomRectangles(640, 480, 600, 1), other = RandomRectangles(320, 400, 100, 2);
  OrbExtractor extractor(OrbOptions{}, PinholeCamera(640, 480));
  const FrameFeatures first = extractor.Extract(ToGray(image));
  extractor.Extract(ToGray(other));  // leaves nothing behind
  EXPECT_TRUE(SameFeatures(first, extractor.Extract(ToGray(image))));
  OrbExtractor moved = std::move(extractor);
  EXPECT_TRUE(SameFeatures(first, moved.Extract(ToGray(image))));
  EXPECT_TRUE(SameFeatures(first, ExtractFrom(image)));
}

TEST(OrbExtractor, CountIsMetAndNeverExceeded) {
  const GrayImage image = ToGray(RandomRectangles(640, 480, 800, 3));
  OrbExtractor extractor(OrbOptions{}, PinholeCamera(640, 480));
  EXPECT_TRUE(extractor.Extract(image, 0).keypoints.empty());
  for (const std::size_t count : {1U, 2U, 10U, 300U, 1000U, 1500U}) {
    const FrameFeatures features = extractor.Extract(image, static_cast<int>(count));
    EXPECT_LE(features.keypoints.size(), count);
    EXPECT_GE(features.keypoints.size(), count - count / 50);
    EXPECT_EQ(features.descriptors.size(), features.keypoints.size());
  }
}

TEST(OrbExtractor, LevelsShareByArea) {
  OrbOptions options;
  options.feature_count = 500;
  const FrameFeatures features = ExtractFrom(RandomRectangles(640, 480, 800, 4), options);
  std::map<int, double> count;
  for (const Keypoint& keypoint : features.keypoints) count[keypoint.octave] += 1.0;
  for (int octave = 0; octave + 1 < 4; ++octave) EXPECT_NEAR(count[octave] / count[octave + 1], 1.44, 0.15) << octave;
  EXPECT_TRUE(std::is_sorted(features.keypoints.begin(), features.keypoints.end(),
                             [](const Keypoint& a, const Keypoint& b) { return a.octave < b.octave; }));
}

TEST(OrbExtractor, NoTwoKeypointsOfALevelCoincide) {
  const FrameFeatures features = ExtractFrom(RandomRectangles(640, 480, 800, 5));
  std::set<std::tuple<int, float, float>> places;
  for (const Keypoint& keypoint : features.keypoints) {
    places.insert({keypoint.octave, keypoint.raw_pixel.x(), keypoint.raw_pixel.y()});
  }
  EXPECT_EQ(places.size(), features.keypoints.size());
}

// Share of the 8 x 6 cells of a 640x480 image, without its rim, that hold a keypoint.
double Coverage(const FrameFeatures& features) {
  std::set<std::pair<int, int>> cells;
  for (const Keypoint& keypoint : features.keypoints) {
    cells.insert({static_cast<int>((keypoint.pixel.x() - 16.0F) / 76.0F),
                  static_cast<int>((keypoint.pixel.y() - 16.0F) / 75.0F)});
  }
  return static_cast<double>(cells.size()) / 48.0;
}

TEST(OrbExtractor, KeypointsCoverTheImageEvenly) {
  // Strong texture in the left third, faint texture elsewhere: the strong corners alone would take all places.
  const cv::Mat strong = RandomRectangles(640, 480, 3000, 6);
  cv::Mat image = 0.15 * RandomRectangles(640, 480, 1500, 7) + 100;
  strong(cv::Rect(0, 0, 213, 480)).copyTo(image(cv::Rect(0, 0, 213, 480)));
  OrbOptions options;
  options.feature_count = 500;
  const FrameFeatures features = ExtractFrom(image, options);
  EXPECT_GT(Coverage(features), 0.95);
  const auto is_right = [](const Keypoint& keypoint) { return keypoint.pixel.x() > 230.0F; };
  const auto right = std::count_if(features.keypoints.begin(), features.keypoints.end(), is_right);
  EXPECT_GT(right, 200);
}

TEST(OrbExtractor, FaintCellsUseTheLowThreshold) {
  const cv::Mat faint = 0.12 * RandomRectangles(640, 480, 600, 8) + 100;
  const FrameFeatures features = ExtractFrom(faint);
  EXPECT_GT(features.keypoints.size(), 100U);
  for (const Keypoint& keypoint : features.keypoints) EXPECT_GE(keypoint.response, 7.0F);
  OrbOptions strict;
  strict.fast_min_threshold = strict.fast_threshold;
  EXPECT_LT(ExtractFrom(faint, strict).keypoints.size(), features.keypoints.size() / 2);
}

TEST(OrbExtractor, BlankSmallAndEmptyImagesGiveNothing) {
  EXPECT_TRUE(ExtractFrom(cv::Mat(480, 640, CV_8UC1, cv::Scalar(90))).keypoints.empty());
  OrbExtractor extractor(OrbOptions{}, PinholeCamera(640, 480));
  EXPECT_TRUE(extractor.Extract(GrayImage{}).keypoints.empty());
  GrayImage no_pixels;
  no_pixels.pixels = std::make_shared<const std::vector<std::uint8_t>>();
  EXPECT_TRUE(extractor.Extract(no_pixels).keypoints.empty());
  const cv::Mat texture = RandomRectangles(640, 480, 3000, 9);
  for (const int side : {1, 3, 20, 38, 39, 40, 44, 60}) {
    for (const cv::Size size : {cv::Size(side, side), cv::Size(side, 480), cv::Size(640, side)}) {
      const FrameFeatures features = extractor.Extract(ToGray(texture(cv::Rect(cv::Point(0, 0), size)).clone()));
      EXPECT_TRUE(side >= 39 || features.keypoints.empty()) << size;
    }
  }
}

TEST(OrbExtractor, WideAndTallImagesAreCovered) {
  const cv::Mat wide = RandomRectangles(1200, 200, 900, 10);
  cv::Mat tall;
  cv::rotate(wide, tall, cv::ROTATE_90_CLOCKWISE);
  for (const cv::Mat& image : {wide, tall}) {
    const FrameFeatures features = ExtractFrom(image);
    std::set<int> tenths;
    for (const Keypoint& keypoint : features.keypoints) {
      tenths.insert(static_cast<int>(keypoint.pixel.maxCoeff() / 120.0F));
    }
    EXPECT_GE(tenths.size(), 9U);
    EXPECT_GT(features.keypoints.size(), 900U);
  }
}

TEST(OrbExtractor, AngleTurnsWithTheImage) {
  const cv::Mat image = RandomRectangles(480, 480, 500, 11);
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);
  const FrameFeatures first = ExtractFrom(image), second = ExtractFrom(turned);
  std::map<std::pair<float, float>, std::size_t> at;
  for (std::size_t i = 0; i < second.keypoints.size() && second.keypoints[i].octave == 0; ++i) {
    at[{second.keypoints[i].raw_pixel.x(), second.keypoints[i].raw_pixel.y()}] = i;
  }
  std::vector<int> distances;
  for (std::size_t i = 0; i < first.keypoints.size() && first.keypoints[i].octave == 0; ++i) {
    const Keypoint& keypoint = first.keypoints[i];
    EXPECT_GE(keypoint.angle, 0.0F);
    EXPECT_LT(keypoint.angle, 2.0 * M_PI);
    const auto found = at.find({479.0F - keypoint.raw_pixel.y(), keypoint.raw_pixel.x()});
    if (found == at.end()) continue;
    const double change = static_cast<double>(second.keypoints[found->second].angle - keypoint.angle);
    // cv::fastAtan2 is good to 0.3 degrees.
    EXPECT_NEAR(WrapAngle(change - M_PI / 2.0), 0.0, DegreesToRadians(0.7));
    distances.push_back(HammingDistance(first.descriptors[i], second.descriptors[found->second]));
  }
  ASSERT_GT(distances.size(), 100U);
  std::nth_element(distances.begin(), distances.begin() + 50, distances.end());
  EXPECT_LT(distances[50], 15);
}

// Soft discs at known places, seen by all levels: the positions the levels report must agree, without a shift that
// grows with the octave.
TEST(OrbExtractor, CoarseLevelsAreNotShifted) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(60));
  std::mt19937 generator(12);
  std::uniform_real_distribution<double> jitter(0.0, 8.0);
  std::vector<Eigen::Vector2d> centers;
  for (int y = 90; y < 400; y += 50) {
    for (int x = 90; x < 560; x += 50) {
      const double center_x = x + jitter(generator), center_y = y + jitter(generator);
      centers.emplace_back(center_x, center_y);
    }
  }
  for (const Eigen::Vector2d& center : centers) {
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double squared = (Eigen::Vector2d(x, y) - center).squaredNorm();
        if (squared > 400.0) continue;
        image.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(60.0 + 180.0 * std::exp(-squared / (2.0 * 16.0)));
      }
    }
  }
  std::map<int, std::pair<Eigen::Vector2d, int>> error;  // sum and count of each octave
  for (const Keypoint& keypoint : ExtractFrom(image).keypoints) {
    for (const Eigen::Vector2d& center : centers) {
      const Eigen::Vector2d difference = keypoint.raw_pixel.cast<double>() - center;
      if (difference.norm() > 5.0) continue;
      auto& [sum, count] = error.try_emplace(keypoint.octave, Eigen::Vector2d::Zero(), 0).first->second;
      sum += difference;
      ++count;
    }
  }
  int octaves = 0;
  for (const auto& [octave, sum_and_count] : error) {
    if (sum_and_count.second < 20) continue;
    ++octaves;
    EXPECT_LT((sum_and_count.first / sum_and_count.second).norm(), 0.4) << "octave " << octave;
  }
  EXPECT_GE(octaves, 3);
}

TEST(OrbExtractor, PixelsAreUndistorted) {
  CameraModel camera = PinholeCamera(640, 480);
  camera.k1 = -0.28;
  camera.k2 = 0.07;
  camera.p1 = 0.0002;
  const FrameFeatures features =
      OrbExtractor(OrbOptions{}, camera).Extract(ToGray(RandomRectangles(640, 480, 600, 13)));
  float largest_shift = 0.0F;
  for (const Keypoint& keypoint : features.keypoints) {
    const Eigen::Vector2d back = camera.DistortPixel(keypoint.pixel.cast<double>());
    EXPECT_LT((back - keypoint.raw_pixel.cast<double>()).norm(), 0.01);
    largest_shift = std::max(largest_shift, (keypoint.pixel - keypoint.raw_pixel).norm());
  }
  EXPECT_GT(largest_shift, 10.0F);
  // The grid is over undistorted pixels.
  std::vector<int> found;
  features.grid.Search(features.keypoints, features.keypoints[0].pixel, 0.0F, 0, 0, &found);
  EXPECT_TRUE(std::find(found.begin(), found.end(), 0) != found.end());
}

}  // namespace
}  // namespace planar_vslam
