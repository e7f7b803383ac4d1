#include "planar_vslam/io/evaluation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

Rigid3 Pose(double x, double y, double yaw) { return Embed3(Rigid2(x, y, yaw)); }

// A curved drive with some height in it: 20 s at 10 Hz, about 0.5 m/s.
Trajectory Drive(double from_s = 0.0, double to_s = 20.0, double step_s = 0.1) {
  Trajectory trajectory;
  const auto first = static_cast<long>(std::lround(from_s / step_s)),
             last = static_cast<long>(std::lround(to_s / step_s));
  for (long i = first; i <= last; ++i) {
    const double t = static_cast<double>(i) * step_s;
    Rigid3 pose = Pose(3.0 * std::sin(0.2 * t), 2.0 * std::cos(0.3 * t), 0.25 * t);
    pose.translation.z() = 0.2 * std::sin(0.5 * t);
    trajectory.push_back({Timestamp::FromSeconds(t), pose});
  }
  return trajectory;
}

Trajectory Moved(Trajectory trajectory, const Rigid3& T, double scale = 1.0) {
  for (StampedPose& pose : trajectory) {
    pose.T_map_base = T * pose.T_map_base;
    pose.T_map_base.translation *= scale;
  }
  return trajectory;
}

TrajectoryErrors Evaluated(const Trajectory& estimate, const Trajectory& truth, EvaluationAlignment alignment) {
  const Expected<TrajectoryErrors> errors = EvaluateTrajectory(estimate, truth, alignment);
  EXPECT_TRUE(errors.ok()) << errors.error().message;
  return *errors;
}

void ExpectZero(const TrajectoryErrors& errors) {
  EXPECT_LT(errors.ate.max, 1e-9);
  EXPECT_LT(errors.ate_2d.max, 1e-9);
  EXPECT_LT(errors.heading.max, 1e-7);
  EXPECT_LT(errors.rpe_translation_per_meter, 1e-7);
  EXPECT_LT(errors.rpe_rotation_per_meter, 1e-6);
  EXPECT_LT(errors.rpe_translation_per_second, 1e-7);
  EXPECT_LT(errors.rpe_rotation_per_second, 1e-6);
  EXPECT_NEAR(errors.coverage, 1.0, 1e-12);
}

TEST(Evaluation, EachAlignmentUndoesItsOwnTransform) {
  std::mt19937 generator(3);
  const Trajectory truth = Drive();
  ExpectZero(Evaluated(truth, truth, EvaluationAlignment::kNone));
  for (int i = 0; i < 5; ++i) {
    const Rigid3 T = test::RandomRigid3(generator, 10.0);
    ExpectZero(Evaluated(Moved(truth, T), truth, EvaluationAlignment::kSe3));
    ExpectZero(Evaluated(Moved(truth, T), truth, EvaluationAlignment::kFirst));
    ExpectZero(Evaluated(Moved(truth, T, 0.3), truth, EvaluationAlignment::kSim3));
    ExpectZero(Evaluated(Moved(truth, Embed3(test::RandomRigid2(generator, 10.0))), truth, EvaluationAlignment::kSe2));
  }
}

TEST(Evaluation, AKnownOffsetIsTheError) {
  const Trajectory truth = Drive();
  const Rigid3 offset(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.3, -0.4, 1.2));
  const TrajectoryErrors errors = Evaluated(Moved(truth, offset), truth, EvaluationAlignment::kNone);
  EXPECT_EQ(errors.pairs, static_cast<long>(truth.size()));
  for (const double value : {errors.ate.rmse, errors.ate.mean, errors.ate.median, errors.ate.max})
    EXPECT_NEAR(value, 1.3, 1e-9);
  EXPECT_NEAR(errors.ate_2d.rmse, 0.5, 1e-9);
  EXPECT_NEAR((errors.ate_axis_rmse - Eigen::Vector3d(0.3, 0.4, 1.2)).norm(), 0.0, 1e-9);
  EXPECT_LT(errors.rpe_translation_per_meter, 1e-7);
  EXPECT_NEAR(errors.scale_error, 0.0, 1e-9);
  // SE(2) leaves the height, SE(3) takes it away.
  EXPECT_NEAR(Evaluated(Moved(truth, offset), truth, EvaluationAlignment::kSe2).ate.rmse, 1.2, 1e-9);
}

TEST(Evaluation, StatisticsOfOneOutlier) {
  Trajectory truth = Drive(), estimate = truth;
  estimate[10].T_map_base.translation.z() += 2.0;
  const TrajectoryErrors errors = Evaluated(estimate, truth, EvaluationAlignment::kNone);
  const auto count = static_cast<double>(truth.size());
  EXPECT_NEAR(errors.ate.max, 2.0, 1e-9);
  EXPECT_NEAR(errors.ate.mean, 2.0 / count, 1e-9);
  EXPECT_NEAR(errors.ate.rmse, 2.0 / std::sqrt(count), 1e-9);
  EXPECT_NEAR(errors.ate.median, 0.0, 1e-9);
}

