#include "planar_vslam/map/predicted_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support/random_map.h"

namespace planar_vslam {
namespace {

class PredictedViewTest : public ::testing::Test {
 protected:
  PredictedViewTest() {
    camera_.width = 640;
    camera_.height = 480;
    camera_.fx = camera_.fy = 500.0;
    camera_.cx = 320.0;
    camera_.cy = 240.0;
    landmark_.view_direction = Eigen::Vector3d::UnitZ();
    landmark_.max_distance = 6.0;
    landmark_.min_distance = landmark_.max_distance / scales_.back();
  }
  bool Predict(const Eigen::Vector3d& p_camera) {
    landmark_.p_map = p_camera;
    return PredictView(landmark_, Rigid3(), camera_, scales_, &view_);
  }

  CameraModel camera_;
  std::vector<double> scales_ = test::OctaveScales();
  Landmark landmark_;
  PredictedView view_;
};

TEST_F(PredictedViewTest, OctaveGrowsWithTheLogarithmOfHowNearTheLandmarkIs) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> depth(1.4, 7.4);
  for (int i = 0; i < 1000; ++i) {
    const double distance = depth(generator);
    ASSERT_TRUE(Predict({0.0, 0.0, distance})) << distance;
    const int octave = static_cast<int>(std::ceil(std::log(6.0 / distance) / std::log(1.2)));
    EXPECT_EQ(view_.octave, std::clamp(octave, 0, 7)) << distance;
  }
}

TEST_F(PredictedViewTest, ALandmarkAtTheDistanceOfAnOctaveIsInThatOctave) {
  for (std::size_t k = 0; k < scales_.size(); ++k) {
    ASSERT_TRUE(Predict({0.0, 0.0, 6.0 / scales_[k]}));
    EXPECT_EQ(view_.octave, static_cast<int>(k));
  }
}

TEST_F(PredictedViewTest, NothingIsSeenBehindBesideTooFarOrTooNear) {
  EXPECT_TRUE(Predict({0.5, 0.0, 3.0}));
  EXPECT_NEAR(view_.pixel.x(), 320.0F + 500.0F * 0.5F / 3.0F, 1e-3F);
  EXPECT_FALSE(Predict({0.0, 0.0, -3.0}));
  EXPECT_FALSE(Predict({3.0, 0.0, 3.0}));
  EXPECT_FALSE(Predict({0.0, 0.0, 8.0}));
  EXPECT_FALSE(Predict({0.0, 0.0, 1.0}));
  landmark_.view_direction = Eigen::Vector3d::UnitX();
  EXPECT_FALSE(Predict({0.0, 0.0, 3.0}));
}

}  // namespace
}  // namespace planar_vslam
