// Every set of instructions this processor has gives the same bits, those of a plain statement of the method or of
// OpenCV.
#include <gtest/gtest.h>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "brief_blur.h"
#include "corner_detector.h"

#include "level_resizer.h"
#include "orb_descriptor.h"
#include "orb_stages.h"
#include "planar_vslam/feature/hamming.h"
#include "planar_vslam/feature/instruction_set.h"
#include "support/support.h"
#include "test_images.h"

namespace planar_vslam {
namespace {

using test::RandomRectangles;

// Independent grey levels in [low, high].
cv::Mat Noise(int width, int height, int low, int high, unsigned seed) {
  cv::Mat image(height, width, CV_8UC1);
  std::mt19937 generator(seed);
  std::uniform_int_distribution<int> grey(low, high);
  for (auto pixel = image.begin<std::uint8_t>(); pixel != image.end<std::uint8_t>(); ++pixel) {
    *pixel = static_cast<std::uint8_t>(grey(generator));
  }
  return image;
}

// Odd sizes, the smallest ones, extremes of brightness, views of a part of an image, and a recorded image if there is
// one.
std::vector<cv::Mat> Images() {
  std::vector<cv::Mat> images{RandomRectangles(640, 480, 600, 1), RandomRectangles(333, 217, 300, 2)};
  for (const int side : {39, 40, 41, 47, 63, 64, 65, 71}) {
    images.push_back(Noise(side, 41, 0, 255, static_cast<unsigned>(side)));
    images.push_back(Noise(39, side, 90, 130, static_cast<unsigned>(side)));
  }
  images.push_back(Noise(151, 90, 0, 1, 3) * 255);
  images.push_back(cv::Mat(77, 83, CV_8UC1, cv::Scalar(255)));
  images.push_back(images[0](cv::Rect(13, 7, 301, 203)));
  if (const auto folder = test::SequenceFolder("dev_lab")) {
    images.push_back(cv::imread((*folder / "images/000100.jpg").string(), cv::IMREAD_GRAYSCALE));
  }
  return images;
}

cv::Rect Inside(const cv::Mat& image, int margin) {
  return {margin, margin, image.cols - 2 * margin, image.rows - 2 * margin};
}

// The contrast as corner_kernel.h defines it, one pixel at a time.
int ContrastAt(const cv::Mat& image, int x, int y) {
  const std::array<cv::Point, 16> circle{{{0, 3},
                                          {1, 3},
                                          {2, 2},
                                          {3, 1},
                                          {3, 0},
                                          {3, -1},
                                          {2, -2},
                                          {1, -3},
                                          {0, -3},
                                          {-1, -3},
                                          {-2, -2},
                                          {-3, -1},
                                          {-3, 0},
                                          {-3, 1},
                                          {-2, 2},
                                          {-1, 3}}};
  int contrast = 0;
  for (std::size_t first = 0; first < circle.size(); ++first) {
    int brighter = 255, darker = 255;
    for (std::size_t k = 0; k < 9; ++k) {
      const cv::Point neighbor = cv::Point(x, y) + circle[(first + k) % circle.size()];
      const int difference = image.at<std::uint8_t>(neighbor) - image.at<std::uint8_t>(y, x);
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    contrast = std::max({contrast, brighter, darker});
  }
  return contrast;
}

TEST(InstructionSets, ContrastIsWhatItsDefinitionSays) {
  for (const cv::Mat& image : {Noise(70, 30, 0, 255, 1), Noise(39, 9, 100, 140, 2), RandomRectangles(203, 60, 80, 3)}) {
    for (const int threshold : {1, 7, 20, 100, 254}) {
      for (const InstructionSet set : UsableInstructionSets()) {
        const CornerKernel kernel = CornerKernelOf(set);
        std::vector<std::uint8_t> contrast(static_cast<std::size_t>(image.cols));
        std::vector<int> blocks(static_cast<std::size_t>(image.cols));
        for (int y = kCircleRadius; y < image.rows - kCircleRadius; ++y) {
          const ContrastStretch stretch{image.ptr<std::uint8_t>(y), static_cast<std::ptrdiff_t>(image.step[0]),
                                        image.cols, kCircleRadius, image.cols - kCircleRadius};
          const int count =
              kernel.find_contrast(stretch, static_cast<std::uint8_t>(threshold), contrast.data(), blocks.data());
          for (int x = stretch.begin; x < stretch.end; ++x) {
            const int truth = ContrastAt(image, x, y);
            ASSERT_EQ(contrast[static_cast<std::size_t>(x)], truth > threshold ? truth : 0) << cv::Point(x, y);
            const bool is_listed = std::any_of(blocks.begin(), blocks.begin() + count,
                                               [&](int block) { return block <= x && x < block + kContrastBlock; });
            ASSERT_TRUE(is_listed || truth <= threshold) << cv::Point(x, y);
          }
        }
      }
    }
  }
}

TEST(InstructionSets, Corners) {
  for (const cv::Mat& image : Images()) {
    for (const CornerThresholds& thresholds : {CornerThresholds{20, 7, 30}, {254, 1, 8}, {40, 40, 1000}}) {
      std::vector<Corner> expected;
      for (const InstructionSet set : UsableInstructionSets()) {
        std::vector<Corner> corners;
        CornerDetector(set).Detect(image, Inside(image, CornerDetector::kMargin), thresholds, &corners);
        if (set == InstructionSet::kPlain) expected = corners;
        ASSERT_EQ(corners.size(), expected.size());
        for (std::size_t i = 0; i < corners.size(); ++i) {
          ASSERT_EQ(corners[i].x, expected[i].x);
          ASSERT_EQ(corners[i].y, expected[i].y);
          ASSERT_EQ(corners[i].response, expected[i].response);
        }
      }
    }
  }
}

int Reflect(int i, int size) { return i < 0 ? -i : (i < size ? i : 2 * (size - 1) - i); }

// A 7x7 Gaussian as brief_blur.h states it.
cv::Mat FusedBlur(const cv::Mat& image) {
  const cv::Mat kernel = cv::getGaussianKernel(7, 2.0, CV_32F);
  cv::Mat sums(image.size(), CV_32F), blurred(image.size(), CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      float sum = 0.0F;
      for (int u = -3; u <= 3; ++u) {
        const auto pixel = static_cast<float>(image.at<std::uint8_t>(y, Reflect(x + u, image.cols)));
        sum = std::fma(pixel, kernel.at<float>(3 + u), sum);
      }
      sums.at<float>(y, x) = sum;
    }
  }
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      float sum = sums.at<float>(y, x) * kernel.at<float>(3);
      for (int v = 1; v <= 3; ++v) {
        const float pair =
            sums.at<float>(Reflect(y - v, image.rows), x) + sums.at<float>(Reflect(y + v, image.rows), x);
        sum = std::fma(pair, kernel.at<float>(3 + v), sum);
      }
      blurred.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::nearbyint(sum));
    }
  }
  return blurred;
}

