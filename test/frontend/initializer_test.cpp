#include "planar_vslam/frontend/initializer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "planar_vslam/frontend/motion_agreement.h"
#include "planar_vslam/geometry/chi_square.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

class InitializerTest : public ::testing::Test {
 protected:
  InitializerTest() : world_(test::MakeSyntheticWorld({})) {}

  Initializer Make(InitializationMode mode, double pixel_sigma = 1.0) const {
    InitializerOptions options;
    options.mode = mode;
    MeasurementModel model = world_.Context();
    model.pixel_sigma = pixel_sigma;
    return {options, model, world_.map.octave_scales};
  }
  // The frame at `T_map_base`, with odometry from the one before.
  InitializerInput Input(const Rigid3& T_map_base, bool with_odometry, double pixel_noise = 0.3) {
    ++frame_;
    InitializerInput input;
    input.stamp = Timestamp::FromSeconds(0.1 * static_cast<double>(frame_));
    input.features = test::Observe(world_, T_map_base * world_.T_base_camera, pixel_noise, frame_).features;
    input.T_base_camera = world_.T_base_camera;
    if (with_odometry && T_map_last_.has_value())
      input.odometry = test::ExactOdometry(world_, *T_map_last_, T_map_base);
    T_map_last_ = T_map_base;
    return input;
  }
  // True position of the world's point a landmark shows, found by its descriptor.
  Eigen::Vector3d Truth(const Landmark& landmark) const {
    for (const auto& [id, original] : world_.map.landmarks) {
      if (original.descriptor == landmark.descriptor) return world_.true_points[id.value];
    }
    ADD_FAILURE() << "a landmark of nothing in the world";
    return Eigen::Vector3d::Zero();
  }

  test::SyntheticWorld world_;
  std::optional<Rigid3> T_map_last_;
  std::uint32_t frame_ = 0;
};

TEST_F(InitializerTest, WaitsWhileTheRobotOnlyRotatesAndSaysSo) {
  Initializer initializer = Make(InitializationMode::kOdometry);
  EXPECT_FALSE(initializer.Add(Input(Rigid3(), true)).map.has_value());
  for (int i = 1; i <= 5; ++i) {
    const InitializerReport report = initializer.Add(Input(Embed3(Rigid2(0.0, 0.0, DegreesToRadians(3.0 * i))), true));
    EXPECT_FALSE(report.map.has_value());
    EXPECT_NE(report.waiting_for.find("translation"), std::string::npos) << report.waiting_for;
  }
}

TEST_F(InitializerTest, OdometryMakesAMetricMapOfTheFirstPairWithABaseline) {
  Initializer initializer = Make(InitializationMode::kOdometry);
  InitializerReport report;
  double x = 0.5;
  const Rigid3 T_map_first = test::SyntheticPose(x);
  while (!report.map.has_value() && x < 1.0) {
    report = initializer.Add(Input(test::SyntheticPose(x), true));
    EXPECT_EQ(report.map.has_value(), report.waiting_for.empty());
    x += 0.05;
  }
  ASSERT_TRUE(report.map.has_value()) << report.waiting_for;
  const Map& map = *report.map;
  EXPECT_TRUE(Validate(map).empty());
  EXPECT_TRUE(map.metric);
  ASSERT_EQ(map.keyframes.size(), 2U);
  const Keyframe &first = map.keyframes.At(KeyframeId{0}), &second = map.keyframes.At(KeyframeId{1});
  EXPECT_LT(LogSe2(ProjectToPlane(first.T_map_base)).norm(), 1e-6) << "the first base is over the origin";
  EXPECT_LT(LogSe3(first.T_map_base).norm(), 1e-3) << "and on the floor as well as its images say";
  const Rigid3 T_first_second = T_map_first.Inverse() * *T_map_last_;
  EXPECT_LT((second.T_map_base.translation - T_first_second.translation).norm(),
            0.05 * T_first_second.translation.norm());
  ASSERT_TRUE(second.odometry_link.has_value());
  EXPECT_EQ(second.odometry_link->from, KeyframeId{0});
  EXPECT_LT((second.odometry_link->motion.T_i_j.translation - ProjectToPlane(T_first_second).translation).norm(), 1e-9);
  std::vector<double> errors;
  for (const auto& [id, landmark] : map.landmarks) {
    const Eigen::Vector3d truth = T_map_first.Inverse() * Truth(landmark);
    errors.push_back((landmark.p_map - truth).norm() / truth.norm());
  }
  ASSERT_GE(errors.size(), 50U);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.05);
}

