#include "planar_vslam/localize/sight_odds.h"

#include <gtest/gtest.h>

namespace planar_vslam {
namespace {

TEST(SightOdds, NothingInViewSaysNothing) { EXPECT_EQ(SightLogOdds({0, 0}, {500, 3}), 0.0); }

// In a hall on another day: a fifteenth of what should be in view is found, and elsewhere one of a thousand.
TEST(SightOdds, AFewLandmarksAreMuchWhereChanceFindsNone) {
  EXPECT_GT(SightLogOdds({330, 23}, {1300, 1}), 4.0);
  EXPECT_GT(SightLogOdds({90, 9}, {380, 0}), 4.0);
}

TEST(SightOdds, AndNothingWhereChanceFindsAsMany) {
  EXPECT_LT(SightLogOdds({330, 23}, {1300, 90}), 0.5);
  EXPECT_LT(SightLogOdds({330, 5}, {1300, 15}), 0.0);
}

TEST(SightOdds, GrowWithWhatIsFoundAndFallWithWhatChanceFinds) {
  double before = SightLogOdds({200, 0}, {800, 4});
  for (int found = 10; found <= 100; found += 10) {
    const double odds = SightLogOdds({200, found}, {800, 4});
    EXPECT_GT(odds, before);
    EXPECT_LT(SightLogOdds({200, found}, {800, 40}), odds);
    before = odds;
  }
}

// A view of little cannot say much.
TEST(SightOdds, FewInViewSayLittle) {
  EXPECT_LT(SightLogOdds({6, 1}, {30, 0}), 3.0);
  EXPECT_GT(SightLogOdds({3, 0}, {30, 0}), -1.0);
}

}  // namespace
}  // namespace planar_vslam
