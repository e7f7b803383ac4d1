#pragma once
// How a struct of options describes itself. It has one function that shows each field to a visitor, with key, unit, the
// values it may have and what it means:
//   template <class Self, class Visitor>
//   static void Visit(Self& o, Visitor& v) {
//     v("window", o.window, unit::kNone, bound::AtLeast(1), "keyframes the local bundle adjustment moves");
//   }
// `Self` is the struct, const or not. Checks (ProblemsOf), files and command lines (pipeline/options.h) are visitors:
//   v(key, int or double, Unit, Bound, text, Origin = Origin::kStated);
//   v(key, bool or std::string, text);
//   v(key, enum, {{"name", E::kName}, ...}, text);
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/angles.h"

namespace planar_vslam {

// What the configured number counts. Angles are degrees there and radians in the field.
struct Unit {
  const char* name = "";
  double size = 1.0;  // field = configured number * size
};

namespace unit {
inline constexpr Unit kNone{}, kMeters{"m"}, kPixels{"px"}, kSeconds{"s"}, kDegrees{"deg", DegreesToRadians(1.0)};
}  // namespace unit

// Where a default comes from.
enum class Origin {
  kStated,  // what the text says, a data sheet or a paper
  kFitted,  // chosen while looking at the drives of BENCHMARK.md
};

// The names an enum's values have in a configuration.
template <class E>
using Choices = std::vector<std::pair<const char*, E>>;

// The values a number may have, in its unit. NaN and the infinities are never among them.
struct Bound {
  struct Limit {
    double value;
    const char* key = nullptr;  // of the other field the value is of
    bool open = false;          // the value itself is excluded
  };
  Limit low{-std::numeric_limits<double>::infinity()}, high{std::numeric_limits<double>::infinity()};
  bool or_zero = false;

  constexpr Bound And(const Bound& upper) const { return {low, upper.high, or_zero}; }
  bool Allows(double value) const;
  // "at least 1 px", "more than 0 and at most tracker.min_inliers (25)". `section` goes before other fields' keys.
  std::string Expectation(const Unit& unit, const std::string& section) const;
};

namespace bound {
constexpr Bound Finite() { return {}; }
constexpr Bound AtLeast(double low) { return {{low}}; }
constexpr Bound AtLeast(const char* key, double low) { return {{low, key}}; }
constexpr Bound MoreThan(double low) { return {{low, nullptr, true}}; }
constexpr Bound MoreThan(const char* key, double low) { return {{low, key, true}}; }
constexpr Bound Positive() { return MoreThan(0.0); }
constexpr Bound AtMost(double high) { return Bound{}.And({{0.0}, {high}}); }
constexpr Bound AtMost(const char* key, double high) { return Bound{}.And({{0.0}, {high, key}}); }
constexpr Bound LessThan(double high) { return Bound{}.And({{0.0}, {high, nullptr, true}}); }
constexpr Bound LessThan(const char* key, double high) { return Bound{}.And({{0.0}, {high, key, true}}); }
// Both ends included.
constexpr Bound FromTo(double low, double high) { return AtLeast(low).And(AtMost(high)); }
// Neither end included.
constexpr Bound Between(double low, double high) { return MoreThan(low).And(LessThan(high)); }
constexpr Bound ZeroOr(const Bound& bound) { return {bound.low, bound.high, true}; }
}  // namespace bound

// "0.5", "25": up to nine digits.
std::string NumberText(double value);

// The visitor that checks bounds: one line a problem, "mapper.min_parallax_deg is 0; expected more than 0 deg".
class ProblemFinder {
 public:
  // `section` goes before each key: "mapper." or nothing.
  explicit ProblemFinder(std::string section) : section_(std::move(section)) {}
  // The keys from here on are those of a section.
  void Section(const char* name, const char* /*comment*/) { section_ = std::string(name) + "."; }
  void operator()(const char* key, double value, const Unit& unit, const Bound& bound, const char* /*text*/,
                  Origin /*origin*/ = Origin::kStated);
  void operator()(const char* /*key*/, bool /*value*/, const char* /*text*/) {}
  void operator()(const char* /*key*/, const std::string& /*value*/, const char* /*text*/) {}
  template <class E>
  void operator()(const char* /*key*/, const E& /*value*/, const Choices<E>& /*choices*/, const char* /*text*/) {}
  std::vector<std::string> problems() && { return std::move(problems_); }

 private:
  std::string section_;
  std::vector<std::string> problems_;
};

// What is wrong with a struct of options, one line each; keys are those of its section, with `section` before them.
template <class Options>
std::vector<std::string> ProblemsOf(const Options& options, const std::string& section = "") {
  ProblemFinder finder(section);
  Options::Visit(options, finder);
  return std::move(finder).problems();
}

}  // namespace planar_vslam