TEST(Evaluation, HeadingErrorWrapsAtHalfATurn) {
  Trajectory truth, estimate;
  for (int i = 0; i < 10; ++i) {
    const Timestamp stamp = Timestamp::FromSeconds(0.1 * i);
    truth.push_back({stamp, Pose(0.1 * i, 0.0, M_PI - 0.01)});
    estimate.push_back({stamp, Pose(0.1 * i, 0.0, -M_PI + 0.02)});
  }
  EXPECT_NEAR(Evaluated(estimate, truth, EvaluationAlignment::kNone).heading.mean, 0.03, 1e-9);
}

TEST(Evaluation, ScaleErrorIsHowMuchTheEstimateIsTooLong) {
  const Trajectory truth = Drive();
  for (const EvaluationAlignment alignment : {EvaluationAlignment::kSe3, EvaluationAlignment::kSim3}) {
    EXPECT_NEAR(Evaluated(Moved(truth, Pose(1, 2, 3), 1.02), truth, alignment).scale_error, 0.02, 1e-9);
    EXPECT_NEAR(Evaluated(Moved(truth, Pose(1, 2, 3), 0.95), truth, alignment).scale_error, -0.05, 1e-9);
  }
}

TEST(Evaluation, DriftIsMeasuredPerMetreAndPerSecond) {
  Trajectory truth, estimate;
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.1 * i;
    truth.push_back({Timestamp::FromSeconds(t), Pose(0.5 * t, 0.0, 0.0)});
    estimate.push_back({Timestamp::FromSeconds(t), Pose(0.5 * t * 1.04, 0.0, 0.0)});
  }
  const TrajectoryErrors errors = Evaluated(estimate, truth, EvaluationAlignment::kFirst);
  EXPECT_NEAR(errors.rpe_translation_per_meter, 0.04, 1e-6);
  EXPECT_NEAR(errors.rpe_translation_per_second, 0.02, 1e-6);
  EXPECT_NEAR(Evaluated(estimate, truth, EvaluationAlignment::kSim3).rpe_translation_per_meter, 0.0, 1e-6);
}

TEST(Evaluation, TruthIsInterpolatedButNotAcrossGaps) {
  const Trajectory dense = Drive(0.0, 10.0, 0.02);
  Trajectory truth;
  for (std::size_t i = 0; i < dense.size(); i += 5) {
    const double t = dense[i].stamp.Seconds();
    if (t < 4.0 || t > 6.0) truth.push_back(dense[i]);
  }
  const TrajectoryErrors errors = Evaluated(dense, truth, EvaluationAlignment::kNone);
  EXPECT_LT(errors.ate.max, 1e-3);
  const auto in_gap = static_cast<long>(std::count_if(dense.begin(), dense.end(), [&](const StampedPose& pose) {
    const double t = pose.stamp.Seconds();
    return t > 3.9 + 1e-6 && t < 6.1 - 1e-6;
  }));
  EXPECT_EQ(errors.pairs, static_cast<long>(dense.size()) - in_gap);
}

TEST(Evaluation, StampsMeetToTheNanosecondAtLargeEpochs) {
  Trajectory truth = Drive();
  for (StampedPose& pose : truth) pose.stamp.nanoseconds += 1'700'000'000'000'000'000;
  EXPECT_LT(Evaluated(truth, truth, EvaluationAlignment::kNone).ate.max, 1e-12);
}

TEST(Evaluation, CoverageIsTheShareOfTheTruthsSpan) {
  const Trajectory truth = Drive(0.0, 20.0);
  EXPECT_NEAR(Evaluated(Drive(5.0, 15.0), truth, EvaluationAlignment::kNone).coverage, 0.5, 1e-9);
  EXPECT_NEAR(Evaluated(Drive(-5.0, 10.0), truth, EvaluationAlignment::kNone).coverage, 0.5, 1e-9);
  EXPECT_NEAR(Evaluated(Drive(-1.0, 25.0), truth, EvaluationAlignment::kNone).coverage, 1.0, 1e-9);
  // Poses a second apart are no continuous answer.
  EXPECT_NEAR(Evaluated(Drive(0.0, 20.0, 1.0), truth, EvaluationAlignment::kNone).coverage, 0.0, 1e-9);
  Trajectory with_hole;
  for (const StampedPose& pose : truth) {
    if (pose.stamp.Seconds() < 10.05 || pose.stamp.Seconds() > 13.95) with_hole.push_back(pose);
  }
  EXPECT_NEAR(Evaluated(with_hole, truth, EvaluationAlignment::kNone).coverage, 0.8, 1e-9);
}