TEST(InstructionSets, BlurAlsoOfPixelsNextToATie) {
  std::vector<cv::Mat> images = Images();
  images.push_back(Noise(1000, 1000, 0, 255, 4));  // about 1,000 pixels so close to a tie that the order decides
  images.push_back(Noise(4, 4, 0, 255, 5));
  images.push_back(Noise(131, 5, 120, 123, 6));
  for (const cv::Mat& image : images) {
    const cv::Mat expected = FusedBlur(image);
    const std::vector<Corner> everywhere{{image.cols / 2, image.rows / 2, 0.0F}};
    for (const InstructionSet set : UsableInstructionSets()) {
      cv::Mat blurred;
      BriefBlur blur(set);
      blur.Apply(image, everywhere, 1000, &blurred);
      ASSERT_EQ(blurred.size(), image.size());
      EXPECT_EQ(cv::countNonZero(blurred != expected), 0) << image.size() << " set " << static_cast<int>(set);
    }
  }
}

TEST(InstructionSets, BlurNearCornersOnly) {
  constexpr int kReach = 9;
  const cv::Mat image = RandomRectangles(333, 217, 300, 7);
  const cv::Mat expected = FusedBlur(image);
  const std::vector<Corner> corners{{0, 0, 0.0F}, {40, 3, 0.0F}, {332, 60, 0.0F}, {100, 61, 0.0F}, {7, 216, 0.0F}};
  for (const InstructionSet set : UsableInstructionSets()) {
    BriefBlur blur(set);
    cv::Mat blurred;
    blur.Apply(RandomRectangles(640, 480, 600, 8), {{300, 200, 0.0F}}, 1000, &blurred);  // leaves nothing behind
    blur.Apply(image, corners, kReach, &blurred);
    for (const Corner& corner : corners) {
      const cv::Rect near =
          cv::Rect(corner.x - kReach, corner.y - kReach, 2 * kReach + 1, 2 * kReach + 1) & Inside(image, 0);
      EXPECT_EQ(cv::countNonZero(blurred(near) != expected(near)), 0) << near;
    }
  }
}

