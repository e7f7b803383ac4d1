// The unit of speed: what cv::ORB costs on the images of a recording, on this machine, now.
//   bench_orb RECORDING [EVERY=1]
// Every EVERYth image is given to cv::ORB::detectAndCompute (1000 features, 8 levels, 1.2) and to our extractor, one
// after the other on one thread, so that what else the machine does slows both alike. Prints JSON: number of images,
// and of both the mean of the CPU time and the median of the wall time of an image, in ms.
#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "cost.h"
#include "planar_vslam/feature/orb_extractor.h"
#include "planar_vslam/geometry/stopwatch.h"
#include "planar_vslam/io/recording.h"

namespace planar_vslam {
namespace {

double CpuMilliseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

class Cost {
 public:
  template <class Work>
  void Add(Work work) {
    const Stopwatch watch;
    const double begin = CpuMilliseconds();
    work();
    cpu_ms_ += CpuMilliseconds() - begin;
    wall_ms_.push_back(watch.Milliseconds());
  }
  std::string Json() const {
    return fmt::format(R"({{"cpu_ms": {:.5f}, "wall_p50_ms": {:.5f}}})", cpu_ms_ / static_cast<double>(images()),
                       Percentile(wall_ms_, 0.5));
  }
  std::size_t images() const { return wall_ms_.size(); }

 private:
  double cpu_ms_ = 0.0;
  std::vector<double> wall_ms_;
};

struct Costs {
  Cost orb, ours;
};

Expected<Costs> Measure(const std::filesystem::path& path, long every) {
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(path, RecordingOptions{});
  if (!recording.ok()) return recording.error();
  cv::setNumThreads(1);
  constexpr int kFeatures = 1000, kLevels = 8;
  constexpr float kScaleFactor = 1.2F;
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(kFeatures, kScaleFactor, kLevels);
  OrbExtractor extractor(OrbOptions{}, (*recording)->info().camera);
  Costs costs;
  for (long number = 0;;) {
    Expected<std::optional<RecordedEvent>> event = (*recording)->Next();
    if (!event.ok()) return event.error();
    if (!event->has_value()) break;
    const auto* frame = std::get_if<CameraFrame>(&**event);
    if (frame == nullptr || number++ % every != 0) continue;
    const GrayImage& image = frame->image.image;
    const cv::Mat pixels(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels->data()));
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    costs.orb.Add([&] { orb->detectAndCompute(pixels, cv::noArray(), keypoints, descriptors); });
    costs.ours.Add([&] { extractor.Extract(image); });
  }
  if (costs.orb.images() == 0) return Error{path.string() + ": expected images"};
  return costs;
}

int Main(int argc, char** argv) {
  const long every = argc > 2 ? std::atol(argv[2]) : 1;
  if (argc < 2 || every < 1) {
    fmt::print(stderr, "usage: bench_orb RECORDING [EVERY=1]\n");
    return 2;
  }
  Expected<Costs> costs = Measure(argv[1], every);
  if (!costs.ok()) {
    fmt::print(stderr, "bench_orb: {}\n", costs.error().message);
    return 2;
  }
  fmt::print("{{\"images\": {}, \"orb\": {}, \"ours\": {}}}\n", costs->orb.images(), costs->orb.Json(),
             costs->ours.Json());
  return 0;
}

}  // namespace
}  // namespace planar_vslam

int main(int argc, char** argv) { return planar_vslam::Main(argc, argv); }
