// A robot that drives away from a mapped place without seeing much, and comes back to it with an error.
#include "planar_vslam/backend/loop_closing.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr SystematicErrors kSystematic{0.005, 0.0005};

// Adds keyframes, each linked by odometry to the one before.
class Driver {
 public:
  explicit Driver(const test::SyntheticWorld& world) : world_(world), map_(world.map) {}

  const Map& map() const { return map_; }
  KeyframeId newest() const { return std::prev(map_.keyframes.end())->first; }

  KeyframeId Add(const Rigid3& T_map_base, const Rigid2& by_wheels, FrameFeaturesPtr features) {
    const KeyframeId id{map_.next_keyframe_id};
    PlanarMotion step;
    step.T_i_j = by_wheels;
    step.covariance = IncrementCovariance(world_.odometry_noise, by_wheels);
    Keyframe keyframe;
    keyframe.stamp = Timestamp::FromSeconds(id.value);
    keyframe.T_map_base = T_map_base;
    keyframe.T_base_camera = world_.T_base_camera;
    keyframe.features = std::move(features);
    keyframe.landmarks.resize(keyframe.features->keypoints.size());
    keyframe.odometry_link = MotionLink{newest(), step};
    map_ = Apply(std::move(map_), {AddKeyframe{id, keyframe}});
    return id;
  }
  // Along the wheels' word.
  KeyframeId Drive(const Rigid2& step, FrameFeaturesPtr features) {
    return Add(map_.keyframes.At(newest()).T_map_base * Embed3(step), step, std::move(features));
  }
  // To a pose in the map that looks as the world does at `true_pose`, but for this share of what is to be seen.
  KeyframeId Stand(const Rigid3& T_map_base, const Rigid3& true_pose, double share) {
    const Rigid3 T_last_base = map_.keyframes.At(newest()).T_map_base.Inverse() * T_map_base;
    const auto seed = 50 + map_.next_keyframe_id;
    const FrameFeaturesPtr all = test::Observe(world_, true_pose * world_.T_base_camera, 0.3, seed).features;
    auto seen = std::make_shared<FrameFeatures>();
    const std::size_t count = all->keypoints.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (static_cast<double>(i) > share * static_cast<double>(count)) break;
      seen->keypoints.push_back(all->keypoints[i]);
      seen->descriptors.push_back(all->descriptors[i]);
    }
    seen->grid = ImageGrid(seen->keypoints);
    return Add(T_map_base, ProjectToPlane(T_last_base), seen);
  }
  // What the last `count` keyframes show, as landmarks of their own where those keyframes would have them.
  void MapAnew(std::size_t count, const Rigid3& T_map_true) {
    MapEdit edit;
    std::uint32_t next = map_.next_landmark_id;
    for (const auto& [id, original] : world_.map.landmarks) {
      Landmark landmark;
      landmark.p_map = T_map_true * world_.true_points[id.value];
      for (auto it = map_.keyframes.end() - static_cast<std::ptrdiff_t>(count); it != map_.keyframes.end(); ++it) {
        const std::vector<Descriptor>& seen = it->second.features->descriptors;
        const auto at = std::find(seen.begin(), seen.end(), original.descriptor);
        if (at != seen.end()) {
          landmark.observations.push_back({it->first, static_cast<std::uint32_t>(at - seen.begin())});
        }
      }
      if (landmark.observations.size() < 2) continue;
      landmark.created_by = landmark.observations.front().keyframe;
      edit.emplace_back(AddLandmark{LandmarkId{next++}, landmark});
    }
    map_ = Apply(std::move(map_), edit);
  }

 private:
  const test::SyntheticWorld& world_;
  Map map_;
};

class LoopTest : public ::testing::Test {
 protected:
  static constexpr int kViews = 3;

  LoopTest() {
    test::SyntheticWorldOptions options;
    options.points = 600;
    options.pixel_noise = 0.3;
    world_ = test::MakeSyntheticWorld(options);
    context_ = world_.Context();
  }

