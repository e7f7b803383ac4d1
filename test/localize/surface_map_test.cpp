#include "planar_vslam/localize/surface_map.h"

#include <gtest/gtest.h>

#include "floor_plan.h"

namespace planar_vslam {
namespace {

using test::FloorPlan;

const Eigen::Matrix3d kLoose = Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal();

TEST(SurfaceMap, TellsThePoseOfASweep) {
  const SurfaceMap map(test::MappedOffice(), ScanMatchOptions{});
  double squares = 0.0;
  int count = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Rigid2 truth(1.0 + 0.15 * seed, 1.6 + 0.02 * seed, 0.3 * seed);
    const std::optional<LaserFix> fix = map.Fix(test::Office().Sweep(truth, seed), FloorPlan::T_base_laser(),
                                                truth * Rigid2(0.06, -0.05, 0.03), kLoose);
    ASSERT_TRUE(fix.has_value()) << seed;
    EXPECT_TRUE(fix->complete);
    const Eigen::Vector3d off = LogSe2(truth.Inverse() * fix->T_map_base);
    EXPECT_LT(off.head<2>().norm(), 0.015);
    squares += off.dot(fix->covariance.inverse() * off);
    ++count;
  }
  EXPECT_LT(squares / count, 3.0) << "the covariance admits the error";
}

TEST(SurfaceMap, KnowsWhatABareCorridorDoesNotTell) {
  FloorPlan corridor;
  corridor.Wall(-20, -1, 20, -1).Wall(-20, 1, 20, 1);
  const SurfaceMap map(test::Mapped(corridor, {-4.0, 0.0}, {4.0, 0.1}), ScanMatchOptions{});
  const Rigid2 truth(0.3, 0.1, 0.05), guess = truth * Rigid2(0.05, 0.04, 0.02);
  const std::optional<LaserFix> fix = map.Fix(corridor.Sweep(truth), FloorPlan::T_base_laser(), guess, kLoose);
  ASSERT_TRUE(fix.has_value());
  EXPECT_FALSE(fix->complete);
  EXPECT_NEAR(fix->T_map_base.translation.y(), truth.translation.y(), 0.015);
}

TEST(SurfaceMap, SaysNothingOfARoomItDoesNotKnow) {
  const SurfaceMap map(test::MappedOffice(), ScanMatchOptions{});
  int fixes = 0;
  for (const double heading : {0.0, 1.0, 2.0, 3.0, -1.0, -2.0}) {
    const Rigid2 T(2.0, 1.8, heading);
    fixes +=
        map.Fix(test::Workshop().Sweep(Rigid2(1.5, 4.0, heading)), FloorPlan::T_base_laser(), T, kLoose).has_value();
  }
  EXPECT_EQ(fixes, 0);
  EXPECT_FALSE(map.Fix(test::Office().Sweep(Rigid2(1, 1, 0)), FloorPlan::T_base_laser(), Rigid2(50, 50, 0), kLoose));
  EXPECT_TRUE(SurfaceMap({}, ScanMatchOptions{}).empty());
}

}  // namespace
}  // namespace planar_vslam
