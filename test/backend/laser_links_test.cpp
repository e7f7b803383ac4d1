// Keyframes in a room, linked by matching their laser sweeps.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "stages.h"

namespace planar_vslam {
namespace {

const Rigid3 kT_base_laser(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0.0, 0.25));

enum class Place { kRoom, kOtherRoom };

// Range from inside a rectangle with a pillar, so that no two of its places look alike.
float RangeTo(const Eigen::Vector2d& from, double angle, Place place) {
  const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
  double nearest = std::numeric_limits<double>::infinity();
  const auto wall = [&](int axis, double at, double low, double high) {
    if (std::abs(ray[axis]) < 1e-9) return;
    const double range = (at - from[axis]) / ray[axis];
    const double other = from[1 - axis] + range * ray[1 - axis];
    if (range > 0.0 && other >= low && other <= high) nearest = std::min(nearest, range);
  };
  const auto box = [&](double x0, double x1, double y0, double y1) {
    for (const double x : {x0, x1}) wall(0, x, y0, y1);
    for (const double y : {y0, y1}) wall(1, y, x0, x1);
  };
  if (place == Place::kOtherRoom) {
    box(-1.2, 7.0, -4.5, 1.6);
  } else {
    box(-3.0, 4.0, -2.0, 3.0);
    box(1.0, 1.6, 1.2, 1.7);
  }
  return static_cast<float>(nearest);
}

LaserSweep SweepAt(const Rigid2& T_room_base, Place place) {
  auto scan = std::make_shared<PlanarScan>();
  scan->angle_min = -0.75 * M_PI;
  scan->angle_increment = 1.5 * M_PI / 540.0;
  scan->range_max = 12.0;
  const Rigid2 T_room_laser = T_room_base * ProjectToPlane(kT_base_laser);
  for (int beam = 0; beam <= 540; ++beam) {
    const double angle = T_room_laser.angle + scan->angle_min + beam * scan->angle_increment;
    scan->ranges.push_back(RangeTo(T_room_laser.translation, angle, place));
  }
  return {scan, kT_base_laser, Rigid2()};
}

class LinkByLaserTest : public ::testing::Test {
 protected:
  LinkByLaserTest() {
    map_.metric = true;
    map_.octave_scales = {1.0};
  }
  // Where the map has it differs from where it is by `error`.
  KeyframeId Add(const Rigid2& T_room_base, const Rigid2& error = {}, Place place = Place::kRoom) {
    const KeyframeId id{map_.next_keyframe_id};
    Keyframe keyframe;
    keyframe.stamp = Timestamp::FromSeconds(id.value);
    keyframe.T_map_base = Embed3(T_room_base * error);
    keyframe.features = std::make_shared<const FrameFeatures>();
    keyframe.sweeps = {SweepAt(T_room_base, place)};
    map_ = Apply(std::move(map_), {AddKeyframe{id, keyframe}});
    return id;
  }
  std::vector<MotionLink> Links(KeyframeId newest) const {
    return Apply(map_, LinkByLaser(map_, newest, options_)).keyframes.At(newest).laser_links;
  }

  Map map_;
  ScanMatchOptions options_;
};

TEST_F(LinkByLaserTest, LinksToTheKeyframeBeforeAndToTheOldestThatStoodNear) {
  const std::vector<Rigid2> poses = {Rigid2(-1.5, 0.0, 0.0), Rigid2(0.0, 0.0, 0.1), Rigid2(0.4, 0.1, 0.2),
                                     Rigid2(0.8, 0.1, 0.3)};
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) Add(poses[k]);
  const KeyframeId newest = Add(poses.back(), Rigid2(0.05, -0.04, 0.02));
  const std::vector<MotionLink> links = Links(newest);
  ASSERT_EQ(links.size(), 2u);
  EXPECT_EQ(links[0].from, KeyframeId{1}) << "the first one stood too far off";
  EXPECT_EQ(links[1].from, KeyframeId{2});
  for (const MotionLink& link : links) {
    const Rigid2 truth = poses[link.from.value].Inverse() * poses.back();
    EXPECT_LT((link.motion.T_i_j.translation - truth.translation).norm(), 0.005) << link.from.value;
    EXPECT_NEAR(link.motion.T_i_j.angle, truth.angle, 0.003) << link.from.value;
    EXPECT_GT(link.motion.covariance.determinant(), 0.0);
    EXPECT_NEAR(link.motion.distance, truth.translation.norm(), 0.01);
    EXPECT_NEAR(link.motion.seconds, newest.value - link.from.value, 1e-9);
  }
}

TEST_F(LinkByLaserTest, OneKeyframeThatIsBothIsLinkedOnce) {
  Add(Rigid2(0.0, 0.0, 0.0));
  EXPECT_EQ(Links(Add(Rigid2(0.3, 0.0, 0.1))).size(), 1u);
}

TEST_F(LinkByLaserTest, TheKeyframeBeforeIsLinkedHoweverItTurned) {
  Add(Rigid2(0.0, 0.0, 0.0));
  const std::vector<MotionLink> links = Links(Add(Rigid2(0.1, 0.0, 1.3)));
  ASSERT_EQ(links.size(), 1u);
  EXPECT_NEAR(links[0].motion.T_i_j.angle, 1.3, 0.003);
}

TEST_F(LinkByLaserTest, NothingIsLinkedWithoutSweepsMetresOrTheOption) {
  Add(Rigid2(0.0, 0.0, 0.0));
  const KeyframeId newest = Add(Rigid2(0.3, 0.0, 0.1));
  ASSERT_EQ(Links(newest).size(), 1u);
  options_.enabled = false;
  EXPECT_TRUE(Links(newest).empty());
  options_.enabled = true;
  map_.metric = false;
  EXPECT_TRUE(Links(newest).empty());
  map_.metric = true;
  map_.keyframes.Edit(newest).sweeps.clear();
  EXPECT_TRUE(Links(newest).empty());
}

TEST_F(LinkByLaserTest, AMapThatBecomesMetricIsLinkedAsOneThatWas) {
  std::vector<KeyframeId> ids;
  for (const double x : {0.0, 0.3, 0.6, 0.9}) {
    ids.push_back(Add(Rigid2(x, 0.05 * x, 0.2 * x)));
    map_ = Apply(std::move(map_), LinkByLaser(map_, ids.back(), options_));
  }
  Map late = map_;
  for (const KeyframeId id : ids) late.keyframes.Edit(id).laser_links.clear();
  RebuildIndexes(&late);
  late = LinkedByLaser(std::move(late), options_);
  EXPECT_TRUE(Validate(late).empty());
  for (const KeyframeId id : ids) {
    const std::vector<MotionLink>& links = map_.keyframes.At(id).laser_links;
    const std::vector<MotionLink>& now = late.keyframes.At(id).laser_links;
    ASSERT_EQ(now.size(), links.size()) << id.value;
    for (std::size_t k = 0; k < links.size(); ++k) EXPECT_EQ(now[k].from, links[k].from) << id.value;
  }
}

TEST_F(LinkByLaserTest, SweepsThatShowAnotherRoomOrLieTooFarApartAreNotLinked) {
  Add(Rigid2(0.0, 0.0, 0.0));
  EXPECT_TRUE(Links(Add(Rigid2(0.3, 0.0, 0.1), Rigid2(), Place::kOtherRoom)).empty()) << "another room";
  EXPECT_TRUE(Links(Add(Rigid2(0.3, 0.0, 0.1), Rigid2(0.8, 0.8, 0.2))).empty()) << "the guess is too far off";
}

}  // namespace
}  // namespace planar_vslam
