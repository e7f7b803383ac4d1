#include "planar_vslam/io/carmen_log.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "recording_testing.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

constexpr char kScan[] = "FLASER 4 1.0 2.0 3.0 81.9 0.5 -0.25 1.5 0.5 -0.25 1.5 1000.0 host 1000.0\n";

std::string ErrorOf(const std::string& text) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "scans.log";
  WriteText(path, text);
  const auto scans = ReadCarmenLog(path);
  return scans ? "" : scans.error().message;
}

TEST(CarmenLog, ReadsScansAndPosesAndSkipsOtherLines) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "scans.log";
  WriteText(path, std::string("# comment\r\nPARAM robot on\nODOM 1 2 3\n\n") + kScan + "NEFF 3\n" + kScan);
  const auto scans = ReadCarmenLog(path);
  ASSERT_TRUE(scans.ok()) << scans.error().message;
  ASSERT_EQ(scans->size(), 2U);
  const CarmenScan& first = scans->front();
  EXPECT_EQ(first.scan.ranges, (std::vector<float>{1.0F, 2.0F, 3.0F, 81.9F}));
  EXPECT_EQ(first.T_map_laser.translation, Eigen::Vector2d(0.5, -0.25));
  EXPECT_DOUBLE_EQ(first.T_map_laser.angle, 1.5);
  EXPECT_DOUBLE_EQ(first.scan.angle_min, -M_PI_2);
  EXPECT_DOUBLE_EQ(first.scan.angle_increment, M_PI / 4.0);
  EXPECT_LT(first.scan.range_max, 81.9) << "error codes are no returns";
}

TEST(CarmenLog, OddNumberOfBeamsReachesBothEndsOfTheHalfCircle) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "scans.log";
  WriteText(path, "FLASER 3 1 1 1 0 0 0 0 0 0");
  const auto scans = ReadCarmenLog(path);
  ASSERT_TRUE(scans.ok());
  EXPECT_DOUBLE_EQ(scans->front().scan.angle_increment, M_PI_2);
}

// A FLASER line of so many ranges.
std::string Flaser(int count) {
  std::string line = "FLASER " + std::to_string(count);
  for (int i = 0; i < count; ++i) line += " 2.5";
  return line + " 0 0 0 0 0 0 1 host 1\n";
}

TEST(CarmenLog, MoreBeamsThanAHalfCircleHoldsNeedAFieldOfView) {
  for (const int count : {180, 181, 360, 361, 720, 721}) EXPECT_EQ(ErrorOf(Flaser(count)), "") << count;
  for (const int count : {541, 1081, 682, 271}) {
    ExpectInError(ErrorOf("#\n" + Flaser(count)), {"scans.log:2", std::to_string(count), "laser_front_laser_fov"});
  }
  const TemporaryFolder folder;
  const auto path = folder.path() / "scans.log";
  WriteText(path, "\xEF\xBB\xBFPARAM laser_front_laser_fov 270.0 host 0\nPARAM laser_rear_laser_fov 90 host 0\n" +
                      Flaser(541));
  const auto scans = ReadCarmenLog(path);
  ASSERT_TRUE(scans.ok()) << scans.error().message;
  EXPECT_NEAR(scans->front().scan.angle_min, -0.75 * M_PI, 1e-12);
  EXPECT_NEAR(scans->front().scan.angle_increment, M_PI / 360.0, 1e-12);
}

