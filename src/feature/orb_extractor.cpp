#include "planar_vslam/feature/orb_extractor.h"

#include <cmath>

#include "orb_stages.h"
#include "planar_vslam/geometry/check.h"

namespace planar_vslam {

std::vector<double> OrbOptions::ScaleFactors() const {
  std::vector<double> factors;
  for (int octave = 0; octave < level_count; ++octave) factors.push_back(std::pow(scale_factor, octave));
  return factors;
}

OrbExtractor::OrbExtractor(const OrbOptions& options, const CameraModel& camera)
    : options_(options), camera_(camera), stages_(std::make_unique<Stages>(BestInstructionSet())) {
  const std::vector<std::string> problems = options.Problems();
  PV_CHECK(problems.empty(), problems.front());
}
OrbExtractor::~OrbExtractor() = default;
OrbExtractor::OrbExtractor(OrbExtractor&&) noexcept = default;
OrbExtractor& OrbExtractor::operator=(OrbExtractor&&) noexcept = default;

FrameFeatures OrbExtractor::Extract(const GrayImage& image) { return Extract(image, options_.feature_count); }

FrameFeatures OrbExtractor::Extract(const GrayImage& image, int feature_count) {
  if (image.empty() || feature_count <= 0) return {};
  PV_CHECK(image.pixels->size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
           "width=" << image.width << " height=" << image.height << " pixels=" << image.pixels->size());
  // cv::Mat has no view of const pixels; nothing here writes to level 0.
  const cv::Mat view(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels->data()));
  return stages_->Extract(view, options_, camera_, feature_count);
}

}  // namespace planar_vslam
