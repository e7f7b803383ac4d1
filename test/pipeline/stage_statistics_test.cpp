#include "planar_vslam/pipeline/stage_statistics.h"

#include <gtest/gtest.h>

namespace planar_vslam {
namespace {

TEST(DurationHistogram, PercentilesAreGoodToAFewPercent) {
  DurationHistogram histogram;
  for (int i = 1; i <= 1000; ++i) histogram.Add(0.1 * i);
  EXPECT_EQ(histogram.count(), 1000);
  EXPECT_NEAR(histogram.sum(), 50'050.0, 1e-6);
  EXPECT_EQ(histogram.max(), 100.0);
  for (const double share : {0.1, 0.5, 0.9, 0.99}) {
    EXPECT_NEAR(histogram.Percentile(share), 100.0 * share, 0.03 * 100.0 * share) << share;
  }
}

TEST(DurationHistogram, TakesAnyDuration) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.Percentile(0.5), 0.0) << "of nothing";
  for (const double ms : {0.0, 1e-9, 1e9}) histogram.Add(ms);
  EXPECT_EQ(histogram.count(), 3);
  EXPECT_LE(histogram.Percentile(0.0), 0.0011);
  EXPECT_EQ(histogram.max(), 1e9);
}

TEST(StageStatistics, KeepsStagesApart) {
  StageStatistics statistics;
  statistics.Add(StageTimes{{"map.fuse", 2.0}, {"frame.track", 1.0}});
  statistics.Add(StageTimes{{"map.fuse", 4.0}});
  ASSERT_EQ(statistics.stages().size(), 2U);
  EXPECT_EQ(statistics.stages().at("map.fuse").sum(), 6.0);
  EXPECT_EQ(statistics.stages().at("frame.track").count(), 1);
}

}  // namespace
}  // namespace planar_vslam
