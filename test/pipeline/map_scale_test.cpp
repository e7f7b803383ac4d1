#include "planar_vslam/pipeline/map_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/optimize/map_ties.h"
#include "planar_vslam/pipeline/options.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

test::SyntheticWorld World(int keyframes) {
  test::SyntheticWorldOptions options;
  options.keyframes = keyframes;
  return test::MakeSyntheticWorld(options);
}

TEST(AssessScale, WheelsSeeAMapThatIsTooLarge) {
  const test::SyntheticWorld world = World(20);
  for (const double size : {1.0, 1.05, 0.97}) {
    const Map map = Apply(world.map, {TransformMap{size, Rigid3()}});
    const MapScale scale = AssessScale(map, ScaleOptions{}, SystematicErrors{});
    ASSERT_TRUE(scale.wheels.has_value());
    EXPECT_NEAR(scale.wheels->log_scale, -std::log(size), 1e-3) << size;
    EXPECT_GE(scale.wheels->sigma, SystematicErrors{}.wheels);
    EXPECT_FALSE(scale.laser.has_value());
    ASSERT_TRUE(scale.fused.has_value());
  }
}

TEST(AssessScale, AnUnscaledMapBecomesMetricByIt) {
  const test::SyntheticWorld world = World(20);
  const Map unscaled = Apply(world.map, {TransformMap{0.4, Rigid3()}, SetMetric{false}});
  const MapScale scale = AssessScale(unscaled, ScaleOptions{}, SystematicErrors{});
  ASSERT_TRUE(scale.track.has_value());
  EXPECT_NEAR(scale.track->scale, 2.5, 0.01);
  const Map metric = ScaledToMetric(unscaled, scale.track->scale);
  EXPECT_TRUE(metric.metric);
  EXPECT_LT((metric.keyframes.begin()->second.T_map_base.translation).norm(), 1e-9);
  const auto span = [](const Map& m) {
    return (std::prev(m.keyframes.end())->second.T_map_base.translation -
            m.keyframes.begin()->second.T_map_base.translation)
        .norm();
  };
  EXPECT_NEAR(span(metric), span(world.map), 0.01 * span(world.map));
}

TEST(AssessScale, LaserAndWheelsThatDisagreeAreNamed) {
  const test::SyntheticWorld world = World(20);
  Map map = world.map;
  const auto second = std::next(world.map.keyframes.begin());
  PlanarMotion longer = second->second.odometry_link->motion;
  longer.T_i_j.translation *= 1.1;
  longer.covariance = 1e-8 * Eigen::Matrix3d::Identity();
  map = Apply(std::move(map), {AddLaserLinks{second->first, {MotionLink{world.map.keyframes.begin()->first, longer}}}});
  const MapScale scale = AssessScale(map, ScaleOptions{}, SystematicErrors{});
  ASSERT_TRUE(scale.laser.has_value());
  EXPECT_NEAR(scale.laser->log_scale, std::log(1.1), 0.02);
  EXPECT_FALSE(scale.consistent);
}

TEST(AssessScale, WithoutOdometryNothingIsSaid) {
  test::SyntheticWorld world = World(8);
  for (const KeyframeId id : world.map.keyframes.Ids()) {
    Keyframe& keyframe = world.map.keyframes.Edit(id);
    keyframe.odometry_link.reset();
  }
  EXPECT_FALSE(AssessScale(world.map, ScaleOptions{}, SystematicErrors{}).fused.has_value());
}

MapScale Opinion(double log_scale, double sigma, double distance) {
  MapScale scale;
  scale.track = ScaleEstimate{std::exp(log_scale), sigma, distance, 30, 0};
  scale.wheels = ScaleMeasurement{log_scale, sigma};
  scale.fused = scale.wheels;
  return scale;
}

TEST(ScaleGate, SaysWhatIsMissing) {
  const ScaleOptions options;
  ScaleGate gate;
  EXPECT_NE(gate.Missing(MapScale{}, options).find("drive on"), std::string::npos);
  EXPECT_NE(gate.Missing(Opinion(0.8, 0.002, 0.4), options).find("0.6 m more"), std::string::npos);
  const std::string wide = gate.Missing(Opinion(0.8, 0.02, 2.0), options);
  EXPECT_NE(wide.find("2.0 %"), std::string::npos) << wide;
  EXPECT_NE(wide.find("drive 6.0 m more"), std::string::npos) << wide;
}

TEST(ScaleGate, WaitsUntilTheScaleStays) {
  const ScaleOptions options;
  ScaleGate gate;
  for (const double log_scale : {0.80, 0.85, 0.82}) {
    EXPECT_FALSE(gate.Missing(Opinion(log_scale, 0.005, 2.0), options).empty());
  }
  for (int k = 0; k < 2; ++k) gate.Missing(Opinion(0.82, 0.005, 2.0), options);
  EXPECT_EQ(gate.Missing(Opinion(0.821, 0.005, 2.0), options), "");
  MapScale disagreeing = Opinion(0.82, 0.005, 2.0);
  disagreeing.consistent = false;
  EXPECT_NE(gate.Missing(disagreeing, options).find("disagree"), std::string::npos);
}

// One key for what wheels read wrong throughout: scale and pose covariances know it from there.
TEST(SystematicErrors, WidenScaleAndPoseCovarianceTogether) {
  const test::SyntheticWorld world = World(20);
  const std::vector<MapTie> ties = TiesOf(world.map, world.Context());
  const KeyframeId last = std::prev(world.map.keyframes.end())->first;
  const auto scale_sigma = [&world](const PipelineOptions& options) {
    return AssessScale(world.map, options.scale, options.systematic).wheels->sigma;
  };
  const auto position_variance = [&](const PipelineOptions& options) {
    return MapUncertainty(world.map, ties, options.systematic).CovarianceOf(last).topLeftCorner<2, 2>().trace();
  };
  const PipelineOptions usual;
  const PipelineOptions worse = SetOption(usual, "systematic.wheels=0.2").value();
  EXPECT_GT(scale_sigma(worse), 2.0 * scale_sigma(usual));
  EXPECT_GT(position_variance(worse), 1.05 * position_variance(usual));
}

TEST(ScaleOptions, NameWhatIsWrong) {
  ScaleOptions options;
  EXPECT_TRUE(options.Problems().empty());
  options.keyframes = 2;
  options.max_sigma = 0.0;
  options.height_sigma = -1.0;
  EXPECT_EQ(options.Problems().size(), 3U);
}

}  // namespace
}  // namespace planar_vslam
