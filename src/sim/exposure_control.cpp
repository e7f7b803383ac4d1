#include <algorithm>
#include <cmath>
#include <numeric>

#include "planar_vslam/sim/sensors.h"

namespace planar_vslam {
namespace {

constexpr double kDisplayGamma = 2.2;  // grey levels are light to the power 1 / gamma
constexpr double kLeastFactor = 0.1, kLargestFactor = 10.0;

}  // namespace

ExposureControl::ExposureControl(const CameraSpec& spec) : spec_(spec), factor_(spec.exposure) {}

Exposure ExposureControl::Next() const {
  Exposure exposure;
  exposure.factor = factor_;
  if (spec_.exposure_time == 0.0) return exposure;
  // Longer first; amplified, with the noise of fewer photons, where the shutter cannot stay open for longer.
  const double wanted = spec_.exposure_time * std::pow(factor_, kDisplayGamma);
  exposure.time = std::min(wanted, spec_.longest_exposure);
  exposure.noise_gain = std::sqrt(wanted / exposure.time);
  return exposure;
}

void ExposureControl::Observe(const GrayImage& image) {
  if (!spec_.auto_exposure || image.empty()) return;
  const double sum = std::accumulate(image.pixels->begin(), image.pixels->end(), 0.0);
  const double mean = std::max(1.0, sum / static_cast<double>(image.pixels->size()));
  const double share = 1.0 - std::exp(-1.0 / (spec_.rate * spec_.exposure_response));
  factor_ = std::clamp(factor_ * std::pow(spec_.exposure_target / mean, share), kLeastFactor, kLargestFactor);
}

}  // namespace planar_vslam
