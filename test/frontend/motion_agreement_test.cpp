#include "planar_vslam/frontend/motion_agreement.h"

#include <gtest/gtest.h>

#include <cmath>

#include "planar_vslam/geometry/chi_square.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

// Two views of a synthetic world in an unscaled map, adjusted, and odometry between them.
class MotionAgreementTest : public ::testing::Test {
 protected:
  static Map TwoViews(const test::SyntheticWorld& world, double scale) {
    Map map = world.map;
    const KeyframeId second = std::next(map.keyframes.begin())->first;
    MapEdit edit;
    for (const auto& [id, keyframe] : world.map.keyframes) {
      if (id > second) edit.emplace_back(EraseKeyframe{id});
    }
    edit.emplace_back(TransformMap{scale, Rigid3()});
    edit.emplace_back(SetMetric{false});
    map = Apply(std::move(map), edit);
    const BundleResult bundle = AdjustBundle(map, WholeMapRequest(map), world.Context(), BundleSolver::kSchur);
    return Apply(std::move(map), ToEdit(bundle));
  }
  static double Disagreement(const Map& map, const test::SyntheticWorld& world, const Rigid2& error) {
    Map wrong = map;
    MapEdit edit;
    Keyframe keyframe = std::prev(map.keyframes.end())->second;
    keyframe.odometry_link->motion.T_i_j = keyframe.odometry_link->motion.T_i_j * error;
    wrong.keyframes.Edit(std::prev(map.keyframes.end())->first).odometry_link = keyframe.odometry_link;
    return SquaredMotionDisagreement(wrong, world.Context());
  }
};

TEST_F(MotionAgreementTest, TrueMotionAgreesWhateverTheScale) {
  test::SyntheticWorldOptions options;
  options.pixel_noise = 1.0;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    options.seed = seed;
    const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
    for (const double scale : {0.05, 1.0, 20.0}) {
      EXPECT_LT(Disagreement(TwoViews(world, scale), world, Rigid2()), 11.07) << "95 %, seed " << seed;
    }
  }
}

TEST_F(MotionAgreementTest, AnotherLengthAgreesAnotherTurnOrDirectionDoesNot) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const Map map = TwoViews(world, 0.3);
  const Rigid2 way = std::prev(map.keyframes.end())->second.odometry_link->motion.T_i_j;
  EXPECT_LT(Disagreement(map, world, Rigid2(0.1 * way.translation, 0.0)), kChi2FiveDof999);
  EXPECT_GT(Disagreement(map, world, Rigid2(0.0, 0.0, DegreesToRadians(8.0))), kChi2FiveDof999);
  EXPECT_GT(Disagreement(map, world, Rigid2(-2.0 * way.translation, 0.0)), kChi2FiveDof999);
  const Rigid2 sideways(Eigen::Vector2d(-way.translation.y(), way.translation.x()), 0.0);
  EXPECT_GT(Disagreement(map, world, sideways), kChi2FiveDof999);
}

}  // namespace
}  // namespace planar_vslam
