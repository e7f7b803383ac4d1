#include "planar_vslam/geometry/option_fields.h"

#include <cmath>
#include <cstdio>

namespace planar_vslam {
namespace {

// A limit of 45 degrees is one for 45 degrees that went through radians, too.
constexpr double kRounding = 1e-12;  // relative

bool Above(double value, const Bound::Limit& low) {
  return low.open ? value > low.value : value >= low.value - kRounding * std::abs(low.value);
}

bool Below(double value, const Bound::Limit& high) {
  return high.open ? value < high.value : value <= high.value + kRounding * std::abs(high.value);
}

std::string LimitText(const Bound::Limit& limit, const Unit& unit, const std::string& section) {
  std::string number = NumberText(limit.value);
  if (*unit.name != '\0') number += std::string(" ") + unit.name;
  return limit.key == nullptr ? number : section + limit.key + " (" + number + ")";
}

}  // namespace

bool Bound::Allows(double value) const {
  if (!std::isfinite(value)) return false;
  return (or_zero && value == 0.0) ||
         (!(std::isfinite(low.value) && !Above(value, low)) && !(std::isfinite(high.value) && !Below(value, high)));
}

std::string Bound::Expectation(const Unit& unit, const std::string& section) const {
  std::string text = or_zero ? "0 or " : "";
  const bool has_low = std::isfinite(low.value), has_high = std::isfinite(high.value);
  if (!has_low && !has_high) return text + "a finite number";
  if (has_low) text += (low.open ? "more than " : "at least ") + LimitText(low, unit, section);
  if (has_low && has_high) text += " and ";
  if (has_high) text += (high.open ? "less than " : "at most ") + LimitText(high, unit, section);
  return text;
}

std::string NumberText(double value) {
  char text[32];
  constexpr double kWhole = 1e15;  // beyond it not every whole number is one
  const bool whole = std::abs(value) < kWhole && value == std::floor(value);
  std::snprintf(text, sizeof(text), whole ? "%.0f" : "%.9g", value);
  return text;
}

void ProblemFinder::operator()(const char* key, double value, const Unit& unit, const Bound& bound,
                               const char* /*text*/, Origin /*origin*/) {
  const double configured = value / unit.size;
  if (bound.Allows(configured)) return;
  problems_.push_back(section_ + key + " is " + NumberText(configured) + "; expected " +
                      bound.Expectation(unit, section_));
}

}  // namespace planar_vslam
