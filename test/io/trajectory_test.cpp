#include "planar_vslam/io/trajectory.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

std::string Contents(const fs::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

class TrajectoryTest : public ::testing::Test {
 protected:
  // The error of reading `text`, or an empty string.
  std::string ErrorOf(const std::string& text) {
    const fs::path path = folder_.path() / "t.txt";
    std::ofstream(path) << text;
    const Expected<Trajectory> trajectory = ReadTrajectory(path);
    return trajectory ? "" : trajectory.error().message;
  }
  test::TemporaryFolder folder_;
};

TEST_F(TrajectoryTest, WrittenPosesAreReadBack) {
  std::mt19937 generator(1);
  Trajectory trajectory;
  std::int64_t stamp = 1'700'000'000'123'456'789;
  for (int i = 0; i < 50; ++i) {
    trajectory.push_back({Timestamp{stamp}, test::RandomRigid3(generator, 100.0)});
    stamp += 33'333'333;
  }
  const fs::path path = folder_.path() / "a.txt", again = folder_.path() / "b.txt";
  ASSERT_TRUE(WriteTrajectory(trajectory, path).ok());
  const Expected<Trajectory> read = ReadTrajectory(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_EQ((*read)[i].stamp, trajectory[i].stamp);
    EXPECT_LT(LogSe3((*read)[i].T_map_base.Inverse() * trajectory[i].T_map_base).norm(), 1e-8);
  }
  ASSERT_TRUE(WriteTrajectory(*read, again).ok());
  EXPECT_EQ(Contents(path), Contents(again));
}

TEST_F(TrajectoryTest, StampsAreExactInEveryNotation) {
  const fs::path path = folder_.path() / "t.txt";
  std::ofstream(path) << "# comment\n-1.5 0 0 0 0 0 0 1\n\n0 0 0 0 0 0 0 1\r\n  1e1\t0 0 0 0 0 0 1\n"
                      << "1305031102.175304 0 0 0 0 0 0 1\n1305031102.1753040004 0 0 0 0 0 0 1\n";
  const Expected<Trajectory> read = ReadTrajectory(path);
  ASSERT_FALSE(read.ok());  // the last two stamps are the same nanosecond
  EXPECT_NE(read.error().message.find("t.txt:7"), std::string::npos) << read.error().message;
  std::ofstream(path) << "-1.5 0 0 0 0 0 0 1\n1e1\t0 0 0 0 0 0 1\r\n1305031102.175304 0 0 0 0 0 0 1\n";
  const Expected<Trajectory> good = ReadTrajectory(path);
  ASSERT_TRUE(good.ok()) << good.error().message;
  EXPECT_EQ((*good)[0].stamp.nanoseconds, -1'500'000'000);
  EXPECT_EQ((*good)[1].stamp.nanoseconds, 10'000'000'000);
  EXPECT_EQ((*good)[2].stamp.nanoseconds, 1'305'031'102'175'304'000);
}

TEST_F(TrajectoryTest, QuaternionsArePrintedRoundedAndReadAsUnit) {
  const fs::path path = folder_.path() / "t.txt";
  std::ofstream(path) << "0 0 0 0 0.5001 0.5001 0.5001 0.5001\n";
  const Expected<Trajectory> read = ReadTrajectory(path);
  ASSERT_TRUE(read.ok());
  EXPECT_NEAR(read->front().T_map_base.rotation.norm(), 1.0, 1e-12);
}

TEST_F(TrajectoryTest, BadLinesAreNamed) {
  const std::string good = "0 0 0 0 0 0 0 1\n";
  for (const std::string bad : {"1 0 0 0 0 0 1", "1 0 0 0 0 0 0 1 5", "nan 0 0 0 0 0 0 1", "x 0 0 0 0 0 0 1",
                                "1 0 nan 0 0 0 0 1", "1 0 0,5 0 0 0 0 1", "1 0 0 0 0 0 0 0", "0 1 0 0 0 0 0 1"}) {
    EXPECT_NE(ErrorOf(good + bad + "\n").find("t.txt:2: "), std::string::npos) << bad << " -> " << ErrorOf(good + bad);
  }
  EXPECT_EQ(ErrorOf(""), "");
}

TEST_F(TrajectoryTest, MissingFilesAndFoldersAreNamed) {
  const Expected<Trajectory> missing = ReadTrajectory(folder_.path() / "none.txt");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("none.txt"), std::string::npos);
  EXPECT_FALSE(ReadTrajectory(folder_.path()).ok());
  EXPECT_FALSE(WriteTrajectory({}, folder_.path() / "no" / "t.txt").ok());
}

}  // namespace
}  // namespace planar_vslam
