#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "planar_vslam/io/evaluation.h"

namespace planar_vslam {
namespace {

using Json = nlohmann::ordered_json;

Json ToJsonValue(const ErrorStatistics& statistics) {
  return {{"rmse", statistics.rmse}, {"mean", statistics.mean}, {"median", statistics.median}, {"max", statistics.max}};
}

std::string Row(const std::string& name, const ErrorStatistics& s, double factor, int decimals,
                const std::string& unit) {
  return fmt::format("{:<16}{:>10.{}f}{:>10.{}f}{:>10.{}f}{:>10.{}f}  {}\n", name, s.rmse * factor, decimals,
                     s.mean * factor, decimals, s.median * factor, decimals, s.max * factor, decimals, unit);
}

std::string RmseRow(const std::string& name, double value, int decimals, const std::string& unit) {
  if (!std::isfinite(value)) return fmt::format("{:<16}{:>10}{:>30}  {}\n", name, "-", "", unit);
  return fmt::format("{:<16}{:>10.{}f}{:>30}  {}\n", name, value, decimals, "", unit);
}

}  // namespace

// Values that were not measured (not a number) become null.
std::string ToJson(const TrajectoryErrors& errors) {
  const Rigid3& T = errors.truth_from_estimate.T_target_source;
  const Json json = {
      {"pairs", errors.pairs},
      {"coverage", errors.coverage},
      {"ate_m", ToJsonValue(errors.ate)},
      {"ate_2d_m", ToJsonValue(errors.ate_2d)},
      {"ate_axis_rmse_m", {errors.ate_axis_rmse.x(), errors.ate_axis_rmse.y(), errors.ate_axis_rmse.z()}},
      {"heading_rad", ToJsonValue(errors.heading)},
      {"rpe_translation_per_meter", errors.rpe_translation_per_meter},
      {"rpe_rotation_per_meter_rad", errors.rpe_rotation_per_meter},
      {"rpe_translation_per_second_m", errors.rpe_translation_per_second},
      {"rpe_rotation_per_second_rad", errors.rpe_rotation_per_second},
      {"scale_error", errors.scale_error},
      {"alignment",
       {{"scale", errors.truth_from_estimate.scale},
        {"t", {T.translation.x(), T.translation.y(), T.translation.z()}},
        {"q_xyzw", {T.rotation.x(), T.rotation.y(), T.rotation.z(), T.rotation.w()}}}},
  };
  return json.dump(2) + "\n";
}

std::string ToText(const TrajectoryErrors& errors) {
  constexpr double kPercent = 100.0;
  const double degrees = RadiansToDegrees(1.0);
  std::string text = fmt::format("{:<16}{:>10}{:>10}{:>10}{:>10}\n", "", "rmse", "mean", "median", "max");
  text += Row("ATE", errors.ate, 1.0, 4, "m");
  text += Row("ATE in x-y", errors.ate_2d, 1.0, 4, "m");
  text += RmseRow("ATE x", errors.ate_axis_rmse.x(), 4, "m");
  text += RmseRow("ATE y", errors.ate_axis_rmse.y(), 4, "m");
  text += RmseRow("ATE z", errors.ate_axis_rmse.z(), 4, "m");
  text += Row("heading", errors.heading, degrees, 3, "deg");
  text += RmseRow("RPE per metre", errors.rpe_translation_per_meter * kPercent, 3, "%");
  text += RmseRow("", errors.rpe_rotation_per_meter * degrees, 3, "deg/m");
  text += RmseRow("RPE per second", errors.rpe_translation_per_second, 4, "m/s");
  text += RmseRow("", errors.rpe_rotation_per_second * degrees, 3, "deg/s");
  text += RmseRow("scale error", errors.scale_error * kPercent, 3, "%");
  text += RmseRow("coverage", errors.coverage * kPercent, 1, "%");
  text += fmt::format("{:<16}{:>10}\n", "pairs", errors.pairs);
  return text;
}

}  // namespace planar_vslam
