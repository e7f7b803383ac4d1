#pragma once
// Two drives through one synthetic world, each with a map and a frame of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "planar_vslam/backend/merge_maps.h"
#include "planar_vslam/map/map_union.h"
#include "support/synthetic_map.h"

namespace planar_vslam::test {

// A map of what is seen from true base poses, in a frame in which the world lies at `T_map_world`. Each pose is linked
// to the one before by odometry; a landmark is what two of them see.
inline Map MapFrom(const SyntheticWorld& world, const std::vector<Rigid3>& true_poses, const Rigid3& T_map_world,
                   std::uint32_t seed) {
  Map map;
  map.metric = true;
  map.octave_scales = world.map.octave_scales;
  MapEdit edit;
  std::vector<std::vector<Observation>> seen(world.true_points.size());
  for (std::uint32_t k = 0; k < true_poses.size(); ++k) {
    const SyntheticView view = Observe(world, true_poses[k] * world.T_base_camera, 0.3, seed + k);
    Keyframe keyframe;
    keyframe.stamp = Timestamp::FromSeconds(k);
    keyframe.T_map_base = T_map_world * true_poses[k];
    keyframe.T_base_camera = world.T_base_camera;
    keyframe.features = view.features;
    keyframe.landmarks.resize(view.landmarks.size());
    if (k > 0) keyframe.odometry_link = MotionLink{{k - 1}, ExactOdometry(world, true_poses[k - 1], true_poses[k])};
    edit.emplace_back(AddKeyframe{{k}, keyframe});
    for (std::uint32_t i = 0; i < view.landmarks.size(); ++i) seen[view.landmarks[i].value].push_back({{k}, i});
  }
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].size() < 2) continue;
    Landmark landmark;
    landmark.p_map = T_map_world * world.true_points[i];
    landmark.observations = seen[i];
    landmark.created_by = seen[i].front().keyframe;
    edit.emplace_back(AddLandmark{{next++}, landmark});
  }
  return Apply(std::move(map), edit);
}

class MergeTest : public ::testing::Test {
 protected:
  MergeTest() {
    SyntheticWorldOptions options;
    options.keyframes = 16;
    options.points = 1200;
    world_ = MakeSyntheticWorld(options);
    context_.model = world_.Context();
  }
  static std::vector<Rigid3> Poses(double from, int count) {
    std::vector<Rigid3> poses;
    for (int k = 0; k < count; ++k) poses.push_back(SyntheticPose(from + 0.25 * k));
    return poses;
  }
  Map MapOf(const std::vector<Rigid3>& poses, const Rigid3& T_map_world = {}, std::uint32_t seed = 1) const {
    return MapFrom(world_, poses, T_map_world, seed);
  }
  Expected<MergedMap> Merge(const Map& known, const Map& other) const {
    return MergeMaps(std::make_shared<const Map>(known), other, context_, [](const std::string&, long, long) {});
  }
  static double Distance(const Rigid3& a, const Rigid3& b) { return (a.translation - b.translation).norm(); }

  SyntheticWorld world_;
  MapperContext context_;
};

}  // namespace planar_vslam::test
