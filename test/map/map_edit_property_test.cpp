// What holds after every edit, over random sequences of edits.
#include <gtest/gtest.h>

#include "support/random_map.h"

namespace planar_vslam::test {
namespace {

constexpr int kEdits = 60;
constexpr int kStepsAnEdit = 8;

// The same content put into an empty map in one edit.
Map Rebuilt(const Map& map) {
  Map empty;
  empty.octave_scales = map.octave_scales;
  MapEdit edit{SetMetric{map.metric}};
  for (const auto& [id, keyframe] : map.keyframes) {
    AddKeyframe step{id, keyframe};
    step.keyframe.landmarks.assign(keyframe.landmarks.size(), LandmarkId{});
    edit.push_back(step);
  }
  for (const auto& [id, landmark] : map.landmarks) {
    Landmark bare = landmark;
    bare.descriptor = {};
    bare.view_direction.setZero();
    bare.min_distance = bare.max_distance = 0.0;
    edit.push_back(AddLandmark{id, bare});
  }
  Map rebuilt = Apply(std::move(empty), edit);
  rebuilt.next_keyframe_id = map.next_keyframe_id;  // the last ones may have been erased
  rebuilt.next_landmark_id = map.next_landmark_id;
  return rebuilt;
}

class RandomEdits : public testing::TestWithParam<unsigned> {
 protected:
  RandomEdits() : generator_(GetParam()), map_(RandomMap(generator_, 6, 20)) {}
  MapEdit NextEdit() { return RandomEditor(generator_, map_).Write(kStepsAnEdit); }

  std::mt19937 generator_;
  Map map_;
};

TEST_P(RandomEdits, KeepEveryInvariant) {
  for (int i = 0; i < kEdits; ++i) {
    map_ = Apply(std::move(map_), NextEdit());
    ASSERT_EQ(Validate(map_), std::vector<std::string>()) << "after edit " << i;
  }
}

TEST_P(RandomEdits, LeaveTheMapTheyWouldHaveBuiltFromScratch) {
  for (int i = 0; i < kEdits; ++i) {
    map_ = Apply(std::move(map_), NextEdit());
    ASSERT_TRUE(Equal(map_, Rebuilt(map_))) << "after edit " << i;
  }
}

TEST_P(RandomEdits, GiveTheSameMapTwice) {
  for (int i = 0; i < kEdits; ++i) {
    const MapEdit edit = NextEdit();
    Map again = Apply(map_, edit);
    map_ = Apply(std::move(map_), edit);
    ASSERT_TRUE(Equal(map_, again)) << "after edit " << i;
  }
}

TEST_P(RandomEdits, NeverBringAnIdBack) {
  std::set<KeyframeId> gone_keyframes;
  std::set<LandmarkId> gone_landmarks;
  for (int i = 0; i < kEdits; ++i) {
    const Map before = map_;
    map_ = Apply(std::move(map_), NextEdit());
    ASSERT_GE(map_.next_keyframe_id, before.next_keyframe_id);
    ASSERT_GE(map_.next_landmark_id, before.next_landmark_id);
    for (std::uint32_t id = 0; id < map_.next_keyframe_id; ++id) {
      if (!map_.keyframes.Contains(K(id))) gone_keyframes.insert(K(id));
    }
    for (std::uint32_t id = 0; id < map_.next_landmark_id; ++id) {
      if (!map_.landmarks.Contains(L(id))) gone_landmarks.insert(L(id));
    }
    for (const KeyframeId id : gone_keyframes) ASSERT_FALSE(map_.keyframes.Contains(id)) << id.value;
    for (const LandmarkId id : gone_landmarks) ASSERT_FALSE(map_.landmarks.Contains(id)) << id.value;
  }
}

TEST_P(RandomEdits, LeaveNoLandmarkThatLostItsSecondObservation) {
  for (int i = 0; i < kEdits; ++i) {
    const Map before = map_;
    map_ = Apply(std::move(map_), NextEdit());
    for (const auto& [id, landmark] : map_.landmarks) {
      const Landmark* earlier = before.landmarks.Find(id);
      if (earlier == nullptr || earlier->observations.size() < 2) continue;
      ASSERT_GE(landmark.observations.size(), 2U) << "landmark " << id.value << " after edit " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomEdits, testing::Values(1U, 2U, 3U, 4U, 5U, 6U, 7U, 8U));

}  // namespace
}  // namespace planar_vslam::test
