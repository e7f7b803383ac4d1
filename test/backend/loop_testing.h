#pragma once
// A robot that drives away from a mapped place without seeing much, and comes back to it with an error.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "planar_vslam/backend/loop_closing.h"
#include "support/synthetic_map.h"

namespace planar_vslam::test {

inline constexpr SystematicErrors kSystematic{0.005, 0.0005};

// Adds keyframes, each linked by odometry to the one before.
class Driver {
 public:
  explicit Driver(const SyntheticWorld& world) : world_(world), map_(world.map) {}

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
    const FrameFeaturesPtr all = Observe(world_, true_pose * world_.T_base_camera, 0.3, seed).features;
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
      for (auto it = std::prev(map_.keyframes.end(), static_cast<std::ptrdiff_t>(count)); it != map_.keyframes.end();
           ++it) {
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
  const SyntheticWorld& world_;
  Map map_;
};

class LoopTest : public ::testing::Test {
 protected:
  static constexpr int kViews = 3;

  LoopTest() {
    SyntheticWorldOptions options;
    options.points = 600;
    options.pixel_noise = 0.3;
    world_ = MakeSyntheticWorld(options);
    context_ = world_.Context();
  }

  static FrameFeaturesPtr Blank() { return std::make_shared<const FrameFeatures>(); }
  static Rigid3 TrueView(int k) { return SyntheticPose(0.3 + 0.25 * k); }

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
  Driver ComeBackKidnapped(const Rigid3& error, KeyframeId* kidnapped) const {
    Driver driver(world_);
    SyntheticWorldOptions elsewhere;
    elsewhere.points = 600;
    elsewhere.seed = 99;
    const SyntheticWorld other = MakeSyntheticWorld(elsewhere);
    *kidnapped = driver.Drive(Rigid2(), Observe(other, other.T_base_camera, 0.0, 1).features);
    for (int k = 0; k < 16; ++k) driver.Drive(Rigid2(0.5, 0.0, 0.0), Blank());
    for (int k = 0; k < kViews; ++k) driver.Stand(error * TrueView(k), TrueView(k), 1.0);
    driver.MapAnew(kViews, error);
    return driver;
  }
  std::optional<Loop> Find(const Driver& driver, const LoopOptions& options = {}) const {
    MapDrift drift(context_, kSystematic);
    drift.Follow(driver.map());
    return FindLoop(driver.map(), driver.newest(), drift, context_, options);
  }
  static double Distance(const Rigid3& a, const Rigid3& b) { return (a.translation - b.translation).norm(); }

  SyntheticWorld world_;
  MeasurementModel context_;
};

inline const Rigid3 kDrift = Embed3(Rigid2(0.12, -0.1, 0.03));
inline const Rigid3 kKidnapped = Embed3(Rigid2(3.0, -1.5, 0.9));

}  // namespace planar_vslam::test