TEST(InstructionSets, ResizedImagesAreThoseOfOpenCv) {
  std::vector<cv::Mat> images = Images();
  images.push_back(Noise(15, 20, 0, 255, 9));
  images.push_back(Noise(2, 1, 0, 255, 10));
  for (const cv::Mat& image : images) {
    for (const double scale : {1.0, 1.01, 1.2, 1.5, 1.9, 2.0}) {
      const cv::Size size(std::max(1, cvRound(image.cols / scale)), std::max(1, cvRound(image.rows / scale)));
      cv::Mat expected, resized;
      cv::resize(image, expected, size, 0.0, 0.0, cv::INTER_LINEAR);
      for (const InstructionSet set : UsableInstructionSets()) {
        LevelResizer(set).Resize(image, size, &resized);
        ASSERT_EQ(resized.size(), size);
        EXPECT_EQ(cv::countNonZero(resized != expected), 0) << image.size() << " to " << size;
      }
    }
  }
}

TEST(InstructionSets, OrientationsAndDescriptors) {
  std::mt19937 generator(11);
  std::uniform_real_distribution<float> angle(0.0F, 6.28F);
  for (const cv::Mat& image : Images()) {
    const cv::Rect inside = Inside(image, kOrbMargin);
    std::uniform_int_distribution<int> x(inside.x, inside.x + inside.width - 1);
    std::uniform_int_distribution<int> y(inside.y, inside.y + inside.height - 1);
    const PatchOrientation plain_orientation(InstructionSet::kPlain);
    const BriefPattern plain_pattern(InstructionSet::kPlain);
    for (const InstructionSet set : UsableInstructionSets()) {
      const PatchOrientation orientation(set);
      const BriefPattern pattern(set);
      for (int i = 0; i < 50; ++i) {
        const int column = x(generator), row = y(generator);
        const float turn = angle(generator);
        ASSERT_EQ(orientation.Degrees(image, column, row), plain_orientation.Degrees(image, column, row));
        ASSERT_EQ(pattern.Describe(image, column, row, turn), plain_pattern.Describe(image, column, row, turn));
      }
    }
  }
}

TEST(InstructionSets, Distances) {
  std::mt19937 generator(12);
  std::uniform_int_distribution<std::uint64_t> word;
  std::vector<Descriptor> descriptors{{}, {~0ULL, ~0ULL, ~0ULL, ~0ULL}};
  for (int i = 0; i < 300; ++i) {
    descriptors.push_back({word(generator), word(generator) & word(generator), word(generator), word(generator)});
  }
  std::vector<int> indices(descriptors.size());
  std::iota(indices.begin(), indices.end(), 0);
  for (const Descriptor& query : descriptors) {
    std::vector<int> expected;
    for (const Descriptor& other : descriptors) {
      std::size_t bits = 0;
      for (std::size_t k = 0; k < other.size(); ++k) bits += std::bitset<64>(query[k] ^ other[k]).count();
      expected.push_back(static_cast<int>(bits));
      ASSERT_EQ(HammingDistance(query, other), expected.back());
    }
    const auto nearest = std::min_element(expected.begin() + 1, expected.end());
    for (const InstructionSet set : UsableInstructionSets()) {
      std::vector<int> distances;
      HammingDistances(query, descriptors, indices, &distances, set);
      ASSERT_EQ(distances, expected);
      const auto [index, distance] = NearestByHamming(query, {descriptors.begin() + 1, descriptors.end()}, set);
      EXPECT_EQ(index, nearest - expected.begin() - 1);
      EXPECT_EQ(distance, *nearest);
    }
  }
}

TEST(InstructionSets, WholeExtraction) {
  std::vector<OrbExtractor::Stages> stages;
  for (const InstructionSet set : UsableInstructionSets()) stages.emplace_back(set);
  for (const cv::Mat& image : Images()) {
    for (const int count : {1, 100, 1000}) {
      const CameraModel camera = test::PinholeCamera(image.cols, image.rows);
      const FrameFeatures expected = stages.front().Extract(image, OrbOptions{}, camera, count);
      for (OrbExtractor::Stages& other : stages) {
        EXPECT_TRUE(test::SameFeatures(other.Extract(image, OrbOptions{}, camera, count), expected)) << image.size();
      }
    }
  }
}

TEST(InstructionSets, TheBestIsUsable) {
  const std::vector<InstructionSet> sets = UsableInstructionSets();
  EXPECT_EQ(sets.front(), InstructionSet::kPlain);
  EXPECT_EQ(sets.back(), BestInstructionSet());
  EXPECT_TRUE(std::is_sorted(sets.begin(), sets.end()));
}

}  // namespace
}  // namespace planar_vslam
