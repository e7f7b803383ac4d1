// The front door, on a drive along a wall: what comes out for what goes in, commands at any time, and refusals that
// change nothing.
#include "planar_vslam/pipeline/estimator.h"

#include <gtest/gtest.h>

#include "support/wall_drive.h"

namespace planar_vslam {
namespace {

using test::WallDrive;

constexpr int kImages = 100;

class EstimatorTest : public ::testing::Test {
 protected:
  static EstimatorSettings Settings(RunMode mode = RunMode::kMapping) {
    EstimatorSettings settings;
    settings.camera = WallDrive::Camera();
    settings.options.mode = mode;
    return settings;
  }

  // The next image, taken at place `position` of the drive, and the odometry that covers it.
  FrameReport Step(Estimator* estimator, int position) {
    std::vector<FrameReport> reports = estimator->Add(drive_.FrameAt(image_, position));
    EXPECT_TRUE(reports.empty()) << "odometry has not come so far";
    EXPECT_EQ(estimator->images_waiting(), 1U);
    reports = estimator->Add(WallDrive::OdometryAt(image_, position));
    ++image_;
    EXPECT_EQ(reports.size(), 1U);
    return reports.empty() ? FrameReport{} : reports.front();
  }
  FrameReport Drive(Estimator* estimator, int from, int to) {
    FrameReport last;
    for (int position = from; position != to; position += from < to ? 1 : -1) last = Step(estimator, position);
    return last;
  }
  // Odometry before the first image, as a robot has it.
  void Begin(Estimator* estimator, int position) {
    EXPECT_TRUE(estimator->Add(WallDrive::OdometryAt(image_, position)).empty());
    ++image_;
  }
  // A map of the whole wall.
  const SavedMap& Saved() {
    static const SavedMap saved = [this] {
      const int image = std::exchange(image_, 0);
      Estimator estimator(Settings());
      Begin(&estimator, 0);
      Drive(&estimator, 0, kImages);
      EXPECT_TRUE(estimator.Finish().ok());
      image_ = image;
      return SavedMap{*estimator.map(), WallDrive::Camera()};
    }();
    return saved;
  }

  static double DistanceX(const FrameReport& a, const FrameReport& b) {
    return (b.T_map_base->translation - a.T_map_base->translation).x();
  }

