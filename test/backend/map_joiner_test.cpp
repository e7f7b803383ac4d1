#include "planar_vslam/backend/map_joiner.h"

#include "map_testing.h"
#include "merge_testing.h"

namespace planar_vslam {
namespace {

const Rigid3 kElsewhere = Embed3(Rigid2(-3.0, 7.0, 2.2));

class MapJoinerTest : public test::MergeTest {
 protected:
  // Where the known map, which has the world as it is, has the keyframes of the growing one.
  std::vector<Meeting> MeetingsOf(const std::vector<Rigid3>& true_poses, std::size_t from = 0) const {
    std::vector<Meeting> meetings;
    for (std::size_t k = from; k < true_poses.size(); ++k)
      meetings.push_back({Timestamp::FromSeconds(static_cast<double>(k)), true_poses[k]});
    return meetings;
  }

  const std::vector<Rigid3> poses_ = Poses(1.1, 10);
  const std::shared_ptr<const Map> known_ = std::make_shared<const Map>(MapOf(Poses(0.0, 9)));
  const Map growing_ = RenumberedAbove(*known_, MapOf(poses_, kElsewhere, 70));
};

TEST_F(MapJoinerTest, JoinsOnceBothAgreeInPlacesApart) {
  MapJoiner joiner(known_, context_);
  const Map begun = RenumberedAbove(*known_, MapOf(Poses(1.1, 2), kElsewhere, 70));
  const auto early = joiner.Try(begun, MeetingsOf(Poses(1.1, 2)));
  ASSERT_TRUE(early.ok());
  EXPECT_FALSE(early->has_value()) << "one place alone";
  const auto joined = joiner.Try(growing_, MeetingsOf(poses_));
  ASSERT_TRUE(joined.ok()) << joined.error().message;
  ASSERT_TRUE(joined->has_value());
  const MapJunction& junction = **joined;
  EXPECT_EQ(Validate(*junction.map), std::vector<std::string>{});
  EXPECT_LT(LogSe3(junction.alignment.T_known_other * kElsewhere).norm(), 0.03);
  for (const auto& [id, keyframe] : growing_.keyframes) {
    const Rigid3& truth = poses_[id.value - known_->next_keyframe_id];
    EXPECT_LT(Distance(junction.map->keyframes.At(id).T_map_base, truth), 0.02) << id.value;
  }
}

TEST_F(MapJoinerTest, ItsCorrectionMakesTheSameOfBothMaps) {
  MapJoiner joiner(known_, context_);
  const auto joined = joiner.Try(growing_, MeetingsOf(poses_));
  ASSERT_TRUE(joined.ok() && joined->has_value());
  const Map rebased = Rebase(UnionOf(*known_, growing_), (*joined)->correction);
  test::ExpectSameMap(rebased, *(*joined)->map);
}

TEST_F(MapJoinerTest, AKeyframeThatIsMadeMeanwhileGoesAlong) {
  MapJoiner joiner(known_, context_);
  const auto joined = joiner.Try(growing_, MeetingsOf(poses_));
  ASSERT_TRUE(joined.ok() && joined->has_value());
  const Rigid3 truth = Poses(1.1, 11).back();
  const KeyframeId last = std::prev(growing_.keyframes.end())->first, added{growing_.next_keyframe_id};
  Keyframe keyframe = growing_.keyframes.At(last);
  keyframe.T_map_base = kElsewhere * truth;
  keyframe.odometry_link = MotionLink{last, test::ExactOdometry(world_, poses_.back(), truth)};
  keyframe.landmarks.assign(keyframe.landmarks.size(), LandmarkId());
  Landmark landmark;
  const Eigen::Vector3d p_world(2.0, 1.0, 0.5);
  landmark.p_map = kElsewhere * p_world;
  landmark.observations = {{added, 0}};
  landmark.created_by = added;
  const LandmarkId made{growing_.next_landmark_id};
  const Map now = Apply(growing_, {AddKeyframe{added, keyframe}, AddLandmark{made, landmark}});

  const Map rebased = Rebase(UnionOf(*known_, now), (*joined)->correction);
  EXPECT_EQ(Validate(rebased), std::vector<std::string>{});
  EXPECT_LT(Distance(rebased.keyframes.At(added).T_map_base, truth), 0.03);
  EXPECT_LT((rebased.landmarks.At(made).p_map - p_world).norm(), 0.03);
  EXPECT_EQ(rebased.keyframes.At(added).odometry_link->from, last);
}

TEST_F(MapJoinerTest, FindsPlacesByItselfWhereNobodyMeetsThem) {
  MapJoiner joiner(known_, context_);
  const auto joined = joiner.Try(growing_, {});
  ASSERT_TRUE(joined.ok());
  ASSERT_TRUE(joined->has_value());
  EXPECT_LT(LogSe3((*joined)->alignment.T_known_other * kElsewhere).norm(), 0.03);
}

TEST_F(MapJoinerTest, MapsOfTwoRoomsStayTwo) {
  test::SyntheticWorldOptions elsewhere;
  elsewhere.points = 600;
  elsewhere.seed = 9;
  MapJoiner joiner(known_, context_);
  const Map other = RenumberedAbove(*known_, test::MakeSyntheticWorld(elsewhere).map);
  const auto joined = joiner.Try(other, MeetingsOf(poses_));
  ASSERT_TRUE(joined.ok());
  EXPECT_FALSE(joined->has_value());
}

}  // namespace
}  // namespace planar_vslam
