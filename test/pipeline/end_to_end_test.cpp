// The whole pipeline on a simulated drive with ground truth: accuracy bounds, determinism, output files, and recordings
// from the machine where there are any.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "planar_vslam/io/evaluation.h"
#include "planar_vslam/io/run_session.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/sim/dataset_writer.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/world.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

constexpr double kDriveSeconds = 14.0;

// A short simulated drive as a dataset folder, rendered once for all tests.
class EndToEnd : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TemporaryFolder>();
    const Expected<World> world = LoadWorld(test::SourceFolder() / "config/worlds/sample_lab.yaml");
    ASSERT_TRUE(world.ok()) << world.error().message;
    SimulationOptions options;
    options.until = kDriveSeconds;
    Expected<Simulation> simulation = Simulation::Create(*world, options);
    ASSERT_TRUE(simulation.ok()) << simulation.error().message;
    const Expected<DatasetCounts> counts = WriteDataset(*simulation, Drive());
    ASSERT_TRUE(counts.ok()) << counts.error().message;
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static fs::path Drive() { return folder_->path() / "drive"; }

  struct Outcome {
    RunResult result;
    EstimatorReport report;
    std::shared_ptr<const Map> map;
  };
  static Outcome Run(const PipelineOptions& options, const fs::path& out, Schedule schedule = Schedule::kInline,
                     const SavedMap* saved = nullptr, const fs::path& drive = Drive()) {
    Expected<std::unique_ptr<Recording>> recording = OpenRecording(drive, RecordingOptions{});
    EXPECT_TRUE(recording.ok()) << recording.error().message;
    const RecordingInfo& info = (*recording)->info();
    Estimator estimator({options, info.camera, info.has_base_transform, info.has_odometry, schedule});
    if (saved != nullptr) {
      EXPECT_TRUE(estimator.LoadMap(*saved).ok());
    }
    Expected<RunResult> result = RunSession(**recording, estimator, RunSettings{});
    EXPECT_TRUE(result.ok());
    EXPECT_EQ(result->final_adjustment, "");
    EXPECT_TRUE(WriteRunOutputs(out, estimator, *result, true).ok());
    return {std::move(*result), estimator.report(), estimator.map()};
  }

  static TrajectoryErrors Errors(const fs::path& trajectory) {
    const Expected<Trajectory> estimate = ReadTrajectory(trajectory);
    const Expected<Trajectory> truth = ReadTrajectory(Drive() / "groundtruth_base.txt");
    const Expected<TrajectoryErrors> errors = EvaluateTrajectory(*estimate, *truth, EvaluationAlignment::kSe2);
    EXPECT_TRUE(errors.ok());
    return *errors;
  }

  static std::unique_ptr<test::TemporaryFolder> folder_;
};
std::unique_ptr<test::TemporaryFolder> EndToEnd::folder_;

long Count(const EstimatorReport& report, TrackingState state) {
  const auto it = report.frames.find(state);
  return it == report.frames.end() ? 0 : it->second;
}

std::string Contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

void ExpectSameFiles(const fs::path& a, const fs::path& b) {
  int compared = 0;
  for (const auto& entry : fs::directory_iterator(a)) {
    EXPECT_EQ(Contents(entry.path()), Contents(b / entry.path().filename())) << entry.path().filename();
    ++compared;
  }
  EXPECT_GE(compared, 8);
}

TEST_F(EndToEnd, MetricTrajectoryAndMapFromOdometrySeededStart) {
  const fs::path out = folder_->path() / "odometry_seeded";
  const Outcome run = Run(PipelineOptions{}, out);
  ASSERT_NE(run.map, nullptr);
  EXPECT_TRUE(run.map->metric);
  const std::vector<std::string> problems = Validate(*run.map);
  EXPECT_TRUE(problems.empty()) << problems.front();
  const long tracked = Count(run.report, TrackingState::kTracking) + Count(run.report, TrackingState::kRelocalized);
  const long after_start =
      static_cast<long>(run.result.frames.size()) - Count(run.report, TrackingState::kInitializing);
  EXPECT_GE(tracked, after_start * 95 / 100);
  const TrajectoryErrors errors = Errors(out / "trajectory.txt");
  EXPECT_LE(errors.ate.rmse, 0.05);
  EXPECT_LE(std::abs(errors.scale_error), 0.02);
  ASSERT_TRUE(run.report.map_scale.fused.has_value());
  EXPECT_LE(run.report.map_scale.fused->sigma, 0.01);
  EXPECT_TRUE(run.report.scale_known_after.has_value());
  EXPECT_GE(errors.coverage, 0.98);
  for (const char* name : {"trajectory.txt", "trajectory_live.txt", "covariance_live.csv", "status.csv",
                           "keyframes.txt", "map.pvm", "map.pgm", "map.yaml", "map.bt", "points.pcd", "report.json"}) {
    EXPECT_TRUE(fs::is_regular_file(out / name)) << name;
  }
}