  static FrameFeaturesPtr Blank() { return std::make_shared<const FrameFeatures>(); }
  static Rigid3 TrueView(int k) { return test::SyntheticPose(0.3 + 0.25 * k); }

  // Eight metres out and back with nothing in view; back at the start of the world the map is off by `error`.
  Driver ComeBack(const Rigid3& error, double share = 1.0) const {
    Driver driver(world_);
    for (int k = 0; k < 8; ++k) driver.Drive(Rigid2(0.5, 0.0, 0.0), Blank());
    for (int k = 0; k < 8; ++k) driver.Drive(Rigid2(-0.5, 0.0, 0.0), Blank());
    for (int k = 0; k < kViews; ++k) driver.Stand(error * TrueView(k), TrueView(k), share);
    driver.MapAnew(kViews, error);
    return driver;
  }
  // Somebody takes the robot away in full view of the place; it drives eight metres and comes back from elsewhere.
  Driver ComeBackCarried(const Rigid3& error, KeyframeId* carried) const {
    Driver driver(world_);
    test::SyntheticWorldOptions elsewhere;
    elsewhere.points = 600;
    elsewhere.seed = 99;
    const test::SyntheticWorld other = test::MakeSyntheticWorld(elsewhere);
    *carried = driver.Drive(Rigid2(), test::Observe(other, other.T_base_camera, 0.0, 1).features);
    for (int k = 0; k < 16; ++k) driver.Drive(Rigid2(0.5, 0.0, 0.0), Blank());
    for (int k = 0; k < kViews; ++k) driver.Stand(error * TrueView(k), TrueView(k), 1.0);
    driver.MapAnew(kViews, error);
    return driver;
  }
  std::optional<Loop> Find(const Driver& driver, const LoopOptions& options = {}) const {
    const MapUncertainty uncertainty(driver.map(), TiesOf(driver.map(), context_), kSystematic);
    return FindLoop(driver.map(), driver.newest(), uncertainty, context_, options);
  }
  static double Distance(const Rigid3& a, const Rigid3& b) { return (a.translation - b.translation).norm(); }

  test::SyntheticWorld world_;
  MeasurementModel context_;
};

const Rigid3 kDrift = Embed3(Rigid2(0.12, -0.1, 0.03));
const Rigid3 kCarried = Embed3(Rigid2(3.0, -1.5, 0.9));

TEST_F(LoopTest, FindsTheOldPlaceAndWhereItIs) {
  const Driver driver = ComeBack(kDrift);
  const std::optional<Loop> loop = Find(driver);
  ASSERT_TRUE(loop.has_value());
  EXPECT_LT(loop->old.value, 8u);
  ASSERT_EQ(loop->views.size(), static_cast<std::size_t>(kViews));
  for (int k = 0; k < kViews; ++k) {
    const LoopView& view = loop->views[static_cast<std::size_t>(k)];
    EXPECT_EQ(view.keyframe.value, driver.newest().value - static_cast<std::uint32_t>(k));
    EXPECT_LT(Distance(view.T_map_base, TrueView(kViews - 1 - k)), 0.02);
    EXPECT_GT(view.matches.count, 30);
  }
}

TEST_F(LoopTest, ClosingItBringsTheKeyframesHomeAndMakesTwoLandmarksOne) {
  const Driver driver = ComeBack(kDrift);
  const std::optional<Map> closed = CloseLoop(driver.map(), *Find(driver), context_);
  ASSERT_TRUE(closed.has_value());
  EXPECT_EQ(Validate(*closed), std::vector<std::string>{});
  for (int k = 0; k < kViews; ++k) {
    const KeyframeId id{driver.newest().value - static_cast<std::uint32_t>(k)};
    EXPECT_LT(Distance(closed->keyframes.At(id).T_map_base, TrueView(kViews - 1 - k)), 0.03);
  }
  EXPECT_LT(closed->landmarks.size(), driver.map().landmarks.size() - 50);
  for (const auto& [id, keyframe] : world_.map.keyframes) {  // seen well: the old place stays where it is
    EXPECT_LT(Distance(closed->keyframes.At(id).T_map_base, keyframe.T_map_base), 0.01) << id.value;
  }
}

