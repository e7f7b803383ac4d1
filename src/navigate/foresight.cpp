#include "planar_vslam/navigate/foresight.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

// Chosen by looking at seeds 1, 3 and 4 of mechatronics_lab.
// Beyond the margin it costs less and less, the farther ahead the wider: what is foreseen for later is less certain.
// Within the margin it costs more and more, so that a goal just beside somebody's way can be reached.
constexpr double kNear = 0.25, kSpread = 0.02;  // m, m/s
constexpr double kBeside = 4.0;                 // of a second where the margin begins
constexpr double kDeep = 100.0;                 // more, a metre within the body: least of all through the middle

}  // namespace

double GapAt(const Foresight& foresight, const NavigateOptions& options, const Eigen::Vector2d& p_map, double time) {
  double nearest = std::numeric_limits<double>::infinity();
  const double at = std::clamp(time / Foresight::kPeriod, 0.0, static_cast<double>(foresight.count() - 1));
  const auto k = static_cast<std::size_t>(at);
  for (const auto& way : foresight.people) {
    const Eigen::Vector2d step = way[std::min(k + 1, way.size() - 1)] - way[k];
    nearest = std::min(nearest, (way[k] + (at - static_cast<double>(k)) * step - p_map).squaredNorm());
  }
  return std::sqrt(nearest) - options.robot_radius - options.person_radius;
}

Risk RiskAt(const Foresight& foresight, const NavigateOptions& options, const Eigen::Vector2d& p_map, int step) {
  if (foresight.empty()) return {};
  const auto k = static_cast<std::size_t>(std::clamp(step, 0, foresight.count() - 1));
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& way : foresight.people) nearest = std::min(nearest, (way[k] - p_map).squaredNorm());
  const double gap = std::sqrt(nearest) - options.robot_radius - options.person_radius;
  if (gap < 0.0) return {Risk::kContact - kDeep * gap};
  if (gap < options.person_margin) {
    const double inside = 1.0 - gap / options.person_margin;
    return {kBeside + (Risk::kContact - kBeside) * inside * inside};
  }
  const double clear = gap - options.person_margin;
  const double near = kNear + kSpread * Foresight::kPeriod * static_cast<double>(k);
  if (clear >= near) return {};
  const double share = 1.0 - clear / near;
  return {kBeside * share * share};
}

}  // namespace planar_vslam
