#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>

#include "planar_vslam/backend/map_keyframe.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr double kNewest = 2.0;  // m along the path: the keyframe after the last one of the world

class MapKeyframeTest : public ::testing::Test {
 protected:
  MapKeyframeTest() {
    test::SyntheticWorldOptions options;
    options.pixel_noise = 0.3;
    world_ = test::MakeSyntheticWorld(options);
    map_ = world_.map;
    context_.model = world_.Context();
    context_.options.redundancy = 1.0;  // no keyframe is culled unless a test asks for it
  }

  // The frame at kNewest with every landmark of the map it shows matched, and odometry from the last keyframe.
  KeyframeProposal Proposal(double pixel_noise = 0.3) const {
    const Rigid3 T_map_base = test::SyntheticPose(kNewest);
    test::SyntheticView view = test::Observe(world_, T_map_base * world_.T_base_camera, pixel_noise, 77);
    for (LandmarkId& id : view.landmarks) {
      if (!map_.landmarks.Contains(id)) id = LandmarkId{};
    }
    KeyframeProposal proposal;
    proposal.keyframe = {
        Timestamp::FromSeconds(10.0), T_map_base, world_.T_base_camera, view.features, view.landmarks, {}};
    proposal.odometry = test::ExactOdometry(world_, world_.true_poses.back(), T_map_base);
    return proposal;
  }
  // Landmark of the world with the same descriptor: what the landmark really shows.
  LandmarkId Original(const Landmark& landmark) const {
    for (const auto& [id, original] : world_.map.landmarks) {
      if (original.descriptor == landmark.descriptor) return id;
    }
    return LandmarkId{};
  }
  double PositionError(const Map& map, KeyframeId id) const {
    const Rigid3 truth =
        id.value < world_.true_poses.size() ? world_.true_poses[id.value] : test::SyntheticPose(kNewest);
    return (map.keyframes.At(id).T_map_base.translation - truth.translation).norm();
  }
  double MeanPositionError(const Map& map) const {
    double sum = 0.0;
    for (const auto& [id, keyframe] : map.keyframes) sum += PositionError(map, id);
    return sum / static_cast<double>(map.keyframes.size());
  }

  test::SyntheticWorld world_;
  Map map_;
  MapperContext context_;
};

TEST_F(MapKeyframeTest, AddsTheKeyframeWithMatchesAndOdometryLink) {
  const KeyframeProposal proposal = Proposal();
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_EQ(outcome.report.keyframe, KeyframeId{map_.next_keyframe_id});
  const Keyframe& added = outcome.map.keyframes.At(outcome.report.keyframe);
  EXPECT_EQ(added.stamp, proposal.keyframe.stamp);
  ASSERT_TRUE(added.odometry_link.has_value());
  EXPECT_EQ(added.odometry_link->from, KeyframeId{map_.next_keyframe_id - 1});
  const auto seen =
      std::count_if(added.landmarks.begin(), added.landmarks.end(), [](LandmarkId id) { return id.valid(); });
  EXPECT_GT(static_cast<double>(seen), 0.9 * static_cast<double>(proposal.keyframe.landmarks.size()));
  EXPECT_LT((added.T_map_base.translation - test::SyntheticPose(kNewest).translation).norm(), 0.01);
  EXPECT_TRUE(outcome.report.keyframes_culled.empty());
}

TEST_F(MapKeyframeTest, WithdrawsTheFloorFromKeyframesMadeSinceItWasLeft) {
  KeyframeProposal proposal = Proposal();
  proposal.keyframe.on_floor = false;
  const auto last = std::prev(map_.keyframes.end());
  proposal.off_floor_since = last->second.stamp;
  const Map mapped = MapKeyframe(map_, proposal, context_).map;
  for (const auto& [id, keyframe] : mapped.keyframes) EXPECT_EQ(keyframe.on_floor, id < last->first) << id.value;
}

TEST_F(MapKeyframeTest, LeavesTheFloorOfEarlierSessionsAloneWhateverTheirStamps) {
  KeyframeProposal proposal = Proposal();
  proposal.keyframe.on_floor = false;
  proposal.off_floor_since = map_.keyframes.begin()->second.stamp;  // by the clock of the present session
  proposal.session_begin = KeyframeId{map_.next_keyframe_id - 2};
  const Map mapped = MapKeyframe(map_, proposal, context_).map;
  for (const auto& [id, keyframe] : mapped.keyframes) {
    EXPECT_EQ(keyframe.on_floor, id < proposal.session_begin) << id.value;
  }
}

