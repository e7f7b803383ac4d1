#include "planar_vslam/io/consistency.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "support/support.h"

namespace planar_vslam::test {
namespace {

// Poses that err from a straight drive by `factor` times what their covariances say.
struct Drive {
  Trajectory estimate, truth;
  std::vector<StampedCovariance> covariances;
};

Drive MakeDrive(double factor) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d sigma(0.02, 0.03, 0.01);
  Drive drive;
  for (int k = 0; k < 2000; ++k) {
    const Timestamp stamp = Timestamp::FromSeconds(0.1 * k);
    const Rigid2 truth(0.05 * k, 0.0, 0.3 * k);
    Eigen::Vector3d error =
        factor * sigma.cwiseProduct(Eigen::Vector3d(normal(generator), normal(generator), normal(generator)));
    if (k == 0) error.setZero();
    drive.truth.push_back({stamp, Embed3(Rigid2(4.0, -3.0, 1.0) * truth)});
    drive.estimate.push_back({stamp, Embed3(truth * ExpSe2(-error))});
    drive.covariances.push_back({stamp, sigma.cwiseAbs2().asDiagonal()});
  }
  return drive;
}

TEST(Consistency, IsThreeForHonestCovariances) {
  const Drive drive = MakeDrive(1.0);
  const auto result = EvaluateConsistency(drive.estimate, drive.covariances, drive.truth);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->poses, 1999);
  EXPECT_NEAR(result->mean_nees, 3.0, 0.2);
  EXPECT_NEAR(result->within_95, 0.95, 0.015);
}

TEST(Consistency, GrowsWithTheSquareOfWhatCovariancesHide) {
  const Drive drive = MakeDrive(3.0);
  const auto result = EvaluateConsistency(drive.estimate, drive.covariances, drive.truth);
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->mean_nees, 27.0, 1.5);
  EXPECT_LT(result->within_95, 0.5);
}

TEST(Consistency, MapsThatWereAlignedBeforeAreLaidOnTheTruthByThat) {
  Drive drive = MakeDrive(1.0);
  drive.estimate.front().T_map_base = drive.estimate.front().T_map_base * Embed3(Rigid2(0.1, 0.0, 0.05));
  EXPECT_GT(EvaluateConsistency(drive.estimate, drive.covariances, drive.truth)->mean_nees, 100.0);
  const auto result =
      EvaluateConsistency(drive.estimate, drive.covariances, drive.truth, Embed3(Rigid2(4.0, -3.0, 1.0)));
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->poses, 2000);
  EXPECT_NEAR(result->mean_nees, 3.0, 0.2);
}

TEST(Consistency, NeedsACovarianceForEveryPose) {
  Drive drive = MakeDrive(1.0);
  drive.covariances.erase(drive.covariances.begin() + 7);
  const auto result = EvaluateConsistency(drive.estimate, drive.covariances, drive.truth);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("0.7"), std::string::npos) << result.error().message;
}

TEST(Covariances, AreReadAsTheyWereWritten) {
  const TemporaryFolder folder;
  const Drive drive = MakeDrive(1.0);
  ASSERT_TRUE(WriteCovariances(drive.covariances, folder.path() / "c.csv").ok());
  const auto read = ReadCovariances(folder.path() / "c.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), drive.covariances.size());
  EXPECT_EQ(read->back().stamp, drive.covariances.back().stamp);
  EXPECT_LT((read->back().covariance - drive.covariances.back().covariance).norm(), 1e-12);
}

TEST(Covariances, NameFileAndLineOfWhatIsWrong) {
  const TemporaryFolder folder;
  const std::string header = "t,xx,xy,xh,yy,yh,hh\n", good = "0.0,1,0,0,1,0,1\n";
  for (const std::string bad : {"1.0,1,0,0,1,0\n", "1.0,1,0,0,1,0,nan\n", "x,1,0,0,1,0,1\n", "0.0,1,0,0,1,0,1\n",
                                "1.0,-1,0,0,1,0,1\n", "1.0,1,0,0,0,0,1\n"}) {
    std::ofstream(folder.path() / "c.csv") << header << good << bad;
    const auto read = ReadCovariances(folder.path() / "c.csv");
    ASSERT_FALSE(read.ok()) << bad;
    EXPECT_NE(read.error().message.find("c.csv:3"), std::string::npos) << read.error().message;
  }
  EXPECT_FALSE(ReadCovariances(folder.path() / "absent.csv").ok());
}

}  // namespace
}  // namespace planar_vslam::test
