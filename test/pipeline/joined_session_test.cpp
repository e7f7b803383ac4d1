// A drive along a wall that begins where a loaded map shows nothing: it maps on its own, until it comes to what is
// known and both become one. What commands do meanwhile, and the same on threads.
#include <gtest/gtest.h>

#include "planar_vslam/pipeline/estimator.h"
#include "support/wall_drive.h"

namespace planar_vslam {
namespace {

using test::WallDrive;

class JoinedSession : public ::testing::Test {
 protected:
  static constexpr int kStride = 8;
  static constexpr int kKnownEnd = 200;  // position to which the wall is known
  static constexpr int kBegin = 480;     // nothing of it is in view
  static constexpr int kTurn = 640;      // the drive is 1.6 m on and comes back
  static constexpr int kBefore = 440;    // still nothing

  static EstimatorSettings Settings(Schedule schedule) {
    EstimatorSettings settings;
    settings.camera = WallDrive::Camera();
    settings.schedule = schedule;
    settings.options.final_bundle_adjustment = false;
    return settings;
  }
  FrameReport Step(Estimator* estimator, int position) {
    estimator->Add(drive_.FrameAt(++image_, position));
    const std::vector<FrameReport> reports = estimator->Add(WallDrive::OdometryAt(image_, position));
    EXPECT_EQ(reports.size(), 1U);
    if (reports.empty()) return {};
    joins_ += reports.front().joined ? 1 : 0;
    return reports.front();
  }
  FrameReport Drive(Estimator* estimator, int from, int to) {
    FrameReport last;
    for (int p = from; p != to; p += from < to ? kStride : -kStride) last = Step(estimator, p);
    return last;
  }
  // Odometry before the first image.
  void Begin(Estimator* estimator, int position) {
    EXPECT_TRUE(estimator->Add(WallDrive::OdometryAt(++image_, position)).empty());
  }
  const SavedMap& Known() {
    static const SavedMap saved = [this] {
      Estimator estimator(Settings(Schedule::kInline));
      Begin(&estimator, 0);
      origin_ = -1;
      for (int p = 0; p < kKnownEnd; p += kStride) {
        Step(&estimator, p);
        const bool first = origin_ < 0 && estimator.map() != nullptr;
        if (first) origin_ = PositionOf(estimator.map()->keyframes.begin()->second.stamp, p);
      }
      EXPECT_TRUE(estimator.Finish().ok());
      return SavedMap{*estimator.map(), WallDrive::Camera()};
    }();
    return saved;
  }
  // Where the drive to `position`, which it has just reached, was at that time.
  int PositionOf(Timestamp stamp, int position) const {
    const auto ago = (WallDrive::StampOf(image_).nanoseconds - stamp.nanoseconds) / WallDrive::kPeriod;
    return position - kStride * static_cast<int>(ago);
  }
  // m along x in the known map.
  static double KnownX(int position) { return WallDrive::kStep * (position - origin_); }

  // A drive that maps on its own beside the known map, at kTurn.
  std::unique_ptr<Estimator> BesideKnown(Schedule schedule) {
    const SavedMap& known = Known();
    auto estimator = std::make_unique<Estimator>(Settings(schedule));
    EXPECT_TRUE(estimator->LoadMap(known).ok());
    Begin(estimator.get(), kBegin);
    const FrameReport report = Drive(estimator.get(), kBegin, kTurn);
    EXPECT_EQ(report.state, TrackingState::kTracking);
    EXPECT_TRUE(estimator->report().own_map);
    EXPECT_FALSE(HoldsKnown(*estimator));
    return estimator;
  }
  // To and fro between `position` and the beginning of the known part. Where the drive ends. Images come faster than
  // from a camera: jobs run beside a few, and then catch up.
  template <class Done>
  int DriveUntil(Estimator* estimator, int position, Done done) {
    const int farthest = position;
    constexpr int kBeside = 4;
    int step = -kStride;
    for (int k = 1; k <= 400; ++k) {
      if (done(Step(estimator, position))) return position;
      if (k % kBeside == 0) {
        EXPECT_TRUE(estimator->Finish().ok());
      }
      if (position + step < 0 || position + step > farthest) step = -step;
      position += step;
    }
    ADD_FAILURE() << "in vain";
    return position;
  }
  int DriveUntilJoined(Estimator* estimator) {
    return DriveUntil(estimator, kTurn, [&](const FrameReport&) { return estimator->report().joined.has_value(); });
  }
  // Standing: jobs may take as long as they like.
  void StandUntilRecognised(Estimator* estimator, int position) {
    for (int k = 0; k < 1000; ++k) {
      if (Step(estimator, position).state == TrackingState::kTracking) return;
    }
    ADD_FAILURE() << "in vain";
  }
  bool HoldsKnown(const Estimator& estimator) {
    return estimator.map()->keyframes.begin()->first.value < Known().map.next_keyframe_id;
  }
  static bool HoldsMoreThan(const Map& map, const Estimator& estimator) {
    return estimator.map()->next_keyframe_id > map.next_keyframe_id;
  }
  void ExpectInKnownFrame(Estimator* estimator, int position) {
    const FrameReport report = Step(estimator, position);
    ASSERT_TRUE(report.T_map_base.has_value());
    EXPECT_NEAR(report.T_map_base->translation.x(), KnownX(position), 0.02);
    EXPECT_NEAR(report.T_map_base->translation.y(), 0.0, 0.02);
  }

