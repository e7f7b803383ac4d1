// Feature extraction, its stages, search and matching on one thread. The image is that of the file named by
// PLANAR_VSLAM_BENCH_IMAGE, or random rectangles of 640x480 px. Where a benchmark takes an instruction set, 0 is plain,
// 1 SSE4.2 and 2 AVX2.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <ctime>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "brief_blur.h"
#include "corner_detector.h"
#include "level_resizer.h"
#include "orb_descriptor.h"
#include "orb_stages.h"
#include "planar_vslam/feature/matching.h"
#include "planar_vslam/feature/orb_extractor.h"
#include "quadtree.h"

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

double CpuSeconds() {
  std::timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// CPU time of one extraction over that of cv::ORB on the same image, in turns: machines differ, and so do their hours.
void ExtractInOrbs(benchmark::State& state) {
  constexpr int kFeatures = 1000;
  const GrayImage image = BenchImage();
  const cv::Mat view(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels->data()));
  OrbExtractor extractor(OrbOptions{}, BenchCamera(image));
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(kFeatures, 1.2F, 8);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  double ours = 0.0, theirs = 0.0;
  for (auto _ : state) {
    const double begin = CpuSeconds();
    benchmark::DoNotOptimize(extractor.Extract(image, kFeatures));
    const double between = CpuSeconds();
    orb->detectAndCompute(view, cv::noArray(), keypoints, descriptors);
    ours += between - begin;
    theirs += CpuSeconds() - between;
  }
  state.counters["orbs"] = ours / theirs;
}
BENCHMARK(ExtractInOrbs)->Unit(benchmark::kMillisecond)->MinTime(2.0);

// Whether this processor has the set a benchmark asks for.
bool Has(benchmark::State& state, InstructionSet* set) {
  *set = static_cast<InstructionSet>(state.range(0));
  if (*set <= BestInstructionSet()) return true;
  state.SkipWithError("the processor lacks these instructions");
  return false;
}

void ExtractWith(benchmark::State& state) {
  InstructionSet set;
  if (!Has(state, &set)) return;
  const GrayImage image = BenchImage();
  const cv::Mat view(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels->data()));
  OrbExtractor::Stages stages(set);
  for (auto _ : state) benchmark::DoNotOptimize(stages.Extract(view, OrbOptions{}, BenchCamera(image), 1000));
}
BENCHMARK(ExtractWith)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

// What the stages give each other at full resolution.
struct LevelZero {
  static constexpr int kKeypoints = 330;  // a third of 1,000
  LevelZero() : gray(BenchImage()) {
    image = cv::Mat(gray.height, gray.width, CV_8UC1, const_cast<std::uint8_t*>(gray.pixels->data()));
    inner = {kOrbMargin, kOrbMargin, image.cols - 2 * kOrbMargin, image.rows - 2 * kOrbMargin};
    CornerDetector(BestInstructionSet()).Detect(image, inner, thresholds, &corners);
    Quadtree().Thin(corners, inner, kKeypoints, &kept);
  }
  GrayImage gray;
  cv::Mat image;  // shares the pixels of `gray`
  cv::Rect inner;
  CornerThresholds thresholds{20, 7, 30};
  std::vector<Corner> corners, kept;
};

void LevelZeroResize(benchmark::State& state) {
  InstructionSet set;
  if (!Has(state, &set)) return;
  const LevelZero level;
  LevelResizer resizer(set);
  cv::Mat resized;
  for (auto _ : state) resizer.Resize(level.image, cv::Size(533, 400), &resized);
}
BENCHMARK(LevelZeroResize)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void LevelZeroCorners(benchmark::State& state) {
  InstructionSet set;
  if (!Has(state, &set)) return;
  const LevelZero level;
  CornerDetector detector(set);
  std::vector<Corner> corners;
  for (auto _ : state) detector.Detect(level.image, level.inner, level.thresholds, &corners);
  state.counters["corners"] = static_cast<double>(corners.size());
}
BENCHMARK(LevelZeroCorners)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void LevelZeroQuadtree(benchmark::State& state) {
  const LevelZero level;
  Quadtree quadtree;
  std::vector<Corner> kept;
  for (auto _ : state) quadtree.Thin(level.corners, level.inner, LevelZero::kKeypoints, &kept);
}
BENCHMARK(LevelZeroQuadtree)->Unit(benchmark::kMicrosecond);

void LevelZeroBlur(benchmark::State& state) {
  InstructionSet set;
  if (!Has(state, &set)) return;
  const LevelZero level;
  BriefBlur blur(set);
  cv::Mat blurred;
  for (auto _ : state) blur.Apply(level.image, level.kept, kOrbReach, &blurred);
}
BENCHMARK(LevelZeroBlur)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void LevelZeroOrientation(benchmark::State& state) {
  InstructionSet set;
  if (!Has(state, &set)) return;
  const LevelZero level;
  const PatchOrientation orientation(set);
  for (auto _ : state) {
    for (const Corner& corner : level.kept) {
      benchmark::DoNotOptimize(orientation.Degrees(level.image, corner.x, corner.y));
    }
  }
}
BENCHMARK(LevelZeroOrientation)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void LevelZeroDescriptors(benchmark::State& state) {
  InstructionSet set;
  if (!Has(state, &set)) return;
  const LevelZero level;
  const BriefPattern pattern(set);
  for (auto _ : state) {
    float angle = 0.0F;
    for (const Corner& corner : level.kept) {
      benchmark::DoNotOptimize(pattern.Describe(level.image, corner.x, corner.y, angle += 0.01F));
    }
  }
}
BENCHMARK(LevelZeroDescriptors)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void LevelZeroUndistort(benchmark::State& state) {
  const LevelZero level;
  const CameraModel camera = BenchCamera(level.gray);
  for (auto _ : state) {
    for (const Corner& corner : level.kept) benchmark::DoNotOptimize(camera.UndistortPixel({corner.x, corner.y}));
  }
}
BENCHMARK(LevelZeroUndistort)->Unit(benchmark::kMicrosecond);

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