TEST_F(InitializerTest, VisualMapHasUnitMedianDepthAndClaimsNoScale) {
  Initializer initializer = Make(InitializationMode::kVisual);
  InitializerReport report;
  const Rigid3 T_map_first = test::SyntheticPose(0.5);
  double x = 0.5;
  while (!report.map.has_value() && x < 1.2) {
    report = initializer.Add(Input(test::SyntheticPose(x), false, 0.2));
    x += 0.05;
  }
  ASSERT_TRUE(report.map.has_value()) << report.waiting_for;
  const Map& map = *report.map;
  EXPECT_TRUE(Validate(map).empty());
  EXPECT_FALSE(map.metric);
  const Keyframe& second = map.keyframes.At(KeyframeId{1});
  EXPECT_FALSE(second.odometry_link.has_value());
  const Rigid3 T_camera_map = map.keyframes.At(KeyframeId{0}).T_map_camera().Inverse();
  std::vector<double> depths;
  for (const auto& [id, landmark] : map.landmarks) depths.push_back((T_camera_map * landmark.p_map).z());
  std::sort(depths.begin(), depths.end());
  EXPECT_NEAR(depths[depths.size() / 2], 1.0, 0.15);
  const Rigid3 T_c1_c2 = T_camera_map * second.T_map_camera();
  const Rigid3 truth = (T_map_first * world_.T_base_camera).Inverse() * *T_map_last_ * world_.T_base_camera;
  EXPECT_GT(T_c1_c2.translation.normalized().dot(truth.translation.normalized()), 0.98);
  EXPECT_LT(LogSo3(T_c1_c2.rotation.conjugate() * truth.rotation).norm(), 0.02);
}

TEST_F(InitializerTest, VisualWithOdometryThatAgreesStartsTheWayTheRobotWent) {
  Initializer initializer = Make(InitializationMode::kVisual);
  InitializerReport report;
  const Rigid3 T_map_first = test::SyntheticPose(0.5);
  for (double x = 0.5; !report.map.has_value() && x < 1.2; x += 0.05) {
    report = initializer.Add(Input(test::SyntheticPose(x), true));
  }
  ASSERT_TRUE(report.map.has_value()) << report.waiting_for;
  EXPECT_FALSE(report.map->metric);
  EXPECT_LT(SquaredMotionDisagreement(*report.map, world_.Context()), kChi2FiveDof999);
  const Rigid3 T_c1_c2 = report.map->keyframes.At(KeyframeId{0}).T_map_camera().Inverse() *
                         report.map->keyframes.At(KeyframeId{1}).T_map_camera();
  const Rigid3 truth = (T_map_first * world_.T_base_camera).Inverse() * *T_map_last_ * world_.T_base_camera;
  EXPECT_GT(T_c1_c2.translation.normalized().dot(truth.translation.normalized()), 0.98);
}

TEST_F(InitializerTest, VisualWaitsWhileOdometryContradictsItAndSaysSo) {
  Initializer initializer = Make(InitializationMode::kVisual);
  bool named = false;
  for (double x = 0.5; x < 1.2; x += 0.05) {
    InitializerInput input = Input(test::SyntheticPose(x), true);
    if (input.odometry.has_value()) input.odometry->T_i_j = input.odometry->T_i_j.Inverse();
    const InitializerReport report = initializer.Add(input);
    EXPECT_FALSE(report.map.has_value());
    named = named || report.waiting_for.find("images and odometry agree") != std::string::npos;
  }
  EXPECT_TRUE(named);
}

