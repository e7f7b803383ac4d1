#include "planar_vslam/optimize/pose_graph.h"

#include <gtest/gtest.h>

#include <limits>

namespace planar_vslam {
namespace {

constexpr std::size_t kKeyframes = 41;

const Eigen::Matrix3d kTight = Eigen::Vector3d(0.01, 0.01, 0.01).cwiseAbs2().asDiagonal();
const Eigen::Matrix3d kLoose = Eigen::Vector3d(5.0, 5.0, 1.5).cwiseAbs2().asDiagonal();

KeyframeId Id(std::size_t k) { return KeyframeId{static_cast<std::uint32_t>(k)}; }

// Straight ahead, half a metre apart, 5 cm above the floor and tilted.
Map Straight() {
  Map map;
  map.metric = true;
  map.octave_scales = {1.0};
  for (std::size_t k = 0; k < kKeyframes; ++k) {
    Keyframe keyframe;
    keyframe.stamp = Timestamp::FromSeconds(static_cast<double>(k));
    keyframe.T_map_base =
        Rigid3(ExpSo3(Eigen::Vector3d(0.02, -0.03, 0.0)), Eigen::Vector3d(0.5 * static_cast<double>(k), 0.0, 0.05));
    keyframe.features = std::make_shared<const FrameFeatures>();
    map = Apply(std::move(map), {AddKeyframe{Id(k), std::move(keyframe)}});
  }
  return map;
}

std::vector<MapTie> ChainTies() {
  std::vector<MapTie> ties;
  for (std::size_t k = 1; k < kKeyframes; ++k) ties.push_back({Id(k - 1), Id(k), kTight, TieSource::kWheels});
  return ties;
}

// Says that the end is 0.4 m to the left of where the map has it.
LoopTie Loop(const Map& map) {
  const Rigid2 end = ProjectToPlane(map.keyframes.At(Id(kKeyframes - 1)).T_map_base);
  Rigid2 wanted = end;
  wanted.translation.y() += 0.4;
  return {Id(0), Id(kKeyframes - 1), Embed3(wanted), 1e-4 * kTight};
}

std::vector<std::pair<KeyframeId, Rigid3>> Solve(const Map& map, const std::vector<MapTie>& ties,
                                                 const std::vector<LoopTie>& loops) {
  Expected<std::vector<std::pair<KeyframeId, Rigid3>>> poses = SolvePoseGraph(map, ties, loops, {});
  EXPECT_TRUE(poses.ok());
  return std::move(poses).value();
}

TEST(PoseGraph, WithoutLoopsNothingMoves) {
  const Map map = Straight();
  for (const auto& [id, T_map_base] : Solve(map, ChainTies(), {})) {
    EXPECT_LT(LogSe3(map.keyframes.At(id).T_map_base.Inverse() * T_map_base).norm(), 1e-9) << id.value;
  }
}

TEST(PoseGraph, ALoopMovesTheEndAllTheWayAndTheMiddlePartOfIt) {
  const Map map = Straight();
  const auto poses = Solve(map, ChainTies(), {Loop(map)});
  ASSERT_EQ(poses.size(), kKeyframes);
  EXPECT_LT((poses.front().second.translation - map.keyframes.At(Id(0)).T_map_base.translation).norm(), 1e-9);
  EXPECT_NEAR(poses.back().second.translation.y(), 0.4, 0.005);
  const double middle = poses[kKeyframes / 2].second.translation.y();
  EXPECT_GT(middle, 0.1);
  EXPECT_LT(middle, 0.3);
  for (std::size_t k = 1; k < kKeyframes; ++k) {  // evenly: no step is torn
    EXPECT_LT(std::abs(poses[k].second.translation.y() - poses[k - 1].second.translation.y()), 0.03) << k;
  }
}

TEST(PoseGraph, KeepsHeightAndTilt) {
  const Map map = Straight();
  for (const auto& [id, T_map_base] : Solve(map, ChainTies(), {Loop(map)})) {
    const Rigid3& before = map.keyframes.At(id).T_map_base;
    EXPECT_NEAR(T_map_base.translation.z(), before.translation.z(), 1e-12);
    const Eigen::Vector3d up = T_map_base.rotation * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR(up.z(), (before.rotation * Eigen::Vector3d::UnitZ()).z(), 1e-12);
  }
}

TEST(PoseGraph, ADoubtfulTieTakesAllOfTheErrorHoweverLarge) {
  const Map map = Straight();
  std::vector<MapTie> ties = ChainTies();
  ties[19] = {Id(19), Id(20), kLoose, TieSource::kWheels, true};
  LoopTie loop = Loop(map);
  loop.T_map_to = Embed3(Rigid2(3.0, -4.0, 2.9)) * loop.T_map_to;
  const auto poses = Solve(map, ties, {loop});
  ASSERT_EQ(poses.size(), kKeyframes);
  const auto moved = [&](std::size_t k) {
    return LogSe3(map.keyframes.At(Id(k)).T_map_base.Inverse() * poses[k].second).norm();
  };
  EXPECT_GT(moved(20), 2.0);
  EXPECT_LT(moved(19), 0.03 * moved(20));
  const Rigid3 before = map.keyframes.At(Id(20)).T_map_base.Inverse() * map.keyframes.At(Id(40)).T_map_base;
  const Rigid3 after = poses[20].second.Inverse() * poses[40].second;
  EXPECT_LT((before.translation - after.translation).norm(), 0.03 * moved(20));
}

// Level to keyframe 19; from there on tilted as a whole about it, which no landmark has told: by wheels alone.
Map TiltedAfterABlindStep(double roll, double pitch) {
  Map map = Straight();
  const Rigid3 T_new_old(ExpSo3(Eigen::Vector3d(roll, pitch, 0.0)), Eigen::Vector3d::Zero());
  for (std::size_t k = 0; k < kKeyframes; ++k) {
    Keyframe& keyframe = map.keyframes.Edit(Id(k));
    const Rigid3 flat = Embed3(ProjectToPlane(keyframe.T_map_base));
    const Rigid3 pivot(Eigen::Quaterniond::Identity(), Eigen::Vector3d(9.5, 0.0, 0.0));
    keyframe.on_floor = k < 20;
    keyframe.T_map_base = keyframe.on_floor ? flat : pivot * T_new_old * pivot.Inverse() * flat;
  }
  return map;
}

std::vector<MapTie> TiesWithABlindStep() {
  std::vector<MapTie> ties = ChainTies();
  for (std::size_t k = 0; k < ties.size(); ++k) ties[k].source = k == 19 ? TieSource::kWheels : TieSource::kLandmarks;
  return ties;
}

TEST(PoseGraph, ALoopRaisesWhatLostItsTiltWhereNothingWasSeen) {
  const Map map = TiltedAfterABlindStep(0.05, 0.06);
  const LoopTie loop{Id(0), Id(kKeyframes - 1), Rigid3(Eigen::Quaterniond::Identity(), {20.0, 0.0, 0.0}),
                     0.01 * kTight};
  const auto poses = Solve(map, TiesWithABlindStep(), {loop});
  for (const auto& [id, T_map_base] : poses) {
    const Eigen::Vector3d up = T_map_base.rotation * Eigen::Vector3d::UnitZ();
    EXPECT_LT(up.head<2>().norm(), 0.01) << id.value;
    EXPECT_NEAR(T_map_base.translation.z(), 0.0, 0.05) << id.value;
  }
}

TEST(PoseGraph, ARampThatWasSeenStays) {
  Map map = TiltedAfterABlindStep(0.0, 0.0);
  for (std::size_t k = 20; k < 30; ++k) {  // a ramp of five metres, seen as it is; level and higher behind it
    const double way = 0.5 * static_cast<double>(k - 20), slope = 0.08;
    map.keyframes.Edit(Id(k)).T_map_base =
        Rigid3(ExpSo3(Eigen::Vector3d(0.0, -slope, 0.0)), Eigen::Vector3d(10.0 + way, 0.0, slope * way));
  }
  for (std::size_t k = 30; k < kKeyframes; ++k) map.keyframes.Edit(Id(k)).T_map_base.translation.z() = 0.4;
  std::vector<MapTie> ties = TiesWithABlindStep();
  ties[19].source = TieSource::kLandmarks;
  for (MapTie& tie : ties) tie.covariance = 0.04 * kTight;  // 2 mrad
  for (const auto& [id, T_map_base] : Solve(map, ties, {})) {
    const Vector6d moved = LogSe3(map.keyframes.At(id).T_map_base.Inverse() * T_map_base);
    EXPECT_LT(moved.tail<3>().norm(), 0.004) << id.value;  // of 0.08
    EXPECT_LT(moved.head<3>().norm(), 0.04) << id.value;   // of 0.4
  }
}

TEST(PoseGraph, SaysWhyThereIsNoSolution) {
  const Map map = Straight();
  LoopTie loop = Loop(map);
  loop.T_map_to.translation.x() = std::numeric_limits<double>::quiet_NaN();
  const auto poses = SolvePoseGraph(map, ChainTies(), {loop}, {});
  ASSERT_FALSE(poses.ok());
  EXPECT_FALSE(poses.error().message.empty());
}

}  // namespace
}  // namespace planar_vslam
