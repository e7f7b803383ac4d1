#include <gtest/gtest.h>

#include "recording_testing.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;
using test::ExpectInError;
using test::OpenError;
using test::Play;
using test::Replay;
using test::WriteText;

constexpr const char* kCamera =
    "camera: {width: 32, height: 24, fx: 30, fy: 31, cx: 16, cy: 12, k1: 0.1, k2: 0, p1: 0, p2: 0, model: plumb_bob}\n";
constexpr const char* kExtrinsics =
    "T_base_camera: {t: [0.1, 0, 1.1], q_xyzw: [-0.5, 0.5, -0.5, 0.5]}\nT_base_laser: {t: [0, 0, 0.25], q_xyzw: [0, 0, "
    "0, 1]}\n"
    "laser: {angle_min: -1.5, angle_increment: 0.5, beams: 3, range_max: 8.0}\n";

// images at 0, 0.1, 0.2, 0.3 s; odometry at 0.05, 0.1, 0.15 s; scans at 0.1, 0.25 s.
class DatasetFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(path() / "images");
    std::string list = "#t,file\n";
    for (int i = 0; i < 4; ++i) {
      const std::string name = "images/" + std::to_string(i) + ".png";
      cv::imwrite((path() / name).string(), test::RampImage());
      list += "0." + std::to_string(i) + "," + name + "\n";
    }
    WriteText(path() / "images.csv", list);
    WriteText(path() / "odometry.csv",
              "#t,x,y,theta,vx,vy,wz\n0.05,1,2,0.5,0,0,0\n0.1,1.1,2,0.5,0,0,0\n0.15,1.2,2,0.5,0,0,0\n");
    WriteText(path() / "scan.csv", "0.1,1.5,inf,3\n0.25,1,2,nan\n");
    WriteText(path() / "calibration.yaml", std::string(kCamera) + kExtrinsics);
  }
  const fs::path& path() const { return folder_.path(); }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(DatasetFolder, EventsComeInTimeOrderWithTheirValues) {
  const Replay replay = Play(path());
  EXPECT_EQ(replay.error, "");
  EXPECT_EQ(replay.order, "ioolioili");
  EXPECT_TRUE(replay.skipped.empty());
  EXPECT_EQ(replay.info.image_count, 4);
  EXPECT_EQ(replay.info.first_image, Timestamp::FromSeconds(0.0));
  EXPECT_EQ(replay.info.last_image, Timestamp::FromSeconds(0.3));
  EXPECT_TRUE(replay.info.has_odometry && replay.info.has_laser && replay.info.has_base_transform);
  EXPECT_EQ(replay.info.camera.fy, 31.0);
  EXPECT_EQ(replay.info.camera.k1, 0.1);
  ASSERT_EQ(replay.images.size(), 4U);
  const CameraFrame& frame = replay.images[1];
  EXPECT_EQ(frame.image.image.width, 32);
  EXPECT_EQ((*frame.image.image.pixels)[32 * 5 + 7], 28);
  EXPECT_NEAR(frame.T_base_camera.translation.z(), 1.1, 1e-12);
  EXPECT_NEAR((frame.T_base_camera.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-12);
  EXPECT_EQ(replay.odometry[2].T_odom_base.translation.x(), 1.2);
  EXPECT_EQ(replay.odometry[2].T_odom_base.angle, 0.5);
  EXPECT_EQ(replay.scans[0].scan.ranges[0], 1.5F);
  EXPECT_TRUE(std::isinf(replay.scans[0].scan.ranges[1]));
  EXPECT_EQ(replay.scans[0].scan.range_max, 8.0);
  EXPECT_EQ(replay.scans[0].T_base_laser.translation.z(), 0.25);
}

TEST_F(DatasetFolder, AMovingHeadIsWhereBaseCameraTxtSays) {
  WriteText(path() / "base_camera.txt",
            "# t x y z qx qy qz qw\n0 0.1 0 1.0 -0.5 0.5 -0.5 0.5\n0.2 0.3 0 1.2 -0.5 0.5 -0.5 0.5\n");
  WriteText(path() / "calibration.yaml",
            std::string(kCamera) +
                "T_base_laser: {t: [0, 0, 0.25], q_xyzw: [0, 0, 0, 1]}\nlaser: {angle_min: -1.5, "
                "angle_increment: 0.5, beams: 3, range_max: 8.0}\n");
  const Replay replay = Play(path());
  EXPECT_EQ(replay.error, "");
  EXPECT_TRUE(replay.info.has_base_transform) << "no other is needed";
  ASSERT_EQ(replay.images.size(), 3U);
  EXPECT_NEAR(replay.images[0].T_base_camera.translation.z(), 1.0, 1e-9);
  EXPECT_NEAR(replay.images[1].T_base_camera.translation.x(), 0.2, 1e-9) << "between the lines";
  EXPECT_NEAR(replay.images[2].T_base_camera.translation.x(), 0.3, 1e-9);
  EXPECT_EQ(replay.skipped.at("image outside base_camera.txt"), 1) << "at 0.3 s nobody knows";
}

TEST_F(DatasetFolder, BadBaseCameraTxtIsNamedWithItsLine) {
  const fs::path file = path() / "base_camera.txt";
  WriteText(file, "# only a comment\n");
  ExpectInError(OpenError(path()), {"base_camera.txt", "no poses", "expected"});
  WriteText(file, "0 0.1 0 1.0 -0.5 0.5 -0.5\n");
  ExpectInError(OpenError(path()), {"base_camera.txt:1", "7 fields", "expected 8"});
  WriteText(file, "0 0.1 0 1.0 -0.5 0.5 -0.5 0.5\n0.1 nan 0 1.0 -0.5 0.5 -0.5 0.5\n");
  ExpectInError(OpenError(path()), {"base_camera.txt:2", "finite"});
  WriteText(file, "0 0.1 0 1.0 -0.5 0.5 -0.5 0.9\n");
  ExpectInError(OpenError(path()), {"base_camera.txt:1", "quaternion"});
  WriteText(file, "0.1 0.1 0 1.0 -0.5 0.5 -0.5 0.5\n0.1 0.1 0 1.0 -0.5 0.5 -0.5 0.5\n");
  ExpectInError(OpenError(path()), {"base_camera.txt:2", "not later"});
}

TEST_F(DatasetFolder, WithoutWheelsAndBaseTheBaseIsTheCamera) {
  fs::remove(path() / "odometry.csv");
  fs::remove(path() / "scan.csv");
  WriteText(path() / "calibration.yaml", kCamera);
  const Replay replay = Play(path());
  EXPECT_EQ(replay.order, "iiii");
  EXPECT_FALSE(replay.info.has_odometry || replay.info.has_laser || replay.info.has_base_transform);
  EXPECT_LT(LogSe3(replay.images[0].T_base_camera).norm(), 1e-12);
  RecordingOptions options;
  options.require_odometry = true;
  ExpectInError(OpenError(path(), options), {path().string(), "odometry.csv", "required"});
}

TEST_F(DatasetFolder, AnotherOdometryFileCanBeGiven) {
  WriteText(path() / "other.csv", "0.2,7,0,0\n");
  RecordingOptions options;
  options.odometry_file = path() / "other.csv";
  EXPECT_EQ(Play(path(), options).odometry.at(0).T_odom_base.translation.x(), 7.0);
  options.odometry_file = "other.csv";  // also beside the images
  EXPECT_EQ(Play(path(), options).odometry.size(), 1U);
  options.odometry_file = "none.csv";
  ExpectInError(OpenError(path(), options), {"none.csv", "no such file"});
}

TEST_F(DatasetFolder, SingleBadImagesAreSkippedAndCounted) {
  fs::remove(path() / "images/1.png");
  WriteText(path() / "images/2.png", "not a picture");
  cv::imwrite((path() / "images/3.png").string(), test::RampImage(16, 24));
  const Replay replay = Play(path());
  EXPECT_EQ(replay.error, "");
  EXPECT_EQ(replay.images.size(), 1U);
  const std::map<std::string, long> expected{
      {"image file missing", 1}, {"image not decodable", 1}, {"image of changed size", 1}};
  EXPECT_EQ(replay.skipped, expected);
}

TEST_F(DatasetFolder, UnusableStampsAreSkippedAndCounted) {
  WriteText(path() / "images.csv", "0.0,images/0.png\n0.0,images/1.png\nnan,images/2.png\n0.3,images/3.png\n");
  WriteText(path() / "odometry.csv", "0.05,1,2,0.5\n0.04,1,2,0.5\n0.1,nan,2,0.5\n0.2,1,2,0.5\n");
  WriteText(path() / "scan.csv", "0.1,1,1,1\n0.1,1,1,1\ninf,1,1,1\n");
  const Replay replay = Play(path());
  EXPECT_EQ(replay.order, "ioloi");
  const std::map<std::string, long> expected{{"image stamp not increasing", 1},    {"image stamp not finite", 1},
                                             {"odometry stamp not increasing", 1}, {"odometry pose not finite", 1},
                                             {"scan stamp not increasing", 1},     {"scan stamp not finite", 1}};
  EXPECT_EQ(replay.skipped, expected);
}

TEST_F(DatasetFolder, MalformedLinesAreNamed) {
  for (const std::string line : {"0.4", "x,images/0.png", "0.4,", "0.4,a,b"}) {
    WriteText(path() / "images.csv", "#t,file\n0,images/0.png\n" + line + "\n");
    ExpectInError(OpenError(path()), {"images.csv:3: "});
  }
  WriteText(path() / "images.csv", "0,images/0.png\n");
  for (const std::string line : {"0.4,1,2", "0.4,1,2,z", ",1,2,3"}) {
    WriteText(path() / "odometry.csv", "0,1,2,3\n" + line + "\n");
    ExpectInError(OpenError(path()), {"odometry.csv:2: "});
  }
  fs::remove(path() / "odometry.csv");
  for (const std::string line : {"0.4,1,2", "0.4,1,2,z", "t,1,2,3"}) {
    WriteText(path() / "scan.csv", "0.1,1,2,3\n" + line + "\n");
    ExpectInError(Play(path()).error, {"scan.csv:2: "});
  }
}

TEST_F(DatasetFolder, ImagesMustFitTheCalibration) {
  cv::imwrite((path() / "images/0.png").string(), test::RampImage(64, 48));
  ExpectInError(OpenError(path()), {"images/0.png", "64x48", "32x24", "calibration.yaml"});
  for (int i = 0; i < 4; ++i) fs::remove(path() / ("images/" + std::to_string(i) + ".png"));
  ExpectInError(OpenError(path()), {"images/0.png", "missing", "JPEG, PNG"});
  WriteText(path() / "images.csv", "#t,file\n");
  ExpectInError(OpenError(path()), {"images.csv", "no images"});
}

TEST_F(DatasetFolder, TextsOfOtherProgramsAreRead) {
  const Replay plain = Play(path());
  for (const char* name : {"images.csv", "odometry.csv", "scan.csv"}) {
    std::ifstream file(path() / name);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    for (std::size_t end = 0; (end = text.find('\n', end)) != std::string::npos; end += 2) text.replace(end, 1, "\r\n");
    WriteText(path() / name, "\xEF\xBB\xBF" + text);
  }
  const Replay foreign = Play(path());
  EXPECT_EQ(foreign.error, "");
  EXPECT_EQ(foreign.order, plain.order);
  EXPECT_EQ(foreign.stamps, plain.stamps);
  WriteText(path() / "images.csv", "\xFF\xFE#");
  ExpectInError(OpenError(path()), {"images.csv", "UTF-16", "UTF-8"});
}

TEST_F(DatasetFolder, StampsMayBeNanoseconds) {
  WriteText(path() / "images.csv", "1403636579763555584,images/0.png\n1403636579813555456,images/1.png\n");
  WriteText(path() / "odometry.csv", "1403636579760000000,0,0,0\n1403636579900000000,0,0,0\n");
  WriteText(path() / "scan.csv", "1403636579770000000,1,2,3\n");
  const Replay replay = Play(path());
  EXPECT_EQ(replay.error, "");
  EXPECT_EQ(replay.order, "oilio");
  EXPECT_EQ(replay.images[0].image.stamp.nanoseconds, 1403636579763555584);
}

TEST_F(DatasetFolder, LensesAreThoseOfCameraInfo) {
  const std::string pinhole = "width: 32, height: 24, fx: 30, fy: 31, cx: 16, cy: 12, ";
  const auto camera = [&](const std::string& lens) {
    WriteText(path() / "calibration.yaml", "camera: {" + pinhole + lens + "}\n" + kExtrinsics);
    const Replay replay = Play(path());
    EXPECT_EQ(replay.error, "");
    return replay.info.camera;
  };
  const CameraModel rational = camera("k1: 0.1, k4: 0.2, k6: 0.01, model: rational_polynomial");
  EXPECT_EQ(rational.k1, 0.1);
  EXPECT_EQ(rational.k6, 0.01);
  const CameraModel fisheye = camera("k1: 0.1, k4: 0.02, model: equidistant");
  EXPECT_EQ(fisheye.lens, Lens::kEquidistant);
  EXPECT_EQ(fisheye.k4, 0.02);
}

TEST_F(DatasetFolder, CalibrationErrorsNameTheKey) {
  const std::string camera = kCamera;
  const auto error = [&](const std::string& text) {
    WriteText(path() / "calibration.yaml", text);
    return OpenError(path());
  };
  ExpectInError(error(camera + "T_base_camra: {t: [0, 0, 0], q_xyzw: [0, 0, 0, 1]}\n"),
                {"calibration.yaml", "T_base_camra"});
  ExpectInError(error("camera: {width: 32, height: 24, fx: 30, fy: 31, cx: 16, cy: 12, k_1: 0.1}\n"),
                {"k_1", "camera"});
  ExpectInError(error("camera: {width: 32, height: 24, fx: 30, cx: 16, cy: 12}\n"), {"camera.fy"});
  ExpectInError(error("camera: {width: 32, height: 24, fx: abc, fy: 31, cx: 16, cy: 12}\n"), {"camera.fx"});
  ExpectInError(error("camera: {width: 32.5, height: 24, fx: 30, fy: 31, cx: 16, cy: 12}\n"), {"camera.width"});
  ExpectInError(error("camera: {width: 32, height: 24, fx: 0, fy: 31, cx: 16, cy: 12}\n"), {"camera"});
  ExpectInError(error("camera: {width: 32, height: 24, fx: 30, fy: 31, cx: 16, cy: 12, model: omni}\n"),
                {"camera.model", "omni", "plumb_bob"});
  ExpectInError(error("camera: [1, 2\n"), {"calibration.yaml:"});
  ExpectInError(error("just text\n"), {"calibration.yaml", "map"});
  ExpectInError(error(camera + "T_base_camera: {t: [0, 0], q_xyzw: [0, 0, 0, 1]}\n"), {"T_base_camera.t", "3 numbers"});
  ExpectInError(error(camera + "T_base_camera: {t: [0, 0, 0], q_xyzw: [0, 0, 0, 2]}\n"),
                {"T_base_camera.q_xyzw", "unit"});
  ExpectInError(error(camera), {"T_base_camera", "odometry"});
  fs::remove(path() / "odometry.csv");
  ExpectInError(error(camera + "T_base_camera: {t: [0, 0, 0], q_xyzw: [0, 0, 0, 1]}\n"), {"T_base_laser", "scan.csv"});
  fs::remove(path() / "calibration.yaml");
  ExpectInError(OpenError(path()), {"calibration.yaml", "no such file"});
}

TEST(FolderRecording, WhatIsNoRecordingIsSaid) {
  const test::TemporaryFolder folder;
  ExpectInError(OpenError(folder.path() / "nothing"), {"nothing", "no such file or folder"});
  ExpectInError(OpenError(folder.path()), {folder.path().string(), "images.csv", "rgb.txt", "image_0"});
}

TEST(FolderRecording, TumFoldersNeedACalibration) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder.path() / "rgb");
  cv::Mat color;
  cv::cvtColor(test::RampImage(), color, cv::COLOR_GRAY2BGR);
  cv::imwrite((folder.path() / "rgb/a.png").string(), color);
  cv::imwrite((folder.path() / "rgb/b.png").string(), color);
  WriteText(folder.path() / "rgb.txt",
            "# timestamp filename\n1305031102.175304 rgb/a.png\n1305031102.211214 rgb/b.png\n");
  ExpectInError(OpenError(folder.path()), {"calibration.yaml", "intrinsics"});
  WriteText(folder.path() / "calibration.yaml", kCamera);
  const Replay replay = Play(folder.path());
  EXPECT_EQ(replay.error, "");
  ASSERT_EQ(replay.images.size(), 2U);
  EXPECT_EQ(replay.images[0].image.stamp.nanoseconds, 1'305'031'102'175'304'000);
  EXPECT_NEAR((*replay.images[0].image.image.pixels)[7], 28, 1);
}

