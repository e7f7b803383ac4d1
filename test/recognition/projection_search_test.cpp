#include "planar_vslam/recognition/projection_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "planar_vslam/map/map_edit.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr double kBetweenKeyframes = 0.6;  // m along the path: keyframes stand at 0.5 and 0.75

class ProjectionSearchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    world_ = test::MakeSyntheticWorld({});
    T_map_camera_ = test::SyntheticPose(kBetweenKeyframes) * world_.T_base_camera;
    view_ = test::Observe(world_, T_map_camera_, 0.3, 1);
    for (const auto& [id, landmark] : world_.map.landmarks) all_.push_back(id);
    options_.radius = 12.0;
  }
  FrameMatches Search(const Rigid3& T_map_camera, FrameMatches matches = {}) const {
    SearchByProjection(world_.map, all_, T_map_camera, world_.camera, *view_.features, options_, &matches);
    return matches;
  }
  int Right(const FrameMatches& matches) const {
    int right = 0;
    for (std::size_t i = 0; i < matches.landmarks.size(); ++i) {
      right += matches.landmarks[i].valid() && matches.landmarks[i] == view_.landmarks[i] ? 1 : 0;
    }
    return right;
  }

  test::SyntheticWorld world_;
  test::SyntheticView view_;
  Rigid3 T_map_camera_;
  std::vector<LandmarkId> all_;
  ProjectionSearchOptions options_;
};

TEST_F(ProjectionSearchTest, FindsTheRightKeypointsFromASlightlyWrongPose) {
  Vector6d off;
  off << 0.015, -0.01, 0.02, 0.002, -0.004, 0.003;
  const FrameMatches matches = Search(T_map_camera_ * ExpSe3(off));
  EXPECT_EQ(Right(matches), matches.count);
  EXPECT_GT(matches.count, static_cast<int>(0.95 * static_cast<double>(view_.landmarks.size())));
}

TEST_F(ProjectionSearchTest, FindsNothingWhereThePoseIsFarOff) {
  const FrameMatches matches =
      Search(T_map_camera_ * Rigid3(ExpSo3(Eigen::Vector3d(0.0, 0.2, 0.0)), Eigen::Vector3d::Zero()));
  EXPECT_LT(matches.count, 5);
}

TEST_F(ProjectionSearchTest, IsOneToOneAndCountsWhatItMatched) {
  // A second keyframe in the place of the first, with landmarks of its own at the same corners: every keypoint there is
  // wanted twice.
  const KeyframeId twin{world_.map.next_keyframe_id};
  Keyframe keyframe = world_.map.keyframes.At(KeyframeId{0});
  const std::vector<LandmarkId> originals = keyframe.landmarks;
  std::fill(keyframe.landmarks.begin(), keyframe.landmarks.end(), LandmarkId{});
  MapEdit edit{AddKeyframe{twin, keyframe}};
  std::uint32_t next = world_.map.next_landmark_id;
  for (std::uint32_t i = 0; i < originals.size(); ++i) {
    if (!originals[i].valid()) continue;
    Landmark landmark;
    landmark.p_map = world_.map.landmarks.At(originals[i]).p_map;
    landmark.created_by = twin;
    landmark.observations = {{twin, i}};
    edit.emplace_back(AddLandmark{LandmarkId{next++}, landmark});
  }
  world_.map = Apply(world_.map, edit);
  ASSERT_GT(world_.map.landmarks.size(), all_.size());
  all_.clear();
  for (const auto& [id, landmark] : world_.map.landmarks) all_.push_back(id);

  const FrameMatches matches = Search(T_map_camera_);
  std::set<LandmarkId> seen;
  int count = 0;
  for (const LandmarkId id : matches.landmarks) {
    if (!id.valid()) continue;
    ++count;
    EXPECT_TRUE(seen.insert(id).second) << "landmark " << id.value << " matched twice";
  }
  EXPECT_EQ(matches.count, count);
  EXPECT_EQ(matches.landmarks.size(), view_.features->keypoints.size());
}

TEST_F(ProjectionSearchTest, LeavesMatchedKeypointsAndLandmarksAlone) {
  FrameMatches before;
  before.landmarks.resize(view_.landmarks.size());
  before.landmarks[0] = view_.landmarks[5];  // wrong on purpose
  before.count = 1;
  const FrameMatches matches = Search(T_map_camera_, before);
  EXPECT_EQ(matches.landmarks[0], view_.landmarks[5]);
  EXPECT_FALSE(matches.landmarks[5].valid());
  EXPECT_EQ(Right(matches), matches.count - 1);
}

TEST_F(ProjectionSearchTest, PassesOverLandmarksThatNoLongerExist) {
  const LandmarkId gone = view_.landmarks[3];
  world_.map = Apply(world_.map, {EraseLandmarks{{gone}}});
  const FrameMatches matches = Search(T_map_camera_);
  EXPECT_FALSE(matches.landmarks[3].valid());
  EXPECT_EQ(std::count(matches.visible.begin(), matches.visible.end(), gone), 0);
}

TEST_F(ProjectionSearchTest, NamesTheLandmarksThatShouldBeSeen) {
  const FrameMatches matches = Search(T_map_camera_);
  std::set<LandmarkId> visible(matches.visible.begin(), matches.visible.end());
  EXPECT_EQ(visible.size(), matches.visible.size());
  for (const LandmarkId id : matches.landmarks) EXPECT_TRUE(!id.valid() || visible.count(id) == 1);
  const Rigid3 looking_back = T_map_camera_ * Rigid3(ExpSo3(Eigen::Vector3d(0.0, M_PI, 0.0)), Eigen::Vector3d::Zero());
  EXPECT_TRUE(Search(looking_back).visible.empty());
}

TEST_F(ProjectionSearchTest, WantsDescriptorsToAgree) {
  auto features = std::make_shared<FrameFeatures>(*view_.features);
  features->descriptors[7][0] = ~features->descriptors[7][0];
  features->descriptors[7][1] = ~features->descriptors[7][1];  // 128 bits
  view_.features = features;
  EXPECT_FALSE(Search(T_map_camera_).landmarks[7].valid());
}

}  // namespace
}  // namespace planar_vslam