TEST_F(MapKeyframeTest, WorksWithoutOdometry) {
  map_ = test::Perturbed(world_, 0.01, 0.002, 0.02, 9);
  KeyframeProposal proposal = Proposal();
  proposal.odometry.reset();
  const double before = MeanPositionError(map_);
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_FALSE(outcome.map.keyframes.At(outcome.report.keyframe).odometry_link.has_value());
  EXPECT_TRUE(outcome.report.bundle.converged);
  EXPECT_LT(MeanPositionError(outcome.map), 0.5 * before);
  EXPECT_LT(PositionError(outcome.map, outcome.report.keyframe), 0.01) << "landmarks hold it";
}

TEST_F(MapKeyframeTest, AnAdjustmentThatFailsIsHeardAndChangesNothing) {
  KeyframeProposal proposal = Proposal();
  proposal.odometry->T_i_j.translation.x() = std::numeric_limits<double>::quiet_NaN();
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(outcome.report.bundle.failed());
  EXPECT_FALSE(outcome.report.bundle.message.empty());
  for (const auto& [id, keyframe] : map_.keyframes) {
    EXPECT_EQ(outcome.map.keyframes.At(id).T_map_base.translation, keyframe.T_map_base.translation) << id.value;
  }
  EXPECT_EQ(outcome.map.keyframes.At(outcome.report.keyframe).T_map_base.translation,
            proposal.keyframe.T_map_base.translation);
  EXPECT_FALSE(MapKeyframe(map_, Proposal(), context_).report.bundle.failed());
}

TEST_F(MapKeyframeTest, DropsMatchesToLandmarksThatAreGoneOrNamedTwice) {
  KeyframeProposal proposal = Proposal();
  std::vector<LandmarkId>& landmarks = proposal.keyframe.landmarks;
  ASSERT_TRUE(landmarks[0].valid() && landmarks[1].valid());
  landmarks[0] = LandmarkId{map_.next_landmark_id + 500};
  landmarks[2] = landmarks[1];
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_FALSE(outcome.map.landmarks.Contains(LandmarkId{map_.next_landmark_id + 500}));
}

