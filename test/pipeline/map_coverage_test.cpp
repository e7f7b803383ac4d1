#include "planar_vslam/pipeline/map_coverage.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

// Keyframes along y = 0 for 2 m, cameras looking to the robot's left at points 2.5 m and more away.
class Coverage : public ::testing::Test {
 protected:
  Coverage() {
    test::SyntheticWorldOptions options;
    options.points = 900;
    world_ = test::MakeSyntheticWorld(options);
    grid_.width = 80;
    grid_.height = 60;
    grid_.origin = Eigen::Vector2d(-1.0, -2.5);
    grid_.cells.assign(static_cast<std::size_t>(grid_.width) * static_cast<std::size_t>(grid_.height), 0);
  }
  // Occupied along x at so many metres.
  void AddWall(double y) {
    const int row = static_cast<int>((y - grid_.origin.y()) / grid_.resolution);
    const auto begin = grid_.cells.begin() + static_cast<std::ptrdiff_t>(row) * grid_.width;
    std::fill(begin, begin + grid_.width, std::int8_t{100});
  }
  MapCoverage Make() const { return CoverageOf(world_.map, world_.camera, grid_); }
  // Landmarks in view from the place nearest to (1, y), robot along x.
  int InViewFrom(double y) const {
    const MapCoverage coverage = Make();
    const Eigen::Vector2d wanted(1.0, y);
    const auto nearest = std::min_element(
        coverage.places.begin(), coverage.places.end(),
        [&](const auto& a, const auto& b) { return (a.p_map - wanted).norm() < (b.p_map - wanted).norm(); });
    return nearest->in_view[0];
  }

  test::SyntheticWorld world_;
  OccupancyGrid2d grid_;
};

TEST_F(Coverage, TellsHeadingsThatSeeTheMapFromThoseThatDoNot) {
  const MapCoverage coverage = Make();
  EXPECT_EQ(coverage.places.size(), 48u);  // 4 m x 3 m
  const auto shares = coverage.ByHeading();
  EXPECT_GT(shares[0], 0.5);  // the camera looks at the points
  EXPECT_EQ(shares[4], 0.0);  // ...and away from them
  double sum = 0.0;
  for (const double share : shares) sum += share / MapCoverage::kHeadings;
  EXPECT_NEAR(coverage.Share(), sum, 1e-9);
  EXPECT_GE(coverage.ShareOfPlaces(1), shares[0] - 1e-9);
  EXPECT_EQ(coverage.ShareOfPlaces(MapCoverage::kHeadings), 0.0);
}

TEST_F(Coverage, AWallHidesWhatIsBehindItUnlessACameraSawItFromThere) {
  const int behind = InViewFrom(-1.75), beside = InViewFrom(0.25);
  ASSERT_GT(behind, 10);
  AddWall(-1.2);
  EXPECT_LT(InViewFrom(-1.75), behind / 4);
  EXPECT_EQ(InViewFrom(0.25), beside);
}

TEST_F(Coverage, NobodyStandsInObstaclesOrUnknownSpace) {
  std::fill(grid_.cells.begin(), grid_.cells.end(), std::int8_t{-1});
  EXPECT_TRUE(Make().places.empty());
  EXPECT_EQ(Make().Share(), 0.0);
  std::fill(grid_.cells.begin(), grid_.cells.end(), std::int8_t{0});
  const std::size_t free = Make().places.size();
  AddWall(0.25);
  EXPECT_LT(Make().places.size(), free);
  EXPECT_TRUE(CoverageOf(Map{}, world_.camera, grid_).places.empty());
}

}  // namespace
}  // namespace planar_vslam
