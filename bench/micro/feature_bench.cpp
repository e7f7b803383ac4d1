// Feature extraction, search and matching on one thread. The image is that of the file named by
// PLANAR_VSLAM_BENCH_IMAGE, or random rectangles of 640x480 px.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "planar_vslam/feature/matching.h"
#include "planar_vslam/feature/orb_extractor.h"

namespace planar_vslam {
namespace {

cv::Mat RandomRectangles() {
  constexpr int kRectangles = 600;
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(128));
  std::mt19937 generator(1);
  std::uniform_int_distribution<int> x(0, image.cols - 1), y(0, image.rows - 1), side(4, 60), grey(20, 235);
  for (int i = 0; i < kRectangles; ++i) {
    const int left = x(generator), top = y(generator), width = side(generator), height = side(generator);
    cv::rectangle(image, {left, top, width, height}, cv::Scalar(grey(generator)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, cv::Size(3, 3), 0.8);
  return image;
}

GrayImage BenchImage() {
  const char* path = std::getenv("PLANAR_VSLAM_BENCH_IMAGE");
  cv::Mat image;
  if (path != nullptr) image = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (image.empty()) image = RandomRectangles();
  GrayImage gray;
  gray.width = image.cols;
  gray.height = image.rows;
  gray.pixels =
      std::make_shared<const std::vector<std::uint8_t>>(image.begin<std::uint8_t>(), image.end<std::uint8_t>());
  return gray;
}

CameraModel BenchCamera(const GrayImage& image) {
  CameraModel camera;
  camera.width = image.width;
  camera.height = image.height;
  camera.fx = camera.fy = 500.0;
  camera.cx = 0.5 * image.width;
  camera.cy = 0.5 * image.height;
  camera.k1 = 0.03;
  camera.k2 = -0.09;
  return camera;
}

FrameFeatures BenchFeatures() {
  const GrayImage image = BenchImage();
  return OrbExtractor(OrbOptions{}, BenchCamera(image)).Extract(image);
}

void ConstructExtractor(benchmark::State& state) {
  const CameraModel camera = BenchCamera(BenchImage());
  for (auto _ : state) benchmark::DoNotOptimize(OrbExtractor(OrbOptions{}, camera));
}
BENCHMARK(ConstructExtractor)->Unit(benchmark::kMillisecond);

void Extract(benchmark::State& state) {
  const GrayImage image = BenchImage();
  OrbExtractor extractor(OrbOptions{}, BenchCamera(image));
  const int feature_count = static_cast<int>(state.range(0));
  std::size_t found = 0;
  for (auto _ : state) found = extractor.Extract(image, feature_count).keypoints.size();
  state.counters["keypoints"] = static_cast<double>(found);
}
BENCHMARK(Extract)->Arg(500)->Arg(1000)->Arg(2000)->Unit(benchmark::kMillisecond);

void BuildGrid(benchmark::State& state) {
  const FrameFeatures features = BenchFeatures();
  for (auto _ : state) benchmark::DoNotOptimize(ImageGrid(features.keypoints));
}
BENCHMARK(BuildGrid)->Unit(benchmark::kMicrosecond);

void MatchRadius(benchmark::State& state) {
  const FrameFeatures features = BenchFeatures();
  std::vector<Eigen::Vector2f> predicted;
  for (const Keypoint& keypoint : features.keypoints) predicted.push_back(keypoint.pixel);
  const float radius = static_cast<float>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(MatchWithinRadius(features, features, predicted, radius, 1, MatchOptions{}));
  }
}
BENCHMARK(MatchRadius)->Arg(15)->Arg(50)->Unit(benchmark::kMicrosecond);

void MatchAll(benchmark::State& state) {
  const FrameFeatures features = BenchFeatures();
  std::vector<int> all;
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) all.push_back(static_cast<int>(i));
  for (auto _ : state) benchmark::DoNotOptimize(MatchBruteForce(features, all, features, all, MatchOptions{}));
}
BENCHMARK(MatchAll)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace planar_vslam