TEST_F(EndToEnd, ScaleIsRecoveredFromAVisualStart) {
  PipelineOptions options;
  options.initializer.mode = InitializationMode::kVisual;
  for (const int keyframes : {0, 10}) {  // by its standard deviation, and the paper's count
    options.scale.keyframes = keyframes;
    const fs::path out = folder_->path() / ("visual_" + std::to_string(keyframes));
    const Outcome run = Run(options, out);
    ASSERT_NE(run.map, nullptr);
    ASSERT_TRUE(run.report.scale.has_value()) << run.result.frames.back().waiting_for;
    EXPECT_TRUE(run.map->metric);
    EXPECT_LE(std::abs(Errors(out / "trajectory.txt").scale_error), 0.02);
    EXPECT_TRUE(fs::is_regular_file(out / "scale_cameras.txt"));
  }
}

TEST_F(EndToEnd, TwoRunsInOneProcessGiveTheSameBytes) {
  const fs::path first = folder_->path() / "first", second = folder_->path() / "second";
  Run(PipelineOptions{}, first);
  Run(PipelineOptions{}, second);
  ExpectSameFiles(first, second);
}

TEST_F(EndToEnd, TwoProcessesGiveTheSameBytes) {
  const fs::path first = folder_->path() / "process_1", second = folder_->path() / "process_2";
  for (const fs::path& out : {first, second}) {
    const std::string command =
        test::Executable() + " run " + Drive().string() + " --out " + out.string() + " --deterministic --quiet";
    ASSERT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c): our own executable
  }
  ExpectSameFiles(first, second);
}

TEST_F(EndToEnd, ThreadedScheduleStaysAccurate) {
  const fs::path out = folder_->path() / "threaded";
  const Outcome run = Run(PipelineOptions{}, out, Schedule::kThreaded);
  ASSERT_NE(run.map, nullptr);
  EXPECT_LE(Errors(out / "trajectory.txt").ate.rmse, 0.06);
}

TEST_F(EndToEnd, ImagesThatComeTooLateAreDroppedAndTheirOdometryIsNot) {
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(Drive(), RecordingOptions{});
  ASSERT_TRUE(recording.ok());
  Estimator estimator({PipelineOptions{}, (*recording)->info().camera, true, true, Schedule::kThreaded});
  Expected<RunResult> result = Error{"not run"};
  // Somewhat faster than this machine, however busy it is: where hardly an image is left there is no map.
  for (const double rate : {5.0, 10.0, 20.0, 40.0, 80.0}) {
    estimator.Restart();
    recording = OpenRecording(Drive(), RecordingOptions{});
    RunSettings settings;
    settings.rate = rate;
    result = RunSession(**recording, estimator, settings);
    ASSERT_TRUE(result.ok());
    if (result->frames_dropped > 0) break;
  }
  EXPECT_GT(result->frames_dropped, 0);
  EXPECT_EQ(static_cast<long>(result->frames.size()) + result->frames_dropped, (*recording)->info().image_count);
  ASSERT_NE(estimator.map(), nullptr);
  ASSERT_TRUE(result->frames.back().T_map_base.has_value());
  const auto poses = estimator.trajectory().Poses(*estimator.map());
  Trajectory estimate;
  for (const auto& [stamp, T] : poses) estimate.push_back({stamp, T});
  const Expected<TrajectoryErrors> errors =
      EvaluateTrajectory(estimate, *ReadTrajectory(Drive() / "groundtruth_base.txt"), EvaluationAlignment::kSe2);
  ASSERT_TRUE(errors.ok());
  EXPECT_LE(errors->ate.rmse, 0.1) << "odometry bridges what was dropped";
}

TEST_F(EndToEnd, AMapOfAnotherDayKeepsItsFloor) {
  const fs::path mapped = folder_->path() / "level", out = folder_->path() / "another_day";
  Run(PipelineOptions{}, mapped);
  Expected<SavedMap> saved = LoadMapFile(mapped / "map.pvm");
  ASSERT_TRUE(saved.ok());
  PipelineOptions options;
  options.planar.sigma_height = 1e-4;  // so that the floor is soon left, by this drive's word
  options.planar.sigma_tilt = 1e-4;
  options.loop.enabled = false;  // adjusting the whole map asks every keyframe whether it is on the floor
  options.final_bundle_adjustment = false;
  const Outcome run = Run(options, out, Schedule::kInline, &*saved);
  for (const auto& [id, keyframe] : saved->map.keyframes) {
    const Keyframe* now = run.map->keyframes.Find(id);
    if (now != nullptr) {
      EXPECT_EQ(now->on_floor, keyframe.on_floor) << "keyframe " << id.value;
    }
  }
}

