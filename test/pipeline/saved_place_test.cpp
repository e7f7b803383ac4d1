// A room that was mapped once and is entered again with furniture moved, by other light, somewhere in the middle: with
// the laser the robot is found while it drives, and stays where it is.
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

class SavedPlace : public ::testing::Test {
 protected:
  static constexpr double kBegin = 3.0, kEnd = 11.0;  // s, of the second visit

  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TemporaryFolder>();
    Render("first", "mapping", {}, 20.0);
    Render("second", "repeat", {"light=lamps-off", "moved-furniture"}, kEnd + 1.0);
    Expected<std::unique_ptr<Recording>> recording = OpenRecording(Drive("first"), RecordingOptions{});
    ASSERT_TRUE(recording.ok()) << recording.error().message;
    Estimator estimator({PipelineOptions{}, (*recording)->info().camera, true, true, Schedule::kInline});
    ASSERT_TRUE(RunSession(**recording, estimator, RunSettings{}).ok());
    ASSERT_NE(estimator.map(), nullptr);
    saved_ = std::make_unique<SavedMap>(SavedMap{*estimator.map(), (*recording)->info().camera});
    Trajectory estimate;
    for (const auto& [stamp, T] : estimator.trajectory().Poses(*estimator.map())) estimate.push_back({stamp, T});
    const Expected<TrajectoryErrors> errors = EvaluateTrajectory(
        estimate, *ReadTrajectory(Drive("first") / "groundtruth_base.txt"), EvaluationAlignment::kSe2);
    ASSERT_TRUE(errors.ok());
    T_truth_map_ = ProjectToPlane(errors->truth_from_estimate.T_target_source);
  }
  static void TearDownTestSuite() {
    folder_.reset();
    saved_.reset();
  }
  static void Render(const std::string& name, const std::string& drive, const std::vector<std::string>& variants,
                     double until) {
    const Expected<World> world = LoadWorld(test::SourceFolder() / "config/worlds/sample_lab.yaml");
    ASSERT_TRUE(world.ok()) << world.error().message;
    const Expected<World> driven = ChooseDrive(*world, drive);
    ASSERT_TRUE(driven.ok()) << driven.error().message;
    const Expected<World> changed = ApplyVariants(*driven, variants, 1);
    ASSERT_TRUE(changed.ok()) << changed.error().message;
    SimulationOptions options;
    options.until = until;
    Expected<Simulation> simulation = Simulation::Create(*changed, options);
    ASSERT_TRUE(simulation.ok()) << simulation.error().message;
    ASSERT_TRUE(WriteDataset(*simulation, Drive(name)).ok());
  }
  static fs::path Drive(const std::string& name) { return folder_->path() / name; }

  // The second visit in a map.
  static std::vector<FrameReport> Localize(const SavedMap& saved, LaserLocalize laser,
                                           Schedule schedule = Schedule::kInline) {
    Expected<std::unique_ptr<Recording>> recording = OpenRecording(Drive("second"), RecordingOptions{});
    EXPECT_TRUE(recording.ok());
    PipelineOptions options;
    options.mode = RunMode::kLocalization;
    options.laser_localize = laser;
    Estimator estimator({options, (*recording)->info().camera, true, true, schedule});
    EXPECT_TRUE(estimator.LoadMap(saved).ok());
    RunSettings settings;
    settings.from = kBegin;
    settings.until = kEnd;
    const Expected<RunResult> result = RunSession(**recording, estimator, settings);
    EXPECT_TRUE(result.ok());
    return result->frames;
  }
  // m, of the poses as published; the largest. Negative where there was none.
  static double LargestError(const std::vector<FrameReport>& frames) {
    const Trajectory truth = *ReadTrajectory(Drive("second") / "groundtruth_base.txt");
    double largest = -1.0;
    for (const FrameReport& frame : frames) {
      if (!frame.T_map_base.has_value()) continue;
      const auto at = std::min_element(truth.begin(), truth.end(), [&frame](const auto& a, const auto& b) {
        return std::abs(SecondsBetween(a.stamp, frame.stamp)) < std::abs(SecondsBetween(b.stamp, frame.stamp));
      });
      const Rigid2 T_truth_base = T_truth_map_ * ProjectToPlane(*frame.T_map_base);
      largest = std::max(largest, (T_truth_base.translation - at->T_map_base.translation.head<2>()).norm());
    }
    return largest;
  }

  static std::unique_ptr<test::TemporaryFolder> folder_;
  static std::unique_ptr<SavedMap> saved_;
  static Rigid2 T_truth_map_;
};
std::unique_ptr<test::TemporaryFolder> SavedPlace::folder_;
std::unique_ptr<SavedMap> SavedPlace::saved_;
Rigid2 SavedPlace::T_truth_map_;