TEST(Evaluation, NothingIsMeasuredWithoutOverlap) {
  const Trajectory truth = Drive(0.0, 10.0);
  for (const Trajectory& estimate : {Trajectory{}, Drive(11.0, 20.0), Drive(9.8, 12.0, 0.2)}) {
    const Expected<TrajectoryErrors> errors = EvaluateTrajectory(estimate, truth, EvaluationAlignment::kSe3);
    ASSERT_FALSE(errors.ok());
    EXPECT_NE(errors.error().message.find("10.000000000"), std::string::npos) << errors.error().message;
  }
  EXPECT_FALSE(EvaluateTrajectory(truth, {}, EvaluationAlignment::kSe3).ok());
}

TEST(Evaluation, SegmentsThatDoNotExistAreNotMeasured) {
  const Trajectory standing(Drive(0.0, 0.5));
  const TrajectoryErrors errors = Evaluated(standing, standing, EvaluationAlignment::kNone);
  EXPECT_TRUE(std::isnan(errors.rpe_translation_per_meter));
  EXPECT_TRUE(std::isnan(errors.rpe_rotation_per_second));
  EXPECT_TRUE(nlohmann::json::parse(ToJson(errors))["rpe_translation_per_meter"].is_null());
}

TEST(Evaluation, JsonHoldsTheNumbersAndTheTableIsAligned) {
  const Trajectory truth = Drive();
  const Rigid3 offset(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.3, -0.4, 1.2));
  const TrajectoryErrors errors = Evaluated(Moved(truth, offset), truth, EvaluationAlignment::kNone);
  const auto json = nlohmann::json::parse(ToJson(errors));
  EXPECT_EQ(json["ate_m"]["rmse"].get<double>(), errors.ate.rmse);
  EXPECT_EQ(json["ate_axis_rmse_m"][2].get<double>(), errors.ate_axis_rmse.z());
  EXPECT_EQ(json["coverage"].get<double>(), 1.0);
  EXPECT_EQ(json["pairs"].get<long>(), errors.pairs);
  const std::string text = ToText(errors);
  EXPECT_NE(text.find("ATE                 1.3000    1.3000    1.3000    1.3000  m\n"), std::string::npos) << text;
}

TEST(Evaluation, AGivenTransformIsNotFitted) {
  const Trajectory truth = Drive();
  const Rigid3 T_truth_map = Embed3(Rigid2(1.0, -2.0, 0.4));
  const Trajectory in_map = Moved(truth, T_truth_map.Inverse());
  const Expected<TrajectoryErrors> errors = EvaluateTrajectory(in_map, truth, Similarity3{1.0, T_truth_map});
  ASSERT_TRUE(errors.ok());
  EXPECT_LT(errors->ate.max, 1e-9);
  const Rigid3 T_off = Embed3(Rigid2(1.3, -2.0, 0.4));
  EXPECT_NEAR(EvaluateTrajectory(in_map, truth, Similarity3{1.0, T_off})->ate.rmse, 0.3, 1e-9) << "the offset stays";
}

TEST(Evaluation, PlotShowsTheGridWhereTheAlignmentPutsIt) {
  const test::TemporaryFolder folder;
  const Trajectory truth = Drive();
  PlotLayers layers;
  layers.grid = OccupancyGrid2d{3, 2, 0.5, {-0.5, 0.0}, {0, 0, 100, -1, -1, 100}};
  layers.beside = truth;
  layers.beside_name = "odometry";
  const TrajectoryErrors errors = Evaluated(truth, truth, EvaluationAlignment::kNone);
  const auto path = folder.path() / "plot.svg";
  ASSERT_TRUE(WriteSvgPlot(truth, truth, errors, path, layers).ok());
  std::ifstream stream(path);
  const std::string svg{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  EXPECT_NE(svg.find("d=\"M0 0h2v1h-2z\""), std::string::npos) << "free cells, in a run";
  EXPECT_NE(svg.find("d=\"M2 0h1v1h-1zM2 1h1v1h-1z\""), std::string::npos) << "occupied cells";
  EXPECT_NE(svg.find(">odometry</text>"), std::string::npos);
}

TEST(Evaluation, PlotIsAClosedPictureOfFiniteNumbers) {
  const test::TemporaryFolder folder;
  const Trajectory truth = Drive();
  Trajectory standing = Drive();
  for (StampedPose& pose : standing) pose.T_map_base = Rigid3{};
  for (const Trajectory& estimate : {Moved(truth, Pose(1, 2, 3), 1.1), standing}) {
    const TrajectoryErrors errors = Evaluated(estimate, truth, EvaluationAlignment::kSe3);
    const auto path = folder.path() / "plot.svg";
    ASSERT_TRUE(WriteSvgPlot(estimate, truth, errors, path).ok());
    std::ifstream stream(path);
    const std::string svg{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    EXPECT_EQ(svg.rfind("<svg ", 0), 0U);
    EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
    for (const char* expected : {"x [m]", "y [m]", "ground truth", "estimate", "[s]"}) {
      EXPECT_NE(svg.find(expected), std::string::npos) << expected;
    }
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
  }
  EXPECT_FALSE(WriteSvgPlot(truth, truth, TrajectoryErrors{}, folder.path() / "no" / "plot.svg").ok());
}

}  // namespace
}  // namespace planar_vslam