  void JoinAndDriveOn(Schedule schedule) {
    const std::unique_ptr<Estimator> estimator = BesideKnown(schedule);
    joins_ = 0;
    const int position = DriveUntilJoined(estimator.get());
    EXPECT_TRUE(HoldsKnown(*estimator) && HoldsMoreThan(Known().map, *estimator));
    ExpectInKnownFrame(estimator.get(), position);
    EXPECT_EQ(joins_, 1) << "the jump of the frame is declared";
    for (int k = 0; k < 10; ++k) Step(estimator.get(), position);
    EXPECT_TRUE(estimator->Finish().ok());
    EXPECT_EQ(Validate(*estimator->map()), std::vector<std::string>{});
    EXPECT_EQ(estimator->report().stages.stages().count("frame.known_map"), 1U);
    ExpectInKnownFrame(estimator.get(), position);
    EXPECT_EQ(joins_, 1);
  }
  // The drive starts over in what it has mapped on its own so far.
  void LoadBeforeTheJoin(Schedule schedule) {
    constexpr int kInOwn = 560;
    const std::unique_ptr<Estimator> estimator = BesideKnown(schedule);
    const SavedMap own{*estimator->map(), WallDrive::Camera()};
    Drive(estimator.get(), kTurn, kInOwn);
    EXPECT_TRUE(estimator->LoadMap(own).ok());
    EXPECT_FALSE(estimator->report().own_map);
    StandUntilRecognised(estimator.get(), kInOwn);
    Drive(estimator.get(), kInOwn, 0);
    EXPECT_TRUE(estimator->Finish().ok());
    EXPECT_TRUE(HoldsMoreThan(own.map, *estimator));
    EXPECT_FALSE(HoldsKnown(*estimator) || estimator->report().joined.has_value()) << "nothing else is known any more";
  }
  void RestartBeforeTheJoin(Schedule schedule) {
    const std::unique_ptr<Estimator> estimator = BesideKnown(schedule);
    Drive(estimator.get(), kTurn, kBefore);
    estimator->Restart();
    EXPECT_FALSE(estimator->report().own_map);
    EXPECT_EQ(estimator->map()->next_keyframe_id, Known().map.next_keyframe_id) << "in the map that was loaded";
    constexpr int kInKnown = 104;
    Begin(estimator.get(), kInKnown);
    StandUntilRecognised(estimator.get(), kInKnown);
    ExpectInKnownFrame(estimator.get(), kInKnown);
  }
  void LocalizeBeforeTheJoin(Schedule schedule) {
    const std::unique_ptr<Estimator> estimator = BesideKnown(schedule);
    ASSERT_TRUE(estimator->SetMode(RunMode::kLocalization).ok());
    const std::shared_ptr<const Map> own = estimator->map();
    const FrameReport report = Drive(estimator.get(), kTurn, kBegin);
    EXPECT_EQ(report.state, TrackingState::kTracking) << "in the drive's own map";
    EXPECT_EQ(estimator->map(), own);
    ASSERT_TRUE(estimator->SetMode(RunMode::kMapping).ok());
    Drive(estimator.get(), kBegin, 0);
    EXPECT_TRUE(estimator->Finish().ok());
    EXPECT_FALSE(HoldsKnown(*estimator)) << "two maps that stay two";
    EXPECT_TRUE(HoldsMoreThan(*own, *estimator));
    estimator->Restart();
    EXPECT_TRUE(HoldsKnown(*estimator)) << "it starts in the map that was loaded";
  }

  WallDrive drive_{kTurn + kStride};
  int image_ = 0;
  int joins_ = 0;  // frames that were the first in the known map
  static int origin_;
};
int JoinedSession::origin_ = 0;

TEST_F(JoinedSession, BothMapsBecomeOne) { JoinAndDriveOn(Schedule::kInline); }
TEST_F(JoinedSession, AMapIsLoadedBeforeTheJoin) { LoadBeforeTheJoin(Schedule::kInline); }
TEST_F(JoinedSession, ARestartComesBeforeTheJoin) { RestartBeforeTheJoin(Schedule::kInline); }
TEST_F(JoinedSession, TheModeChangesBeforeTheJoin) { LocalizeBeforeTheJoin(Schedule::kInline); }

TEST_F(JoinedSession, TheModeChangesRightAfterTheJoin) {
  const std::unique_ptr<Estimator> estimator = BesideKnown(Schedule::kInline);
  const int position = DriveUntilJoined(estimator.get());
  ASSERT_TRUE(estimator->SetMode(RunMode::kLocalization).ok());
  const std::shared_ptr<const Map> map = estimator->map();
  ExpectInKnownFrame(estimator.get(), position);
  estimator->Restart();
  EXPECT_EQ(estimator->map(), map) << "both are what is localised in";
}

TEST_F(JoinedSession, ThreadedBothMapsBecomeOneWhileTheDriveGoesOn) { JoinAndDriveOn(Schedule::kThreaded); }

TEST_F(JoinedSession, ThreadedCommandsComeBeforeTheJoin) {
  LoadBeforeTheJoin(Schedule::kThreaded);
  RestartBeforeTheJoin(Schedule::kThreaded);
  LocalizeBeforeTheJoin(Schedule::kThreaded);
  const std::unique_ptr<Estimator> ends_meanwhile = BesideKnown(Schedule::kThreaded);
  Drive(ends_meanwhile.get(), kTurn, kKnownEnd);
}

}  // namespace
}  // namespace planar_vslam