TEST_F(MapKeyframeTest, TriangulatesNewLandmarksNearTheTruth) {
  EraseLandmarks erase;
  for (const auto& [id, landmark] : map_.landmarks) {
    if (id.value % 2 == 0) erase.ids.push_back(id);
  }
  map_ = Apply(std::move(map_), {erase});
  const std::uint32_t first_new = map_.next_landmark_id;
  const MappingOutcome outcome = MapKeyframe(map_, Proposal(), context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_GT(outcome.report.triangulated, 50);
  std::vector<double> errors;
  for (const auto& [id, landmark] : outcome.map.landmarks) {
    if (id.value < first_new) continue;
    const LandmarkId original = Original(landmark);
    ASSERT_TRUE(original.valid());
    EXPECT_EQ(landmark.created_by, outcome.report.keyframe);
    errors.push_back((landmark.p_map - world_.true_points[original.value]).norm());
  }
  ASSERT_GT(errors.size(), 50U);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  EXPECT_LT(errors.back(), 0.5);
}

TEST_F(MapKeyframeTest, TriangulatesNothingWithoutABaseline) {
  EraseLandmarks erase;
  for (const auto& [id, landmark] : map_.landmarks) {
    if (id.value % 2 == 0) erase.ids.push_back(id);
  }
  map_ = Apply(std::move(map_), {erase});
  // All keyframes but the last go, and the new one stands where the last one does.
  MapEdit edit;
  for (std::uint32_t k = 1; k + 1 < map_.next_keyframe_id; ++k) edit.emplace_back(EraseKeyframe{KeyframeId{k}});
  edit.emplace_back(EraseKeyframe{KeyframeId{0}});
  map_ = Apply(std::move(map_), edit);
  KeyframeProposal proposal = Proposal();
  const Keyframe& last = map_.keyframes.begin()->second;
  proposal.keyframe = last;
  proposal.keyframe.odometry_link.reset();
  proposal.odometry = test::ExactOdometry(world_, last.T_map_base, last.T_map_base);
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_EQ(outcome.report.triangulated, 0);
}

TEST_F(MapKeyframeTest, FusesDuplicates) {
  // Every third landmark split in two: the later half of its keyframes see a landmark of their own.
  MapEdit edit;
  std::uint32_t next = map_.next_landmark_id;
  std::size_t split = 0;
  for (const auto& [id, landmark] : map_.landmarks) {
    const std::size_t n = landmark.observations.size();
    if (id.value % 3 != 0 || n < 6) continue;
    Landmark twin;
    twin.p_map = landmark.p_map + Eigen::Vector3d(0.002, 0.002, -0.002);
    twin.observations.assign(landmark.observations.begin() + static_cast<std::ptrdiff_t>(n / 2),
                             landmark.observations.end());
    twin.created_by = KeyframeId{0};
    for (const Observation& o : twin.observations) edit.emplace_back(EraseObservation{id, o.keyframe});
    edit.emplace_back(AddLandmark{LandmarkId{next++}, twin});
    ++split;
  }
  map_ = Apply(std::move(map_), edit);
  ASSERT_TRUE(Validate(map_).empty());
  ASSERT_GT(split, 20U);
  const auto duplicates = [this](const Map& map) {
    std::map<LandmarkId, int> shown;
    for (const auto& [id, landmark] : map.landmarks) ++shown[Original(landmark)];
    return std::count_if(shown.begin(), shown.end(), [](const auto& e) { return e.second > 1; });
  };
  ASSERT_EQ(duplicates(map_), static_cast<std::ptrdiff_t>(split));
  const MappingOutcome outcome = MapKeyframe(map_, Proposal(), context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_GE(outcome.report.fused, static_cast<int>(split) / 2);
  EXPECT_LE(duplicates(outcome.map), static_cast<std::ptrdiff_t>(split / 10));
}

TEST_F(MapKeyframeTest, LocalBundleAdjustmentPullsAPerturbedMapToTheTruth) {
  map_ = test::Perturbed(world_, 0.01, 0.002, 0.02, 9);
  KeyframeProposal proposal = Proposal();
  proposal.keyframe.T_map_base.translation += Eigen::Vector3d(0.02, -0.02, 0.01);
  const double before = MeanPositionError(map_);
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  ASSERT_TRUE(outcome.report.bundle.converged) << outcome.report.bundle.message;
  EXPECT_LT(outcome.report.bundle.final_cost, 0.2 * outcome.report.bundle.initial_cost);
  EXPECT_LT(MeanPositionError(outcome.map), 0.5 * before);
  const Rigid3& first = outcome.map.keyframes.begin()->second.T_map_base;
  const Rigid2 off = ProjectToPlane(world_.true_poses[0]).Inverse() * ProjectToPlane(first);
  EXPECT_LT(LogSe2(off).norm(), 1e-6) << "the first keyframe holds the map frame";
}

TEST_F(MapKeyframeTest, NowAndThenAdjustsAWideWindow) {
  context_.options.young_map = 0;
  context_.options.window = 2;
  context_.options.link_neighbors = 1;
  const auto moved = [this](int every) {
    context_.options.wide_every = every;
    const Map mapped = MapKeyframe(map_, Proposal(), context_).map;
    return std::count_if(mapped.keyframes.begin(), mapped.keyframes.end(), [this](const auto& entry) {
      const Keyframe* before = map_.keyframes.Find(entry.first);
      return before != nullptr && before->T_map_base.translation != entry.second.T_map_base.translation;
    });
  };
  constexpr int kNever = 1000;  // the map has fewer keyframes
  EXPECT_GT(moved(1), moved(kNever));
  // That takes drift out which a narrow window holds fixed at its border.
  map_ = test::Perturbed(world_, 0.02, 0.002, 0.02, 9);
  const auto error = [this](int every) {
    context_.options.wide_every = every;
    return MeanPositionError(MapKeyframe(map_, Proposal(), context_).map);
  };
  EXPECT_LT(error(1), 0.5 * error(kNever));
}

TEST_F(MapKeyframeTest, CullsARedundantKeyframeAndBridgesItsOdometry) {
  context_.options.redundancy = 0.9;
  const MappingOutcome outcome = MapKeyframe(map_, Proposal(), context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  ASSERT_EQ(outcome.report.keyframes_culled.size(), 1U) << "the world's keyframes all see the same";
  const CulledKeyframe& culled = outcome.report.keyframes_culled[0];
  EXPECT_FALSE(outcome.map.keyframes.Contains(culled.id));
  EXPECT_NE(culled.id, KeyframeId{0}) << "the first keyframe defines the map frame";
  EXPECT_NE(culled.id, outcome.report.keyframe);
  EXPECT_EQ(culled.before.id, KeyframeId{culled.id.value - 1});
  EXPECT_EQ(culled.after.id, KeyframeId{culled.id.value + 1});
  for (const CulledKeyframe::Neighbor& beside : {culled.before, culled.after}) {
    const Rigid3 T_map_culled = outcome.map.keyframes.At(beside.id).T_map_base * beside.T_neighbor_culled;
    EXPECT_LT((T_map_culled.translation - world_.true_poses[culled.id.value].translation).norm(), 0.01);
  }
  const Keyframe& later = outcome.map.keyframes.At(KeyframeId{culled.id.value + 1});
  ASSERT_TRUE(later.odometry_link.has_value());
  EXPECT_EQ(later.odometry_link->from, KeyframeId{culled.id.value - 1});
  const Rigid2 truth =
      ProjectToPlane(world_.true_poses[culled.id.value - 1].Inverse() * world_.true_poses[culled.id.value + 1]);
  EXPECT_LT((later.odometry_link->motion.T_i_j.translation - truth.translation).norm(), 1e-9);
  EXPECT_NEAR(later.odometry_link->motion.T_i_j.angle, truth.angle, 1e-9);
}

TEST_F(MapKeyframeTest, KeepsKeyframesThatSeeWhatNoOtherDoes) {
  context_.options.redundancy = 0.9;
  // A fifth of what each keyframe sees belongs to it and one neighbour alone: odd landmarks go to one pair of
  // keyframes.
  MapEdit edit;
  for (const auto& [id, landmark] : map_.landmarks) {
    if (id.value % 2 == 0) continue;
    const std::uint32_t pair = (id.value / 2) % 4;
    for (const Observation& o : landmark.observations) {
      if (o.keyframe.value / 2 != pair) edit.emplace_back(EraseObservation{id, o.keyframe});
    }
  }
  map_ = Apply(std::move(map_), edit);
  KeyframeProposal proposal = Proposal();
  for (LandmarkId& id : proposal.keyframe.landmarks) {
    if (id.valid() && id.value % 2 == 1) id = LandmarkId{};
  }
  context_.options.fusion_radius = 1e-3;  // nothing is found again
  context_.options.max_descriptor_distance = -1;
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_TRUE(outcome.report.keyframes_culled.empty());
}

TEST_F(MapKeyframeTest, ErasesRecentLandmarksThatAreRarelyFound) {
  const LandmarkId doubtful{map_.next_landmark_id};
  Landmark landmark;
  landmark.p_map = Eigen::Vector3d(1.5, 3.0, 1.0);
  // Two keypoints that show nothing else: free two of an existing landmark.
  const LandmarkId donor = map_.landmarks.begin()->first;
  const std::vector<Observation> free = map_.landmarks.At(donor).observations;
  ASSERT_GE(free.size(), 4U);
  MapEdit edit;
  for (std::size_t i = free.size() - 2; i < free.size(); ++i) {
    edit.emplace_back(EraseObservation{donor, free[i].keyframe});
    landmark.observations.push_back(free[i]);
  }
  landmark.created_by = KeyframeId{map_.next_keyframe_id - 1};
  edit.emplace_back(AddLandmark{doubtful, landmark});
  map_ = Apply(std::move(map_), edit);
  KeyframeProposal proposal = Proposal();
  proposal.sightings.predicted_visible.assign(20, doubtful);
  proposal.sightings.found.assign(2, doubtful);
  const MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
  EXPECT_TRUE(Validate(outcome.map).empty());
  EXPECT_FALSE(outcome.map.landmarks.Contains(doubtful));
  EXPECT_GE(outcome.report.landmarks_culled, 1);
}

TEST_F(MapKeyframeTest, TellsTheTimeOfEveryStage) {
  const MappingReport report = MapKeyframe(map_, Proposal(), context_).report;
  std::vector<std::string> stages;
  for (const StageTime& t : report.times) {
    EXPECT_GE(t.ms, 0.0) << t.stage;
    stages.emplace_back(t.stage);
  }
  EXPECT_EQ(stages, (std::vector<std::string>{"map.copy", "map.arrival", "map.laser_links", "map.cull_landmarks",
                                              "map.triangulate", "map.fuse", "map.bundle", "map.cull_keyframes"}));
  double bundle = 0.0;
  for (const StageTime& t : report.bundle.times) bundle += t.ms;
  EXPECT_GT(bundle, 0.0);
  EXPECT_LE(bundle, report.times[6].ms) << "its stages are parts of it";
}

TEST_F(MapKeyframeTest, GivesTheSameMapEveryTime) {
  map_ = test::Perturbed(world_, 0.01, 0.002, 0.02, 10);
  const MappingOutcome a = MapKeyframe(map_, Proposal(), context_), b = MapKeyframe(map_, Proposal(), context_);
  ASSERT_EQ(a.map.landmarks.size(), b.map.landmarks.size());
  for (const auto& [id, landmark] : a.map.landmarks) EXPECT_EQ(landmark.p_map, b.map.landmarks.At(id).p_map);
  for (const auto& [id, keyframe] : a.map.keyframes) {
    EXPECT_EQ(keyframe.T_map_base.translation, b.map.keyframes.At(id).T_map_base.translation);
    EXPECT_EQ(keyframe.landmarks, b.map.keyframes.At(id).landmarks);
  }
}

TEST_F(MapKeyframeTest, AManyKeyframeDriveStaysSoundAndAccurate) {
  // Keyframe after keyframe from the first two of the world on, each with the matches the map offers by then.
  context_.options.redundancy = 0.9;
  MapEdit edit;
  for (std::uint32_t k = 2; k < map_.next_keyframe_id; ++k) edit.emplace_back(EraseKeyframe{KeyframeId{k}});
  map_ = Apply(std::move(map_), edit);
  std::map<KeyframeId, double> at = {{KeyframeId{0}, 0.0}, {KeyframeId{1}, 0.25}};
  double x = 0.25;
  for (int k = 0; k < 6; ++k) {
    const Rigid3 T_map_base = test::SyntheticPose(x + 0.25);
    test::SyntheticView view =
        test::Observe(world_, T_map_base * world_.T_base_camera, 0.3, static_cast<std::uint32_t>(k));
    std::map<LandmarkId, LandmarkId> present;
    for (const auto& [id, landmark] : map_.landmarks) present[Original(landmark)] = id;
    for (LandmarkId& id : view.landmarks) id = present.count(id) == 1 ? present.at(id) : LandmarkId{};
    KeyframeProposal proposal;
    proposal.keyframe = {
        Timestamp::FromSeconds(10.0 + k), T_map_base, world_.T_base_camera, view.features, view.landmarks, {}};
    proposal.odometry = test::ExactOdometry(world_, test::SyntheticPose(x), T_map_base);
    MappingOutcome outcome = MapKeyframe(map_, proposal, context_);
    x += 0.25;
    at[outcome.report.keyframe] = x;
    map_ = std::move(outcome.map);
    ASSERT_TRUE(Validate(map_).empty()) << Validate(map_).front();
  }
  EXPECT_GT(map_.landmarks.size(), 150U);
  for (const auto& [id, keyframe] : map_.keyframes) {
    EXPECT_LT((keyframe.T_map_base.translation - test::SyntheticPose(at.at(id)).translation).norm(), 0.02) << id.value;
  }
}

TEST_F(MapKeyframeTest, TriangulatesAndFusesWhatThePixelSigmaAllows) {
  EraseLandmarks erase;
  for (const auto& [id, landmark] : map_.landmarks) {
    if (id.value % 2 == 0) erase.ids.push_back(id);
  }
  map_ = Apply(std::move(map_), {erase});
  // Keypoints off by more than their sigma, of which every other match is still to be found.
  KeyframeProposal proposal = Proposal(4.0);
  for (std::size_t i = 0; i < proposal.keyframe.landmarks.size(); i += 2) proposal.keyframe.landmarks[i] = LandmarkId{};
  context_.options.fusion_radius = 10.0;
  const MappingReport strict = MapKeyframe(map_, proposal, context_).report;
  context_.model.pixel_sigma = 4.0;
  const MappingReport lenient = MapKeyframe(map_, proposal, context_).report;
  EXPECT_GT(lenient.triangulated, 1.3 * strict.triangulated);
  EXPECT_GT(lenient.fused, 1.3 * strict.fused);
}

TEST(MapperOptions, NameWhatIsWrong) {
  MapperOptions options;
  EXPECT_TRUE(options.Problems().empty());
  options.window = 0;
  options.redundancy = 1.5;
  EXPECT_EQ(options.Problems().size(), 2U);
}

}  // namespace
}  // namespace planar_vslam