  WallDrive drive_{kImages};
  int image_ = 0;
};

TEST_F(EstimatorTest, MakesAMapAndTellsWhereTheRobotIs) {
  Estimator estimator(Settings());
  EXPECT_FALSE(estimator.Snapshot().has_value());
  Begin(&estimator, 0);
  const FrameReport before = Drive(&estimator, 0, 30), after = Drive(&estimator, 30, 60);
  ASSERT_TRUE(before.T_map_base.has_value() && after.T_map_base.has_value());
  EXPECT_EQ(after.state, TrackingState::kTracking);
  EXPECT_TRUE(after.metric);
  EXPECT_NEAR(DistanceX(before, after), 30 * WallDrive::kStep, 0.01);
  EXPECT_TRUE(estimator.Finish().ok());
  ASSERT_TRUE(estimator.Snapshot().has_value());
  EXPECT_TRUE(Validate(*estimator.Snapshot()->map).empty());
  EXPECT_EQ(estimator.trajectory().Poses(*estimator.map()).size(), 60U);
  for (const char* stage : {"frame.extract", "frame.track", "frame.total"}) {
    EXPECT_EQ(estimator.report().stages.stages().count(stage), 1U) << stage;
  }
}

TEST_F(EstimatorTest, OdometryFrameLiesInTheMapAsItsSourceHasIt) {
  EstimatorSettings settings = Settings();
  settings.options.calibration.odometry.scale.x() = 1.0 / 0.98;  // the wheels read short, and that is known
  Estimator estimator(settings);
  const auto read = [](int position) { return Rigid2({0.98 * WallDrive::kStep * position, 0.0}, 0.0); };
  estimator.Add(OdometryReading{WallDrive::StampOf(0), read(0)});
  FrameReport last;
  for (int i = 1; i < 60; ++i) {
    estimator.Add(drive_.FrameAt(i, i));
    for (const FrameReport& report : estimator.Add(OdometryReading{WallDrive::StampOf(i), read(i)})) last = report;
  }
  ASSERT_TRUE(last.T_map_base.has_value() && last.T_map_odom.has_value());
  const Rigid2 T_map_base = *last.T_map_odom * read(59);
  EXPECT_LT(LogSe2(T_map_base.Inverse() * ProjectToPlane(*last.T_map_base)).norm(), 1e-9);
}

TEST_F(EstimatorTest, WithoutOdometryImagesPassAtOnce) {
  EstimatorSettings settings = Settings();
  settings.with_odometry = false;
  Estimator estimator(settings);
  EXPECT_EQ(estimator.settings().options.initializer.mode, InitializationMode::kVisual);
  EXPECT_EQ(estimator.Add(drive_.FrameAt(0, 0)).size(), 1U);
}

TEST_F(EstimatorTest, ImagesThatStillWaitAreUsedInTheEnd) {
  Estimator estimator(Settings());
  Begin(&estimator, 0);
  Drive(&estimator, 0, 20);
  EXPECT_TRUE(estimator.Add(drive_.FrameAt(image_, 20)).empty());
  EXPECT_EQ(estimator.Flush().size(), 1U);
}

TEST_F(EstimatorTest, CommandsBeforeThereIsAMapAreRefusedAndChangeNothing) {
  Estimator estimator(Settings());
  EXPECT_FALSE(estimator.SetMode(RunMode::kLocalization).ok());
  EXPECT_FALSE(estimator.StartAt(Rigid3(), Matrix6d::Identity()).ok());
  EXPECT_FALSE(estimator.AdjustMap().ok());
  EXPECT_EQ(estimator.mode(), RunMode::kMapping);
  EXPECT_TRUE(estimator.Finish().ok()) << "nothing to do";
  Begin(&estimator, 0);
  EXPECT_EQ(Drive(&estimator, 0, 40).state, TrackingState::kTracking);
}

TEST_F(EstimatorTest, AMapThatDoesNotFitIsRefusedAndTheDriveGoesOn) {
  Estimator estimator(Settings());
  Begin(&estimator, 0);
  Drive(&estimator, 0, 40);
  const std::shared_ptr<const Map> map = estimator.map();
  SavedMap other = Saved();
  other.camera.fx += 20.0;
  const Expected<bool> other_camera = estimator.LoadMap(other);
  ASSERT_FALSE(other_camera.ok());
  EXPECT_NE(other_camera.error().message.find("camera"), std::string::npos);
  other = Saved();
  other.map.octave_scales.pop_back();
  EXPECT_FALSE(estimator.LoadMap(other).ok());
  const Expected<bool> empty = estimator.LoadMap(SavedMap{{}, WallDrive::Camera()});
  ASSERT_FALSE(empty.ok());
  EXPECT_EQ(empty.error().message.find('\n'), std::string::npos) << "one line";
  EXPECT_EQ(estimator.map(), map);
  EXPECT_EQ(Drive(&estimator, 40, 50).state, TrackingState::kTracking);
}

TEST_F(EstimatorTest, LocalizesInALoadedMapAndLeavesItAsItIs) {
  Estimator estimator(Settings(RunMode::kLocalization));
  ASSERT_TRUE(estimator.LoadMap(Saved()).ok());
  const std::shared_ptr<const Map> map = estimator.map();
  Begin(&estimator, 40);
  const FrameReport report = Drive(&estimator, 40, 70);
  EXPECT_EQ(report.state, TrackingState::kTracking);
  EXPECT_EQ(estimator.map(), map);
  EXPECT_EQ(estimator.report().keyframes_made, 0);
  EXPECT_FALSE(estimator.AdjustMap().ok()) << "it stays as it is";
}

TEST_F(EstimatorTest, AnotherCameraMayLocalizeButNotMap) {
  SavedMap saved = Saved();
  saved.camera.fx += 20.0;
  Estimator estimator(Settings(RunMode::kLocalization));
  ASSERT_TRUE(estimator.LoadMap(saved).ok());
  EXPECT_FALSE(estimator.SetMode(RunMode::kMapping).ok());
  EXPECT_EQ(estimator.mode(), RunMode::kLocalization);
  EXPECT_EQ(estimator.Snapshot()->camera.fx, saved.camera.fx) << "the map keeps the camera that made it";
}

TEST_F(EstimatorTest, WithoutAMapToLocalizeInFramesWait) {
  Estimator estimator(Settings(RunMode::kLocalization));
  Begin(&estimator, 0);
  const FrameReport report = Drive(&estimator, 0, 40);
  EXPECT_EQ(report.state, TrackingState::kInitializing);
  EXPECT_EQ(report.waiting_for, "a map to localize in");
  EXPECT_EQ(estimator.map(), nullptr);
}

TEST_F(EstimatorTest, ARestartLocalizesInTheSameMap) {
  Estimator estimator(Settings());
  Begin(&estimator, 0);
  Drive(&estimator, 0, 60);
  ASSERT_TRUE(estimator.SetMode(RunMode::kLocalization).ok());
  const std::shared_ptr<const Map> map = estimator.map();
  estimator.Restart();
  EXPECT_EQ(estimator.mode(), RunMode::kLocalization);
  EXPECT_EQ(estimator.map(), map);
  Begin(&estimator, 20);
  EXPECT_EQ(Drive(&estimator, 20, 40).state, TrackingState::kTracking);
  EXPECT_EQ(estimator.map(), map);
}

TEST_F(EstimatorTest, ThreadedCommandsMayComeWhileJobsRun) {
  EstimatorSettings settings = Settings();
  settings.schedule = Schedule::kThreaded;
  const SavedMap saved = Saved();
  for (int round = 0; round < 3; ++round) {
    Estimator estimator(settings);
    Begin(&estimator, 0);
    Drive(&estimator, 0, 40);
    EXPECT_TRUE(estimator.AdjustMap().ok());
    Step(&estimator, 40);
    if (round > 0) {
      EXPECT_TRUE(estimator.SetMode(RunMode::kLocalization).ok());
      EXPECT_TRUE(estimator.SetMode(RunMode::kMapping).ok());
    }
    const Rigid3 T_map_base = estimator.map()->keyframes.begin()->second.T_map_base;
    EXPECT_TRUE(estimator.StartAt(T_map_base, 0.01 * Matrix6d::Identity()).ok());
    Step(&estimator, 41);
    EXPECT_TRUE(estimator.LoadMap(saved).ok());
    Drive(&estimator, 42, 60);
    EXPECT_TRUE(Validate(*estimator.map()).empty());
    if (round > 1) estimator.Restart();
  }
}

TEST_F(EstimatorTest, TheModeChangesWhileDriving) {
  Estimator estimator(Settings());
  Begin(&estimator, 0);
  Drive(&estimator, 0, 50);
  ASSERT_TRUE(estimator.SetMode(RunMode::kLocalization).ok());
  const std::shared_ptr<const Map> map = estimator.map();
  EXPECT_EQ(Drive(&estimator, 50, 30).state, TrackingState::kTracking) << "tracking goes on";
  EXPECT_EQ(estimator.map(), map);
  ASSERT_TRUE(estimator.SetMode(RunMode::kMapping).ok());
  Drive(&estimator, 30, kImages);
  EXPECT_GT(estimator.map()->next_keyframe_id, map->next_keyframe_id);
  EXPECT_TRUE(Validate(*estimator.map()).empty());
}

TEST_F(EstimatorTest, AGivenPoseIsWhereTheRobotIs) {
  Estimator estimator(Settings(RunMode::kLocalization));
  ASSERT_TRUE(estimator.LoadMap(Saved()).ok());
  Begin(&estimator, 40);
  const Timestamp first = Saved().map.keyframes.begin()->second.stamp;
  const double start = SecondsBetween(WallDrive::StampOf(0), first) / (1e-9 * WallDrive::kPeriod) - 1.0;
  const Rigid3 T_map_base = Embed3(Rigid2({WallDrive::kStep * (40.0 - start) + 0.05, -0.05}, DegreesToRadians(3.0)));
  ASSERT_TRUE(estimator.StartAt(T_map_base, 0.01 * Matrix6d::Identity()).ok());
  const FrameReport at_once = Step(&estimator, 40);
  EXPECT_TRUE(at_once.T_map_base.has_value()) << "there is a pose from the first frame on";
  const FrameReport soon = Drive(&estimator, 41, 50);
  EXPECT_EQ(soon.state, TrackingState::kTracking);
  EXPECT_NEAR(soon.T_map_base->translation.x(), WallDrive::kStep * (49.0 - start), 0.01);
}

TEST_F(EstimatorTest, APoseOutsideTheMapIsRefused) {
  Estimator estimator(Settings(RunMode::kLocalization));
  ASSERT_TRUE(estimator.LoadMap(Saved()).ok());
  EXPECT_FALSE(estimator.StartAt(Embed3(Rigid2({50.0, 0.0}, 0.0)), Matrix6d::Identity()).ok());
  EXPECT_FALSE(estimator.StartAt(Rigid3(), Matrix6d::Zero()).ok()) << "nobody is that sure";
  EXPECT_FALSE(estimator.StartAt(Embed3(Rigid2({std::nan(""), 0.0}, 0.0)), Matrix6d::Identity()).ok());
  Begin(&estimator, 40);
  EXPECT_EQ(Step(&estimator, 40).state, TrackingState::kInitializing) << "as if nobody had said anything";
}

TEST_F(EstimatorTest, RestartsWhereItStarted) {
  Estimator fresh(Settings());
  Begin(&fresh, 0);
  Drive(&fresh, 0, 40);
  ASSERT_NE(fresh.map(), nullptr);
  fresh.Restart();
  EXPECT_EQ(fresh.map(), nullptr);
  EXPECT_TRUE(fresh.report().frames.empty());
  EXPECT_EQ(fresh.trajectory().size(), 0U);

  Estimator loaded(Settings());
  ASSERT_TRUE(loaded.LoadMap(Saved()).ok());
  const std::shared_ptr<const Map> map = loaded.map();
  Begin(&loaded, 40);
  Drive(&loaded, 40, kImages);
  loaded.Restart();
  EXPECT_EQ(loaded.map(), map);
  Begin(&loaded, 20);
  EXPECT_EQ(Drive(&loaded, 20, 40).state, TrackingState::kTracking);
}

TEST_F(EstimatorTest, ThreadedJobsChangeTheMapWhileTheDriveGoesOn) {
  EstimatorSettings settings = Settings();
  settings.schedule = Schedule::kThreaded;
  settings.trajectory_frames = 20;
  settings.options.final_bundle_adjustment = false;
  Estimator estimator(settings);
  Begin(&estimator, 0);
  FrameReport report;
  for (int position = 0; position < kImages; ++position) {
    report = Step(&estimator, position);
    if (position == 50) {
      EXPECT_TRUE(estimator.AdjustMap().ok());
    }
  }
  EXPECT_TRUE(report.T_map_base.has_value());
  EXPECT_LE(estimator.trajectory().Poses(*estimator.map()).size(), 40U);
  EXPECT_TRUE(estimator.Finish().ok());
  EXPECT_TRUE(Validate(*estimator.map()).empty());
  EXPECT_EQ(estimator.report().stages.stages().count("map.correct"), 1U) << "the adjustment came into the map";
}

}  // namespace
}  // namespace planar_vslam
