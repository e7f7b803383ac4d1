#include "planar_vslam/geometry/option_fields.h"

#include <gtest/gtest.h>

#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

enum class Color { kRed, kGreen };

struct Paint {
  double liters = 1.0;
  int coats = 2;
  double slope = DegreesToRadians(30.0);
  bool matt = false;
  Color color = Color::kRed;
  std::string maker;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("liters", o.liters, Unit{"l"}, bound::Positive(), "in the can");
    v("coats", o.coats, unit::kNone, bound::FromTo(1, 3), "on the wall");
    v("slope_deg", o.slope, unit::kDegrees, bound::AtMost(45.0), "of the wall", Origin::kFitted);
    v("matt", o.matt, "without gloss");
    v("color", o.color, {{"red", Color::kRed}, {"green", Color::kGreen}}, "red or green");
    v("maker", o.maker, "a name");
  }
};

TEST(Bound, KnowsItsEnds) {
  EXPECT_TRUE(bound::AtLeast(2.0).Allows(2.0));
  EXPECT_FALSE(bound::MoreThan(2.0).Allows(2.0));
  EXPECT_TRUE(bound::AtMost(2.0).Allows(2.0));
  EXPECT_FALSE(bound::LessThan(2.0).Allows(2.0));
  EXPECT_TRUE(bound::FromTo(1.0, 2.0).Allows(1.0) && bound::FromTo(1.0, 2.0).Allows(2.0));
  EXPECT_FALSE(bound::Between(1.0, 2.0).Allows(1.0) || bound::Between(1.0, 2.0).Allows(2.0));
  EXPECT_FALSE(bound::FromTo(1.0, 2.0).Allows(0.9) || bound::FromTo(1.0, 2.0).Allows(2.1));
  EXPECT_TRUE(bound::ZeroOr(bound::AtLeast(3.0)).Allows(0.0));
  EXPECT_FALSE(bound::ZeroOr(bound::AtLeast(3.0)).Allows(1.0));
}

TEST(Bound, AllowsNothingThatIsNotFinite) {
  for (const Bound& any : {bound::Finite(), bound::AtLeast(0.0), bound::LessThan(0.0)}) {
    for (const double value : {std::nan(""), kInfinity, -kInfinity}) EXPECT_FALSE(any.Allows(value));
  }
  EXPECT_TRUE(bound::Finite().Allows(-1e300));
}

TEST(Bound, SaysWhatItExpects) {
  EXPECT_EQ(bound::Finite().Expectation(unit::kNone, ""), "a finite number");
  EXPECT_EQ(bound::AtLeast(0.5).Expectation(unit::kPixels, ""), "at least 0.5 px");
  EXPECT_EQ(bound::Between(0.0, 90.0).Expectation(unit::kDegrees, ""), "more than 0 deg and less than 90 deg");
  EXPECT_EQ(bound::ZeroOr(bound::AtLeast(3.0)).Expectation(unit::kNone, ""), "0 or at least 3");
  EXPECT_EQ(bound::AtLeast(1.0).And(bound::AtMost("high", 7.0)).Expectation(unit::kMeters, "grid."),
            "at least 1 m and at most grid.high (7 m)");
}

TEST(ProblemsOf, ASoundStructHasNone) { EXPECT_TRUE(ProblemsOf(Paint{}).empty()); }

TEST(ProblemsOf, NamesKeyValueUnitAndBound) {
  Paint paint;
  paint.liters = -0.25;
  paint.coats = 4;
  paint.slope = DegreesToRadians(60.0);
  const std::vector<std::string> problems = ProblemsOf(paint, "paint.");
  ASSERT_EQ(problems.size(), 3U);
  EXPECT_EQ(problems[0], "paint.liters is -0.25; expected more than 0 l");
  EXPECT_EQ(problems[1], "paint.coats is 4; expected at least 1 and at most 3");
  EXPECT_EQ(problems[2], "paint.slope_deg is 60; expected at most 45 deg");
  EXPECT_EQ(ProblemsOf(paint)[0], "liters is -0.25; expected more than 0 l");
}

TEST(ProblemsOf, AnAngleAtItsLimitIsAllowedHoweverItWasComputed) {
  Paint paint;
  for (const double slope : {45.0 * DegreesToRadians(1.0), DegreesToRadians(45.0), M_PI / 4.0}) {
    paint.slope = slope;
    EXPECT_TRUE(ProblemsOf(paint).empty()) << slope;
  }
}

}  // namespace
}  // namespace planar_vslam