TEST(CarmenLog, RobotLaserLinesSayTheirDirections) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "scans.log";
  const std::string robot =
      "ROBOTLASER1 0 -2.0 4.0 1.0 20.0 0.01 0 5 1 2 3 25 0 2 7 8 0.5 -0.25 1.5 0.4 -0.2 1.5 0 0 0 0 0 1 h 1\n";
  WriteText(path, std::string(kScan) + robot + kScan + robot);
  const auto scans = ReadCarmenLog(path);
  ASSERT_TRUE(scans.ok()) << scans.error().message;
  ASSERT_EQ(scans->size(), 2U) << "the same scans, once";
  const CarmenScan& first = scans->front();
  EXPECT_EQ(first.scan.angle_min, -2.0);
  EXPECT_EQ(first.scan.angle_increment, 1.0);
  EXPECT_EQ(first.scan.range_max, 20.0);
  EXPECT_EQ(first.scan.ranges.size(), 5U);
  EXPECT_EQ(first.T_map_laser.translation, Eigen::Vector2d(0.5, -0.25));
  ExpectInError(ErrorOf("ROBOTLASER1 0 -2.0 4.0 1,0 20.0 0.01 0 1 1"),
                {"scans.log:1", "ROBOTLASER1", "resolution", "1,0"});
  ExpectInError(ErrorOf("ROBOTLASER1 0 -2.0 4.0 90 20.0 0.01 0 3 1 1 1 0 0 0 0"), {"scans.log:1", "radians"});
}

TEST(CarmenLog, BadLinesAreNamed) {
  ExpectInError(ErrorOf(""), {"scans.log", "FLASER"});
  ExpectInError(ErrorOf("ODOM 1 2 3\n"), {"scans.log", "no FLASER"});
  ExpectInError(ErrorOf("#\nFLASER"), {"scans.log:2", "number of ranges"});
  ExpectInError(ErrorOf("FLASER x 1 2"), {"scans.log:1", "number of ranges"});
  ExpectInError(ErrorOf("FLASER -4 1 2"), {"scans.log:1", "number of ranges"});
  ExpectInError(ErrorOf("FLASER 999999999 1 2"), {"scans.log:1", "number of ranges"});
  ExpectInError(ErrorOf("FLASER 99999999999999999999 1 2"), {"scans.log:1", "number of ranges"});
  ExpectInError(ErrorOf(std::string(kScan) + "FLASER 4 1 2 3"), {"scans.log:2", "5 fields", "4 ranges"});
  ExpectInError(ErrorOf("FLASER 2 1 two 0 0 0 0 0 0"), {"scans.log:1", "range 2", "two"});
  ExpectInError(ErrorOf("FLASER 2 1 nan 0 0 0 0 0 0"), {"scans.log:1", "range 2"});
  ExpectInError(ErrorOf("FLASER 2 1 1 0 inf 0 0 0 0"), {"scans.log:1", " y "});
  ExpectInError(ErrorOf(std::string(2 << 20, 'x')), {"scans.log:1", "longer"});
  ExpectInError(ErrorOf("\x1f\x8b\x08 not really gzip"), {"scans.log"});
}

TEST(CarmenLog, MissingFileIsNamed) {
  const auto scans = ReadCarmenLog("/nowhere/scans.log");
  ASSERT_FALSE(scans.ok());
  ExpectInError(scans.error().message, {"/nowhere/scans.log"});
}

TEST(CarmenLog, CompressedLogsAreReadAndCutOnesRefused) {
  const auto folder = SequenceFolder("carmen");
  if (!folder) GTEST_SKIP() << "sequence carmen is not on this machine";
  const auto scans = ReadCarmenLog(*folder / "csail-corrected.log.gz");
  ASSERT_TRUE(scans.ok()) << scans.error().message;
  EXPECT_EQ(scans->size(), 406U);
  EXPECT_EQ(scans->front().scan.ranges.size(), 361U);
  const TemporaryFolder cut;
  const auto path = cut.path() / "cut.log.gz";
  std::filesystem::copy_file(*folder / "csail-corrected.log.gz", path);
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  std::filesystem::resize_file(path, 100000);
  const auto broken = ReadCarmenLog(path);
  ASSERT_FALSE(broken.ok());
  ExpectInError(broken.error().message, {"cut.log.gz", "cut off"});
}

}  // namespace
}  // namespace planar_vslam::test
