// A robot that is carried on while it sees nothing, from the first image to the final map: it finds home, and the map
// is one again. With the jobs in turn, and beside the drive.
#include <gtest/gtest.h>

#include "planar_vslam/io/evaluation.h"
#include "planar_vslam/io/run_session.h"
#include "planar_vslam/sim/dataset_writer.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/variants.h"
#include "planar_vslam/sim/world.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

class KidnappedEndToEnd : public ::testing::TestWithParam<Schedule> {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TemporaryFolder>();
    const Expected<World> world = LoadWorld(test::SourceFolder() / "config/worlds/sample_lab.yaml");
    ASSERT_TRUE(world.ok()) << world.error().message;
    const Expected<World> kidnapped = ApplyVariants(*world, {"kidnap"}, 1);
    ASSERT_TRUE(kidnapped.ok()) << kidnapped.error().message;
    Expected<Simulation> simulation = Simulation::Create(*kidnapped, SimulationOptions{});
    ASSERT_TRUE(simulation.ok()) << simulation.error().message;
    ASSERT_TRUE(WriteDataset(*simulation, Drive()).ok());
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static fs::path Drive() { return folder_->path() / "drive"; }

  static double Error(const Trajectory& estimate) {
    const Expected<TrajectoryErrors> errors =
        EvaluateTrajectory(estimate, *ReadTrajectory(Drive() / "groundtruth_base.txt"), EvaluationAlignment::kSe2);
    EXPECT_TRUE(errors.ok());
    return errors->ate.rmse;
  }

  static std::unique_ptr<test::TemporaryFolder> folder_;
};
std::unique_ptr<test::TemporaryFolder> KidnappedEndToEnd::folder_;

TEST_P(KidnappedEndToEnd, FindsHomeAndTheMapIsOneAgain) {
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(Drive(), RecordingOptions{});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  Estimator estimator({PipelineOptions{}, (*recording)->info().camera, true, true, GetParam()});
  Trajectory wheels;
  RunSettings settings;
  if (GetParam() == Schedule::kThreaded) settings.rate = 1.0;  // the robot's: jobs keep up with it
  settings.on_odometry = [&wheels](const OdometryReading& reading) {
    wheels.push_back({reading.stamp, Embed3(reading.T_odom_base)});
  };
  ASSERT_TRUE(RunSession(**recording, estimator, settings).ok());
  ASSERT_NE(estimator.map(), nullptr);
  EXPECT_TRUE(Validate(*estimator.map()).empty());
  EXPECT_TRUE(estimator.report().failed_adjustments.empty());
  ASSERT_FALSE(estimator.report().loops.empty());
  EXPECT_GT(estimator.report().loops.front().closed.T_before_after.translation.norm(), 1.0)
      << "as far as it was carried";
  Trajectory estimate;
  for (const auto& [stamp, T] : estimator.trajectory().Poses(*estimator.map())) estimate.push_back({stamp, T});
  const double error = Error(estimate), odometry_alone = Error(wheels);
  EXPECT_LT(error, 0.05);
  EXPECT_GT(odometry_alone, 0.3) << "no kidnapping";
}

INSTANTIATE_TEST_SUITE_P(Schedules, KidnappedEndToEnd, ::testing::Values(Schedule::kInline, Schedule::kThreaded),
                         [](const auto& schedule) {
                           return schedule.param == Schedule::kInline ? "Inline" : "Threaded";
                         });

}  // namespace
}  // namespace planar_vslam
