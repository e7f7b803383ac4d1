// What becomes of the sweeps of keyframes that are erased.
#include <gtest/gtest.h>

#include "support/random_map.h"

namespace planar_vslam::test {
namespace {

class Sweeps : public testing::Test {
 protected:
  Sweeps() { map_.octave_scales = OctaveScales(); }

  LaserSweep TakenAt(double seconds, double x) {
    LaserSweep sweep = RandomSweep(generator_);
    auto scan = std::make_shared<PlanarScan>(*sweep.scan);
    scan->stamp = Timestamp::FromSeconds(seconds);
    sweep.scan = scan;
    sweep.T_keyframe_base = Rigid2(x, 0.0, 0.0);
    return sweep;
  }
  // One that holds sweeps of these times, the first of them 0.5 m away from the others.
  void AddKeyframeAt(double x, const std::vector<double>& seconds) {
    Keyframe keyframe = RandomKeyframe(generator_, 4);
    keyframe.T_map_base = Embed3(Rigid2(x, 0.0, 0.0));
    keyframe.sweeps.clear();
    for (const double s : seconds) keyframe.sweeps.push_back(TakenAt(s, keyframe.sweeps.empty() ? 0.5 : 0.0));
    map_ = Apply(std::move(map_), {AddKeyframe{K(map_.next_keyframe_id), keyframe}});
  }
  void Erase(std::uint32_t id) { map_ = Apply(std::move(map_), {EraseKeyframe{K(id)}}); }
  std::vector<double> SecondsOf(std::uint32_t id) const {
    std::vector<double> seconds;
    for (const LaserSweep& sweep : map_.keyframes.At(K(id)).sweeps) {
      seconds.push_back(SecondsBetween(Timestamp::FromSeconds(0.0), sweep.scan->stamp));
    }
    return seconds;
  }

  std::mt19937 generator_{5};
  Map map_;
};

TEST_F(Sweeps, OfOneVisitAllStay) {
  AddKeyframeAt(0.0, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  AddKeyframeAt(0.0, {10, 11, 12, 13});
  Erase(1);
  EXPECT_EQ(SecondsOf(0), (std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}));
}

TEST_F(Sweeps, OfEarlierVisitsTheOldestGoButForTheFirstOfAKeyframe) {
  AddKeyframeAt(0.0, {0, 1, 2, 3, 4, 5, 6, 7});
  AddKeyframeAt(0.0, {100, 101, 102});
  Erase(1);
  EXPECT_EQ(SecondsOf(0), (std::vector<double>{0, 3, 4, 5, 6, 7, 100, 101, 102}));
}

TEST_F(Sweeps, ThatAreTheOldestThemselvesGo) {
  AddKeyframeAt(0.0, {-100, -99, -98});
  AddKeyframeAt(0.0, {0, 1, 2, 3, 4, 5, 6});
  Erase(0);
  EXPECT_EQ(SecondsOf(1), (std::vector<double>{0, 1, 2, 3, 4, 5, 6, -100}));
}

TEST_F(Sweeps, GoToTheNearestKeyframeWhereTheOneBeforeIsFar) {
  AddKeyframeAt(0.0, {0});
  AddKeyframeAt(9.0, {1});
  AddKeyframeAt(1.5, {2});
  AddKeyframeAt(0.4, {3});
  Erase(2);
  EXPECT_EQ(SecondsOf(1), std::vector<double>{1});
  EXPECT_EQ(SecondsOf(3), (std::vector<double>{3, 2}));
}

}  // namespace
}  // namespace planar_vslam::test