TEST_F(SavedPlace, IsFoundByLaserOnAnotherDay) {
  const std::vector<FrameReport> frames = Localize(*saved_, LaserLocalize::kAuto);
  ASSERT_FALSE(frames.empty());
  EXPECT_GE(SecondsBetween(Timestamp{0}, frames.front().stamp), kBegin - 0.01) << "what is before is left out";
  std::size_t with_pose = 0, confirmed = 0;
  for (const FrameReport& frame : frames) {
    with_pose += frame.T_map_base.has_value() ? 1 : 0;
    confirmed += frame.state == TrackingState::kTracking || frame.state == TrackingState::kRelocalized ? 1 : 0;
  }
  EXPECT_GE(static_cast<double>(with_pose), 0.6 * static_cast<double>(frames.size()));
  EXPECT_GE(static_cast<double>(confirmed), 0.95 * static_cast<double>(with_pose));
  EXPECT_LT(LargestError(frames), 0.08);
}

TEST_F(SavedPlace, IsTheSameToTheLastBitAgain) {
  const std::vector<FrameReport> once = Localize(*saved_, LaserLocalize::kAuto);
  const std::vector<FrameReport> again = Localize(*saved_, LaserLocalize::kAuto);
  ASSERT_EQ(once.size(), again.size());
  for (std::size_t i = 0; i < once.size(); ++i) {
    ASSERT_EQ(once[i].T_map_base.has_value(), again[i].T_map_base.has_value());
    if (!once[i].T_map_base.has_value()) continue;
    EXPECT_EQ(once[i].T_map_base->translation, again[i].T_map_base->translation);
  }
}

TEST_F(SavedPlace, WithoutSweepsOrWithTheLaserOffIsUpToTheCamera) {
  SavedMap without = *saved_;
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : without.map.keyframes) ids.push_back(id);
  for (const KeyframeId id : ids) without.map.keyframes.Edit(id).sweeps.clear();
  const std::vector<FrameReport> bare = Localize(without, LaserLocalize::kAuto);
  const std::vector<FrameReport> off = Localize(*saved_, LaserLocalize::kOff);
  ASSERT_EQ(bare.size(), off.size());
  for (std::size_t i = 0; i < bare.size(); ++i) {
    ASSERT_EQ(bare[i].state, off[i].state);
    if (!off[i].T_map_base.has_value()) continue;
    EXPECT_EQ(bare[i].T_map_base->translation, off[i].T_map_base->translation);
  }
  EXPECT_LT(LargestError(off), 0.5) << "no pose, or a right one";
}

TEST_F(SavedPlace, IsSearchedForBesideTheTrackingAndNeverWrong) {
  const std::vector<FrameReport> frames = Localize(*saved_, LaserLocalize::kOff, Schedule::kThreaded);
  EXPECT_EQ(frames.size(), Localize(*saved_, LaserLocalize::kOff).size());
  EXPECT_LT(LargestError(frames), 0.5);
}

TEST_F(SavedPlace, MapToOdomMovesInSmallStepsOrIsDeclared) {
  for (const LaserLocalize laser : {LaserLocalize::kAuto, LaserLocalize::kOff}) {
    const std::vector<FrameReport> frames = Localize(*saved_, laser);
    for (std::size_t i = 1; i < frames.size(); ++i) {
      if (!frames[i].T_map_odom.has_value() || !frames[i - 1].T_map_odom.has_value()) continue;
      if (frames[i].state == TrackingState::kRelocalized) continue;
      const Rigid2 at_robot = ProjectToPlane(*frames[i].T_map_base);
      const Rigid2 led = *frames[i - 1].T_map_odom * frames[i].T_map_odom->Inverse() * at_robot;
      const Rigid2 step = led.Inverse() * at_robot;
      const double periods = SecondsBetween(frames[i - 1].stamp, frames[i].stamp) / 0.05;
      EXPECT_LE(step.translation.norm(), 0.02 * periods) << i;
      EXPECT_LE(std::abs(step.angle), DegreesToRadians(1.0) * periods) << i;
    }
  }
}

}  // namespace
}  // namespace planar_vslam