TEST_F(EndToEnd, ASavedMapIsLocalizedInAndStaysAsItIs) {
  const fs::path mapped = folder_->path() / "to_save", out = folder_->path() / "localized";
  const Outcome mapping = Run(PipelineOptions{}, mapped);
  const Expected<SavedMap> saved = LoadMapFile(mapped / "map.pvm");
  ASSERT_TRUE(saved.ok()) << saved.error().message;
  PipelineOptions options;
  options.mode = RunMode::kLocalization;
  const Outcome run = Run(options, out, Schedule::kInline, &*saved);
  EXPECT_GE(Count(run.report, TrackingState::kTracking), static_cast<long>(run.result.frames.size()) * 95 / 100);
  const TrajectoryErrors errors = Errors(out / "trajectory.txt");
  EXPECT_LE(errors.ate.rmse, 0.05);
  EXPECT_GE(errors.coverage, 0.98) << "odometry places the frames before the first recognised one";
  for (const char* name : {"map.pvm", "map.pgm", "map.yaml", "map.bt", "points.pcd"}) {
    EXPECT_EQ(Contents(mapped / name), Contents(out / name)) << name;
  }
}

TEST_F(EndToEnd, ASavedMapGrows) {
  const fs::path mapped = folder_->path() / "to_grow", out = folder_->path() / "grown";
  const Outcome first = Run(PipelineOptions{}, mapped);
  const Expected<SavedMap> saved = LoadMapFile(mapped / "map.pvm");
  ASSERT_TRUE(saved.ok()) << saved.error().message;
  const Outcome second = Run(PipelineOptions{}, out, Schedule::kInline, &*saved);
  ASSERT_NE(second.map, nullptr);
  EXPECT_TRUE(Validate(*second.map).empty());
  EXPECT_GT(second.map->next_keyframe_id, first.map->next_keyframe_id);
  EXPECT_LE(Errors(out / "trajectory.txt").ate.rmse, 0.05);
}

TEST_F(EndToEnd, WithoutOdometryNoMetricClaimIsMade) {
  const fs::path drive = folder_->path() / "without_odometry", out = folder_->path() / "monocular";
  fs::create_directory(drive);
  for (const char* name : {"calibration.yaml", "images.csv"}) fs::copy_file(Drive() / name, drive / name);
  fs::create_directory_symlink(Drive() / "images", drive / "images");
  const Outcome run = Run(PipelineOptions{}, out, Schedule::kInline, nullptr, drive);
  ASSERT_NE(run.map, nullptr);
  EXPECT_FALSE(run.map->metric);
  EXPECT_FALSE(fs::exists(out / "map.yaml"));
  EXPECT_NE(Contents(out / "report.json").find("\"metric\": false"), std::string::npos);
}

// The final map's errors on a recorded drive, up to `until` s.
TrajectoryErrors RecordedErrors(const fs::path& folder, double until) {
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(folder, RecordingOptions{});
  EXPECT_TRUE(recording.ok());
  const PipelineOptions options;
  Estimator estimator({options, (*recording)->info().camera});
  RunSettings settings;
  settings.until = until;
  EXPECT_TRUE(RunSession(**recording, estimator, settings).ok());
  Trajectory estimate;
  for (const auto& [stamp, T] : estimator.trajectory().Poses(*estimator.map())) estimate.push_back({stamp, T});
  const Expected<TrajectoryErrors> errors =
      EvaluateTrajectory(estimate, *ReadTrajectory(folder / "groundtruth_base.txt"), EvaluationAlignment::kSe2);
  EXPECT_TRUE(errors.ok());
  return *errors;
}

// The first part of a recorded laboratory drive, where the recording is on this machine.
TEST(RecordedDrive, LaboratoryStaysWithinFiveCentimetres) {
  const auto folder = test::SequenceFolder("dev_lab");
  if (!folder.has_value()) GTEST_SKIP() << "recorded sequences are not on this machine (PLANAR_VSLAM_DATA)";
  EXPECT_LE(RecordedErrors(*folder, 40.0).ate.rmse, 0.05);
}

// No floor, and a car that pitches: links of the wheels must hold the map all the same.
TEST(RecordedDrive, StreetIsNoWorseThanOdometryAlone) {
  const auto folder = test::SequenceFolder("kitti_raw");
  if (!folder.has_value()) GTEST_SKIP() << "recorded sequences are not on this machine (PLANAR_VSLAM_DATA)";
  constexpr double kOdometryAlone = 0.2944;  // m, 2D, as bench/accuracy/run_sequences prints it
  EXPECT_LE(RecordedErrors(*folder, 60.0).ate_2d.rmse, kOdometryAlone);
}

}  // namespace
}  // namespace planar_vslam
