// Two drives through one simulated room: their maps merged, and the second one begun in the first one's map where
// nothing of it is in view.
#include <gtest/gtest.h>

#include "planar_vslam/backend/merge_maps.h"
#include "planar_vslam/io/evaluation.h"
#include "planar_vslam/io/run_session.h"
#include "planar_vslam/pipeline/mapper_context.h"
#include "planar_vslam/sim/dataset_writer.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/world.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

class TwoSessions : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TemporaryFolder>();
    const Expected<World> world = LoadWorld(test::SourceFolder() / "config/worlds/sample_lab.yaml");
    ASSERT_TRUE(world.ok()) << world.error().message;
    Expected<Simulation> simulation = Simulation::Create(*world, SimulationOptions{});
    ASSERT_TRUE(simulation.ok()) << simulation.error().message;
    ASSERT_TRUE(WriteDataset(*simulation, Drive()).ok());
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static fs::path Drive() { return folder_->path() / "drive"; }

  struct Session {
    std::unique_ptr<Estimator> estimator;
    RunResult result;
    SavedMap saved() const { return {*estimator->map(), estimator->map_camera()}; }
  };
  // s after the first image; 0: from the beginning, to the end.
  static Session Run(double from, double until, const PipelineOptions& options = {}, const SavedMap* start = nullptr) {
    Expected<std::unique_ptr<Recording>> recording = OpenRecording(Drive(), RecordingOptions{});
    EXPECT_TRUE(recording.ok()) << recording.error().message;
    Session session;
    session.estimator = std::make_unique<Estimator>(
        EstimatorSettings{options, (*recording)->info().camera, true, true, Schedule::kInline});
    if (start != nullptr) {
      EXPECT_TRUE(session.estimator->LoadMap(*start).ok());
    }
    RunSettings settings;
    if (from > 0.0) settings.from = from;
    if (until > 0.0) settings.until = until;
    Expected<RunResult> result = RunSession(**recording, *session.estimator, settings);
    EXPECT_TRUE(result.ok());
    session.result = std::move(result).value();
    return session;
  }

  static Trajectory Truth() { return *ReadTrajectory(Drive() / "groundtruth_base.txt"); }
  static double Error(const Trajectory& estimate) {
    const Expected<TrajectoryErrors> errors = EvaluateTrajectory(estimate, Truth(), EvaluationAlignment::kSe2);
    EXPECT_TRUE(errors.ok());
    return errors->ate.rmse;
  }
  // Of all keyframes, each stamp once.
  static double KeyframeError(const Map& map) {
    std::map<Timestamp, Rigid3> poses;
    for (const auto& [id, keyframe] : map.keyframes) poses[keyframe.stamp] = keyframe.T_map_base;
    Trajectory estimate;
    for (const auto& [stamp, T] : poses) estimate.push_back({stamp, T});
    return Error(estimate);
  }

  static std::unique_ptr<test::TemporaryFolder> folder_;
};
std::unique_ptr<test::TemporaryFolder> TwoSessions::folder_;

TEST_F(TwoSessions, MapsOfTwoPartsOfADriveBecomeOne) {
  const Session first = Run(0.0, 16.0), second = Run(10.0, 26.0);
  const Map other = *second.estimator->map();
  const MapperContext context = MapperContextOf(PipelineOptions{}, first.estimator->model());
  const Expected<MergedMap> merged =
      MergeMaps(first.estimator->map(), other, context, [](const std::string&, long, long) {});
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_EQ(Validate(merged->map), std::vector<std::string>{});
  EXPECT_GT(merged->landmarks_shared, 500);
  EXPECT_LE(KeyframeError(merged->map), 0.03);
  const double difference = LogSe3(merged->overlap.alignment.T_known_other).head<2>().norm();
  EXPECT_GT(difference, 0.5) << "two frames";
}

TEST_F(TwoSessions, AStartThatIsNotRecognisedMapsOnAndIsJoined) {
  const SavedMap known = Run(0.0, 10.0).saved();
  PipelineOptions options;
  options.laser_localize = LaserLocalize::kOff;  // else the laser finds the place soon
  const Session session = Run(13.0, 0.0, options, &known);
  const EstimatorReport& report = session.estimator->report();
  EXPECT_TRUE(report.own_map);
  ASSERT_TRUE(report.joined.has_value());
  EXPECT_GE(report.joined->places, 3);
  const Map& map = *session.estimator->map();
  EXPECT_EQ(Validate(map), std::vector<std::string>{});
  EXPECT_LT(map.keyframes.begin()->first.value, known.map.next_keyframe_id) << "the known map is part of it";
  EXPECT_GE(std::prev(map.keyframes.end())->first.value, known.map.next_keyframe_id);
  EXPECT_LE(KeyframeError(map), 0.03) << "of both together";

  const Trajectory truth = Truth();
  const auto driven = [&](Timestamp until) {
    double way = 0.0;
    for (std::size_t k = 1; k < truth.size() && !(until < truth[k].stamp); ++k) {
      if (truth[k].stamp < session.result.frames.front().stamp) continue;
      way += (truth[k].T_map_base.translation - truth[k - 1].T_map_base.translation).norm();
    }
    return way;
  };
  int joined = 0;
  for (const FrameReport& frame : session.result.frames) {
    EXPECT_TRUE(frame.T_map_base.has_value() || driven(frame.stamp) < 1.0) << frame.stamp.Seconds();
    if (!frame.joined) continue;
    ++joined;
    EXPECT_EQ(frame.state, TrackingState::kRelocalized) << "the jump is declared";
  }
  EXPECT_EQ(joined, 1);
  Trajectory estimate;
  for (const auto& [stamp, T] : session.estimator->trajectory().Poses(map)) estimate.push_back({stamp, T});
  EXPECT_LE(Error(estimate), 0.03);
}

}  // namespace
}  // namespace planar_vslam