TEST_F(InitializerTest, VisualWaitsForABaselineThatOdometryKnows) {
  Initializer initializer = Make(InitializationMode::kVisual);
  initializer.Add(Input(test::SyntheticPose(0.5), true));
  const InitializerReport report = initializer.Add(Input(test::SyntheticPose(0.51), true));
  EXPECT_NE(report.waiting_for.find("translation"), std::string::npos) << report.waiting_for;
}

TEST_F(InitializerTest, VisualWaitsWhileNothingMoves) {
  Initializer initializer = Make(InitializationMode::kVisual);
  for (int i = 0; i < 5; ++i) {
    const InitializerReport report = initializer.Add(Input(test::SyntheticPose(0.5), false));
    EXPECT_FALSE(report.map.has_value());
    EXPECT_FALSE(report.waiting_for.empty());
  }
}

TEST_F(InitializerTest, AsksForTextureWhereThereIsNone) {
  Initializer initializer = Make(InitializationMode::kOdometry);
  InitializerInput blank = Input(test::SyntheticPose(0.5), true);
  blank.features = std::make_shared<const FrameFeatures>();
  EXPECT_NE(initializer.Add(blank).waiting_for.find("texture"), std::string::npos);
  initializer.Add(Input(test::SyntheticPose(0.5), true));
  blank.odometry = test::ExactOdometry(world_, test::SyntheticPose(0.5), test::SyntheticPose(0.5));
  EXPECT_NE(initializer.Add(blank).waiting_for.find("texture"), std::string::npos);
}

TEST_F(InitializerTest, TakesANewFirstFrameAfterALongWait) {
  InitializerOptions options;
  options.max_baseline_time = 0.35;  // s: three frames of this test
  Initializer initializer(options, world_.Context(), world_.map.octave_scales);
  for (int i = 0; i < 6; ++i) initializer.Add(Input(test::SyntheticPose(0.0), true));
  InitializerReport report;
  double x = 0.5;
  while (!report.map.has_value() && x < 1.0) {
    report = initializer.Add(Input(test::SyntheticPose(x), true));
    x += 0.1;
  }
  ASSERT_TRUE(report.map.has_value()) << report.waiting_for;
  EXPECT_GT(report.map->keyframes.At(KeyframeId{0}).stamp, Timestamp::FromSeconds(0.35));
}

TEST_F(InitializerTest, TakesPointsAsFarOffAsThePixelSigmaSays) {
  for (const InitializationMode mode : {InitializationMode::kOdometry, InitializationMode::kVisual}) {
    // Landmarks of the first map, none where there is no map, from keypoints that are off by 0.3 px.
    const auto landmarks = [this, mode](double pixel_sigma) {
      Initializer initializer = Make(mode, pixel_sigma);
      T_map_last_.reset();
      frame_ = 0;
      InitializerReport report;
      for (double x = 0.5; !report.map.has_value() && x < 1.2; x += 0.05) {
        report = initializer.Add(Input(test::SyntheticPose(x), true));
      }
      return report.map.has_value() ? static_cast<double>(report.map->landmarks.size()) : 0.0;
    };
    EXPECT_GT(landmarks(1.0), 1.2 * landmarks(0.05)) << static_cast<int>(mode);
  }
}

TEST(InitializerOptions, NameWhatIsWrong) {
  InitializerOptions options;
  EXPECT_TRUE(options.Problems().empty());
  options.min_baseline = 0.0;
  options.min_points = 3;
  EXPECT_EQ(options.Problems().size(), 2U);
}

}  // namespace
}  // namespace planar_vslam
