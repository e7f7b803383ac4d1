#include "planar_vslam/geometry/median.h"

#include <gtest/gtest.h>

namespace planar_vslam {
namespace {

TEST(Median, IsTheMiddleOne) {
  EXPECT_EQ(Median({3.0, -1.0, 7.0}), 3.0);
  EXPECT_EQ(Median({5.0}), 5.0);
}

TEST(Median, OfAnEvenCountIsTheUpperOfTheTwoInTheMiddle) { EXPECT_EQ(Median({4.0, 1.0, 3.0, 2.0}), 3.0); }

TEST(Median, OfNoneIsZero) { EXPECT_EQ(Median({}), 0.0); }

}  // namespace
}  // namespace planar_vslam