TEST_F(LoopTest, NothingIsFoundWhereTheMapCannotBeThatFarOff) {
  EXPECT_FALSE(Find(ComeBack(Embed3(Rigid2(2.5, 0.0, 0.3)))).has_value());
  const Driver driver = ComeBack(Embed3(Rigid2(0.3, -0.2, 0.03)));
  EXPECT_TRUE(Find(driver).has_value());
  LoopOptions trusting;
  trusting.sigma_factor = 0.1;
  EXPECT_FALSE(Find(driver, trusting).has_value());
}

TEST_F(LoopTest, NothingIsFoundWhereTooFewLandmarksAreSeen) {
  LoopOptions strict;
  strict.min_inliers = 10000;
  EXPECT_FALSE(Find(ComeBack(kDrift), strict).has_value());
}

TEST_F(LoopTest, APlaceThatShowsLittleOfWhatShouldBeInViewOnlyLooksAlike) {
  EXPECT_TRUE(Find(ComeBack(kDrift, 0.8)).has_value());
  EXPECT_FALSE(Find(ComeBack(kDrift, 0.2)).has_value());
}

TEST_F(LoopTest, NothingIsFoundWhenSwitchedOff) {
  LoopOptions off;
  off.enabled = false;
  EXPECT_FALSE(Find(ComeBack(kDrift), off).has_value());
}

TEST_F(LoopTest, OneViewAloneIsNotBelieved) {
  Driver driver(world_);
  for (int k = 0; k < 16; ++k) driver.Drive(Rigid2(k < 8 ? 0.5 : -0.5, 0.0, 0.0), Blank());
  driver.Stand(kDrift * TrueView(0), TrueView(0), 1.0);
  EXPECT_FALSE(Find(driver).has_value());
}

TEST_F(LoopTest, APlaceThatIsJoinedAlreadyIsNoLoop) {
  const Driver driver = ComeBack(kDrift);
  const std::optional<Map> closed = CloseLoop(driver.map(), *Find(driver), context_);
  const MapUncertainty uncertainty(*closed, TiesOf(*closed, context_), kSystematic);
  EXPECT_FALSE(FindLoop(*closed, driver.newest(), uncertainty, context_, {}).has_value());
}

TEST_F(LoopTest, ACarriedRobotFindsHomeAndItsWheelsAreNotBelieved) {
  KeyframeId carried;
  const Driver driver = ComeBackCarried(kCarried, &carried);
  const std::optional<Loop> loop = Find(driver);
  ASSERT_TRUE(loop.has_value());
  const std::optional<Map> closed = CloseLoop(driver.map(), *loop, context_);
  ASSERT_TRUE(closed.has_value());
  EXPECT_LT(Distance(closed->keyframes.At(driver.newest()).T_map_base, TrueView(kViews - 1)), 0.03);
  EXPECT_FALSE(closed->keyframes.At(carried).odometry_link.has_value());
  for (auto it = std::next(driver.map().keyframes.begin()); it != driver.map().keyframes.end(); ++it) {
    EXPECT_EQ(closed->keyframes.At(it->first).odometry_link.has_value(), it->first != carried) << it->first.value;
  }
  // What came after the carrying moved as one piece.
  const Rigid3 T_before = driver.map().keyframes.At(carried).T_map_base.Inverse() *
                          driver.map().keyframes.At(KeyframeId{carried.value + 8}).T_map_base;
  const Rigid3 T_after = closed->keyframes.At(carried).T_map_base.Inverse() *
                         closed->keyframes.At(KeyframeId{carried.value + 8}).T_map_base;
  EXPECT_LT(Distance(T_before, T_after), 0.01);
}

TEST(LoopOptions, NameWhatIsWrong) {
  EXPECT_TRUE(LoopOptions{}.Problems().empty());
  LoopOptions options;
  options.min_inliers = 3;
  options.min_share = 1.5;
  options.sigma_factor = 0.0;
  EXPECT_EQ(options.Problems().size(), 3u);
}

}  // namespace
}  // namespace planar_vslam
