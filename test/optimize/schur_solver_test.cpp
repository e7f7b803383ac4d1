// The solver of a neighbourhood against Ceres, on the same problems.
#include "schur_solver.h"

#include <gtest/gtest.h>

#include <random>

#include "bundle_ceres.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr BundleLimits kToTheEnd{100, 1e-13};

struct Case {
  const char* name;
  PlanarMode mode;
  bool metric;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

// Both solvers from the same start to the end. In a valley, along which the cost hardly changes, Ceres stops on the
// way: ours may be lower by the share `valley`.
void ExpectSameMinimum(const BundleProblem& problem, double valley = 1e-6) {
  BundleProblem schur = problem, ceres = problem;
  const BundleOutcome ours = SolveWithSchur(&schur, kToTheEnd), theirs = SolveWithCeres(&ceres, kToTheEnd);
  ASSERT_TRUE(ours.usable) << ours.message;
  ASSERT_TRUE(theirs.usable) << theirs.message;
  EXPECT_NEAR(ours.initial_cost, theirs.initial_cost, 1e-9 * theirs.initial_cost);
  EXPECT_LE(ours.final_cost, (1.0 + 1e-6) * theirs.final_cost);
  EXPECT_GE(ours.final_cost, (1.0 - valley) * theirs.final_cost);
  EXPECT_LT(ours.final_cost, ours.initial_cost);
}

class SchurSolver : public ::testing::TestWithParam<Case> {
 protected:
  // A window in the middle of a noisy map: some keyframes before and after it are fixed.
  static BundleProblem Problem(std::uint32_t seed) {
    test::SyntheticWorldOptions options;
    options.keyframes = 14;
    options.points = 120;
    options.floor_points = 120;
    options.pixel_noise = 1.0;
    options.seed = seed;
    const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
    Map map = test::Perturbed(world, 0.03, 0.01, 0.05, seed + 1);
    map.metric = GetParam().metric;
    map.keyframes.Edit(KeyframeId{6}).on_floor = false;
    map.keyframes.Edit(KeyframeId{8}).laser_links = {
        {KeyframeId{7}, map.keyframes.At(KeyframeId{8}).odometry_link->motion}};
    BundleRequest request = WholeMapRequest(map);
    request.free_keyframes.clear();
    request.fixed_keyframes.clear();
    for (const auto& [id, keyframe] : map.keyframes) {
      (id.value >= 3 && id.value < 12 ? request.free_keyframes : request.fixed_keyframes).push_back(id);
    }
    MeasurementModel model = world.Context();
    model.planar.mode = GetParam().mode;
    model.planar.floor_points = true;
    BundleProblem problem = MakeBundleProblem(map, request, model);
    RefreshWhitening(&problem);
    return problem;
  }
};

INSTANTIATE_TEST_SUITE_P(Forms, SchurSolver,
                         ::testing::Values(Case{"off", PlanarMode::kOff, true},
                                           Case{"soft", PlanarMode::kSoftSe3, true},
                                           Case{"se2_xyz", PlanarMode::kSe2Xyz, true},
                                           Case{"hard", PlanarMode::kHard, true},
                                           Case{"unscaled", PlanarMode::kSoftSe3, false}));

TEST_P(SchurSolver, FindsTheMinimumThatCeresFinds) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) ExpectSameMinimum(Problem(seed));
}

TEST_P(SchurSolver, FindsItAmongOutliers) {
  BundleProblem problem = Problem(5);
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> off(-40.0, 40.0);
  for (std::size_t i = 0; i < problem.observations.size(); i += 11) {
    problem.observations[i].pixel += Eigen::Vector2d(off(generator), off(generator));
  }
  for (std::size_t i = 3; i < problem.observations.size(); i += 17) problem.observations[i].inlier = false;
  ExpectSameMinimum(problem);
}

TEST_P(SchurSolver, FindsItWhereAPoseSeesNothing) {
  BundleProblem problem = Problem(6);
  for (BundleObservation& o : problem.observations) {
    if (problem.poses[o.pose].id == KeyframeId{5}) o.inlier = false;
  }
  ExpectSameMinimum(problem);
}

