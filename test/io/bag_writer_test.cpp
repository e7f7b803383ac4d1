#include "planar_vslam/io/bag_writer.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "bag_sink.h"
#include "planar_vslam/io/recording.h"
#include "recording_testing.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

BagRobot SomeRobot() {
  BagRobot robot;
  robot.camera = {64, 48, 60.0, 60.0, 31.0, 24.0, 0.01, -0.02, 0.0, 0.0, 0.0};
  Eigen::Matrix3d R_base_camera;
  R_base_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  robot.T_base_camera = Rigid3(R_base_camera, Eigen::Vector3d(0.1, 0.0, 1.1));
  robot.T_base_laser = Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 0.25));
  return robot;
}

Timestamp Milliseconds(std::int64_t count) { return {count * 1'000'000}; }

// Two seconds: odometry at 20 Hz, images and scans at 10 Hz.
void WriteDrive(const fs::path& path, const BagRobot& robot) {
  Expected<BagWriter> writer = BagWriter::Create(path, robot);
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  for (int i = 0; i <= 40; ++i) {
    writer->Write(OdometryReading{Milliseconds(50 * i), Rigid2(0.02 * i, 0.0, 0.01 * i)});
    if (i % 2 != 0) continue;
    PlanarScan scan{Milliseconds(50 * i), -1.0, 0.5, 0.05, 5.0, {1.0f, 2.0f, 3.0f, 4.0f, 4.5f}};
    writer->Write(LaserFrame{scan, robot.T_base_laser});
    const auto pixels = std::make_shared<const std::vector<std::uint8_t>>(64 * 48, static_cast<std::uint8_t>(4 * i));
    const Rigid3 T_pan(ExpSo3({0.0, 0.01 * i, 0.0}), Eigen::Vector3d::Zero());
    CameraFrame frame;
    frame.image.stamp = Milliseconds(50 * i);
    frame.image.image = {64, 48, pixels};
    frame.T_base_camera = robot.camera_moves ? robot.T_base_camera * T_pan : robot.T_base_camera;
    writer->Write(frame);
  }
  const Expected<bool> closed = writer->Close();
  ASSERT_TRUE(closed.ok()) << closed.error().message;
}

std::string Contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(BagWriter, WritesWhatTheReaderReads) {
  const test::TemporaryFolder folder;
  WriteDrive(folder.path() / "drive.bag", SomeRobot());
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(folder.path() / "drive.bag", RecordingOptions{});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_EQ((*recording)->info().camera.width, 64);
  EXPECT_EQ((*recording)->info().camera.k2, -0.02);
  EXPECT_TRUE((*recording)->info().has_odometry);
  EXPECT_TRUE((*recording)->info().has_laser);
  EXPECT_TRUE((*recording)->info().has_base_transform);
}

TEST(BagWriter, TheSameDriveGivesTheSameBytes) {
  const test::TemporaryFolder folder;
  WriteDrive(folder.path() / "a.bag", SomeRobot());
  WriteDrive(folder.path() / "b.bag", SomeRobot());
  const std::string a = Contents(folder.path() / "a.bag");
  EXPECT_GT(a.size(), 10000u);
  EXPECT_EQ(a, Contents(folder.path() / "b.bag"));
}

// What is read is the same to the last bit, whichever kind of bag it was written to.
TEST(BagWriter, EveryKindOfBagIsTheSameDrive) {
  const test::TemporaryFolder folder;
  BagRobot robot = SomeRobot();
  robot.camera_moves = true;
  WriteDrive(folder.path() / "drive.bag", robot);
  const test::Replay usual = test::Play(folder.path() / "drive.bag");
  ASSERT_EQ(usual.images.size(), 21U);
  for (const char* name : {"drive.mcap", "drive.db3"}) {
    WriteDrive(folder.path() / name, robot);
    const test::Replay replay = test::Play(folder.path() / name);
    EXPECT_EQ(replay.order, usual.order);
    EXPECT_EQ(replay.stamps, usual.stamps);
    ASSERT_EQ(replay.images.size(), usual.images.size());
    for (std::size_t i = 0; i < usual.images.size(); ++i) {
      EXPECT_EQ(*replay.images[i].image.image.pixels, *usual.images[i].image.image.pixels);
      EXPECT_EQ(replay.images[i].T_base_camera.translation, usual.images[i].T_base_camera.translation);
      EXPECT_EQ(replay.images[i].T_base_camera.rotation.coeffs(), usual.images[i].T_base_camera.rotation.coeffs());
    }
    ASSERT_EQ(replay.odometry.size(), usual.odometry.size());
    for (std::size_t i = 0; i < usual.odometry.size(); ++i) {
      EXPECT_EQ(replay.odometry[i].T_odom_base.translation, usual.odometry[i].T_odom_base.translation);
      EXPECT_EQ(replay.odometry[i].T_odom_base.angle, usual.odometry[i].T_odom_base.angle);
    }
    ASSERT_EQ(replay.scans.size(), usual.scans.size());
    EXPECT_EQ(replay.scans[3].scan.ranges, usual.scans[3].scan.ranges);
  }
}

// Whoever plays one and listens later hears /tf_static, which is sent once.
TEST(BagWriter, StaticTransformsAreKeptForWhoComesLate) {
  const test::TemporaryFolder folder;
  const std::map<std::string, std::string> marks{
      {".bag", "latching=1"}, {".mcap", "durability: 1"}, {".db3", "durability: 1"}};
  for (const auto& [kind, mark] : marks) {
    const fs::path path = folder.path() / ("drive" + kind);
    if (kind == ".mcap") {
      const auto sink = io::CreateMcap(path, {false, "", false});
      sink->Write("/odom", "nav_msgs/Odometry", 0, "");
      sink->Write("/tf_static", "tf2_msgs/TFMessage", 0, "");
      sink->Close();
    } else {
      WriteDrive(path, SomeRobot());
    }
    const std::string bytes = Contents(path);
    EXPECT_NE(bytes.find(mark), std::string::npos) << kind;
    EXPECT_EQ(io::OfferedQos("/odom"), "");
  }
}

TEST(BagWriter, AMovingCameraIsATransformOfItsOwn) {
  const test::TemporaryFolder folder;
  BagRobot robot = SomeRobot();
  robot.camera_moves = true;
  WriteDrive(folder.path() / "head.bag", robot);
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(folder.path() / "head.bag", RecordingOptions{});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_TRUE((*recording)->info().has_base_transform);
}

TEST(BagWriter, NamesTheFileItCannotWrite) {
  EXPECT_NE(BagWriter::Create("/nowhere/drive.bag", SomeRobot()).error().message.find("/nowhere/drive.bag"),
            std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
