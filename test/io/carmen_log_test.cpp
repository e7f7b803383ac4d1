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