TEST(FolderRecording, KittiFoldersTakeTheirCameraFromP0) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder.path() / "image_0");
  cv::imwrite((folder.path() / "image_0/000000.png").string(), test::RampImage());
  cv::imwrite((folder.path() / "image_0/000002.png").string(), test::RampImage());
  WriteText(folder.path() / "times.txt", "0.000000e+00\n1.036224e-01\n2.072980e-01\n");
  WriteText(folder.path() / "calib.txt", "P0: 30 0 16 0 0 31 12 0 0 0 1 0\nP1: 30 0 16 -5 0 31 12 0 0 0 1 0\n");
  const Replay replay = Play(folder.path());
  EXPECT_EQ(replay.error, "");
  ASSERT_EQ(replay.images.size(), 2U);
  EXPECT_EQ(replay.images[1].image.stamp.nanoseconds, 207'298'000);
  EXPECT_EQ(replay.skipped.at("image file missing"), 1);
  EXPECT_EQ(replay.info.camera.width, test::kTestWidth);
  EXPECT_EQ(replay.info.camera.cy, 12.0);
  EXPECT_FALSE(replay.info.camera.distorted());
  WriteText(folder.path() / "calib.txt", "P0: 30 0 16 0 0 31 12\n");
  ExpectInError(OpenError(folder.path()), {"calib.txt:1", "P0"});
  WriteText(folder.path() / "calib.txt", "P1: 30\n");
  ExpectInError(OpenError(folder.path()), {"calib.txt", "P0"});
  fs::remove(folder.path() / "times.txt");
  ExpectInError(OpenError(folder.path()), {"calib.txt"});
}

TEST(FolderRecording, ARealSequencePlaysToItsEnd) {
  const auto folder = test::SequenceFolder("mines");
  const auto kitti = test::SequenceFolder("kitti_raw");
  if (!folder.has_value() || !kitti.has_value()) GTEST_SKIP() << "no sample sequences on this machine";
  ExpectInError(OpenError(*folder), {"mines"});
  const auto recording = OpenRecording(*kitti, {});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_EQ((*recording)->info().image_count, 400);
  EXPECT_TRUE((*recording)->info().has_odometry);
  EXPECT_FALSE((*recording)->info().has_laser);
  EXPECT_EQ((*recording)->info().camera.k3, -0.07233722);
}

}  // namespace
}  // namespace planar_vslam
