// Localisation in the map of a wall, packet by packet: where the last frame is, and what is told of a known map.
#include "planar_vslam/pipeline/localization.h"

#include <gtest/gtest.h>

#include "localize/floor_plan.h"
#include "planar_vslam/pipeline/estimator.h"
#include "planar_vslam/pipeline/known_map.h"
#include "planar_vslam/pipeline/mapper_context.h"
#include "support/wall_drive.h"

namespace planar_vslam {
namespace {

using test::WallDrive;

class LocalizationTest : public ::testing::Test {
 protected:
  static constexpr int kPositions = 120, kStride = 4;

  // Of the whole wall.
  const SavedMap& Saved() {
    static const SavedMap saved = [this] {
      EstimatorSettings settings;
      settings.camera = WallDrive::Camera();
      Estimator estimator(settings);
      for (int p = 0; p < kPositions; p += kStride) {
        if (p > 0) estimator.Add(drive_.FrameAt(p, p));
        estimator.Add(WallDrive::OdometryAt(p, p));
      }
      EXPECT_TRUE(estimator.Finish().ok());
      return SavedMap{*estimator.map(), WallDrive::Camera()};
    }();
    return saved;
  }
  // m along x in the map, of a place of the drive that made it.
  double MapX(int position) {
    const Timestamp first = Saved().map.keyframes.begin()->second.stamp;
    const auto origin = (first.nanoseconds - WallDrive::StampOf(0).nanoseconds) / WallDrive::kPeriod;
    return WallDrive::kStep * static_cast<double>(position - origin);
  }
  std::unique_ptr<Localization> InMap() { return In(Saved().map); }
  static std::unique_ptr<Localization> In(const Map& map) {
    const PipelineOptions options;
    auto localization = std::make_unique<Localization>(options, MeasurementModelOf(options, WallDrive::Camera(), true),
                                                       Schedule::kInline, 0);
    localization->StartIn(std::make_shared<const Map>(map));
    return localization;
  }
  // The next image, at `position`, where the wheels have measured `beyond` more than the way from the one before.
  FramePacket PacketAt(int position, double beyond = 0.0) {
    const CameraFrame frame = drive_.FrameAt(++image_, position);
    FramePacket packet{frame.image, frame.T_base_camera, {}, std::nullopt, {}};
    const Rigid2 slipped({beyond, 0.0}, 0.0);
    packet.odometry = {{WallDrive::StampOf(image_ - 1), WallDrive::PoseOf(last_position_)},
                       {WallDrive::StampOf(image_), WallDrive::PoseOf(position) * slipped}};
    packet.T_odom_base = packet.odometry.back().T_odom_base;
    last_position_ = position;
    return packet;
  }

  WallDrive drive_{kPositions};
  int image_ = 0, last_position_ = 0;
};

TEST_F(LocalizationTest, TheLastFrameGoesWithAMapThatChanges) {
  const std::unique_ptr<Localization> localization = InMap();
  EXPECT_FALSE(localization->LastFix().has_value());
  for (int p = 20; p < 60; p += kStride) {
    FrameReport report;
    localization->Locate(PacketAt(p), KeyframeSlot::kTaken, &report, nullptr);
  }
  ASSERT_TRUE(localization->LastFix().has_value());
  const Rigid2 before = localization->LastFix()->T_map_base;
  const Rigid2 T_new_old(-3.0, 7.0, 2.2);  // another frame, as after a join
  MapChange change;
  change.map = std::make_shared<const Map>(Apply(*localization->map(), {TransformMap{1.0, Embed3(T_new_old)}}));
  localization->Follow(change);
  const Rigid2 off = (T_new_old * before).Inverse() * localization->LastFix()->T_map_base;
  EXPECT_LT(LogSe2(off).norm(), 1e-9);
}

// The wall is one of a room that is the same to the laser when it is turned by 180 degrees: the camera finds it first.
class LocalizationInARoom : public LocalizationTest {
 protected:
  LocalizationInARoom() { room_.Box(-3.0, -1.5, 4.2, 2.0); }

  Map WithSweeps() {
    Map map = Saved().map;
    for (const KeyframeId id : map.keyframes.Ids()) {
      const Rigid2 T_map_base = ProjectToPlane(map.keyframes.At(id).T_map_base);
      std::vector<LaserSweep>& sweeps = map.keyframes.Edit(id).sweeps;
      sweeps.clear();
      for (const Rigid2& turned : {Rigid2(), Rigid2(0.0, 0.0, M_PI)}) {  // all round
        const auto scan = std::make_shared<const PlanarScan>(room_.Sweep(T_map_base * turned, id.value + 1));
        sweeps.push_back({scan, test::FloorPlan::T_base_laser(), turned});
      }
    }
    return map;
  }
  // The first frame with a pose, of a drive along the wall of which the pictures were moved by so many m.
  FrameReport FirstPose(double moved) {
    const std::unique_ptr<Localization> localization = In(WithSweeps());
    FrameReport report;
    for (int p = 40; p < 60 && !report.T_map_base.has_value(); p += kStride) {
      report = FrameReport{};
      FramePacket packet = PacketAt(p);
      true_x_ = MapX(p) - moved;
      const Rigid2 T_map_base(true_x_, 0.0, 0.0);
      packet.scans.push_back({room_.Sweep(T_map_base, 7), test::FloorPlan::T_base_laser(), Rigid2()});
      localization->Locate(packet, KeyframeSlot::kNone, &report, nullptr);
    }
    return report;
  }

  test::FloorPlan room_;
  double true_x_ = 0.0;
};

TEST_F(LocalizationInARoom, AFirstPoseByTheCameraIsConfirmedByTheLaser) {
  const FrameReport first = FirstPose(0.0);
  ASSERT_TRUE(first.T_map_base.has_value());
  EXPECT_EQ(first.state, TrackingState::kRelocalized);
  EXPECT_GT(first.inliers, 0);
  EXPECT_NEAR(first.T_map_base->translation.x(), true_x_, 0.02);
}

TEST_F(LocalizationInARoom, AFirstPoseByWhatWasMovedIsPutWhereTheLaserHasIt) {
  const FrameReport first = FirstPose(0.12);
  ASSERT_TRUE(first.T_map_base.has_value());
  EXPECT_EQ(first.state, TrackingState::kRelocalized) << "the laser tells it, though the camera does not follow";
  EXPECT_NEAR(first.T_map_base->translation.x(), true_x_, 0.03);
}

TEST_F(LocalizationTest, AKnownMapTellsWhereAFrameIsNotWhatIsPublishedOfIt) {
  KnownMap known(InMap());
  StageTimes times;
  for (int p = 20; p < 60; p += kStride) (void)known.Locate(PacketAt(p), nullptr, &times);
  constexpr double kSlip = 0.06;  // m, of which the published pose pays 0.018 back with each image
  const std::optional<Rigid3> T_known_base = known.Locate(PacketAt(60, kSlip), nullptr, &times);
  ASSERT_TRUE(T_known_base.has_value());
  EXPECT_NEAR(T_known_base->translation.x(), MapX(60), 0.01);
  EXPECT_EQ(times.size(), 11U) << "its time is counted";
}

}  // namespace
}  // namespace planar_vslam