TEST_P(SchurSolver, FindsItWherePointsAreSeenOnceOrNever) {
  BundleProblem problem = Problem(7);
  std::uint32_t last = 0;
  for (BundleObservation& o : problem.observations) {
    const bool first = &o == &problem.observations.front() || o.point != last;
    last = o.point;
    if (o.point % 9 == 0 && !first) o.inlier = false;
    if (o.point % 10 == 0) o.inlier = false;
  }
  ExpectSameMinimum(problem, 1e-4);  // a point on one ray
}

TEST_P(SchurSolver, FindsItWithoutAFixedPose) {
  if (!GetParam().metric) GTEST_SKIP() << "seven directions in which nothing changes: the minimum is a valley";
  BundleProblem problem = Problem(8);
  for (BundlePose& pose : problem.poses) {
    if (pose.freedom == PoseFreedom::kFixed) {
      pose.freedom = IsPlanar(problem.planar.mode) && pose.on_floor ? PoseFreedom::kFloor : PoseFreedom::kFree;
    }
  }
  ExpectSameMinimum(problem);
}

TEST_P(SchurSolver, FindsItWhereTheOriginMayTilt) {
  BundleProblem problem = Problem(9);
  problem.poses.front().freedom = PoseFreedom::kLevel;
  ExpectSameMinimum(problem);
  const Rigid3 before = problem.poses.front().T_map_base;
  ASSERT_TRUE(SolveWithSchur(&problem, kToTheEnd).usable);
  const Rigid3& after = problem.poses.front().T_map_base;
  EXPECT_EQ(after.translation.head<2>(), before.translation.head<2>());
  constexpr double kSecondOrder = 1e-3;  // of steps about x and y in turn
  EXPECT_NEAR(LogSo3(after.rotation * before.rotation.conjugate()).z(), 0.0, kSecondOrder);
}

TEST_P(SchurSolver, LeavesWhatIsBehindTheCameraWhereItIs) {
  BundleProblem problem = Problem(9);
  BundlePoint& point = problem.points[20];
  const BundlePose& pose = problem.poses[4];
  point.p_map = pose.T_map_base * pose.T_base_camera * Eigen::Vector3d(0.0, 0.0, -2.0);
  for (BundleObservation& o : problem.observations) {
    if (o.point == 20) o.inlier = o.pose == 4;
  }
  problem.floor_points.clear();
  const Eigen::Vector3d before = point.p_map;
  ASSERT_TRUE(SolveWithSchur(&problem, kToTheEnd).usable);
  EXPECT_EQ(problem.points[20].p_map, before);
}

TEST_P(SchurSolver, EndsAtOnceAtTheMinimum) {
  BundleProblem problem = Problem(10);
  ASSERT_TRUE(SolveWithSchur(&problem, kToTheEnd).usable);
  const BundleOutcome again = SolveWithSchur(&problem, BundleLimits{});
  EXPECT_LE(again.iterations, 3);
  EXPECT_LE(again.final_cost, again.initial_cost);
}

TEST_P(SchurSolver, InAHurryItTakesOneStep) {
  BundleProblem problem = Problem(12);
  const std::atomic<bool> hurry{true};
  const BundleOutcome outcome = SolveWithSchur(&problem, BundleLimits{50, 1e-15, &hurry});
  EXPECT_TRUE(outcome.usable);
  EXPECT_EQ(outcome.iterations, 2) << "the first evaluation, and a step";
  EXPECT_LT(outcome.final_cost, outcome.initial_cost);
}

TEST_P(SchurSolver, NeverRaisesTheCost) {
  for (int iterations = 1; iterations < 8; ++iterations) {
    BundleProblem problem = Problem(11);
    const BundleOutcome outcome = SolveWithSchur(&problem, BundleLimits{iterations, 0.0});
    ASSERT_TRUE(outcome.usable);
    EXPECT_LE(outcome.final_cost, outcome.initial_cost);
    BundleProblem copy = problem;
    EXPECT_NEAR(SolveWithCeres(&copy, BundleLimits{1, 0.0}).initial_cost, outcome.final_cost, 1e-9 * outcome.final_cost)
        << "the state is that of the cost";
  }
}

}  // namespace
}  // namespace planar_vslam
