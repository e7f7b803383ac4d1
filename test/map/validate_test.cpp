// Every invariant, broken on purpose.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "support/random_map.h"

namespace planar_vslam::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Damage {
  const char* name;
  std::function<void(Map*)> inflict;
  const char* expected;  // part of one of the lines
};

void ChangeFeatures(Map* map, const std::function<void(FrameFeatures*)>& change) {
  FrameFeaturesPtr& features = map->keyframes.Edit(K(1)).features;
  auto changed = std::make_shared<FrameFeatures>(*features);
  change(changed.get());
  features = changed;
}

Keyframe& AKeyframe(Map* map) { return map->keyframes.Edit(K(1)); }
Landmark& ALandmark(Map* map) { return map->landmarks.Edit(L(0)); }
Observation& AnObservation(Map* map) { return ALandmark(map).observations.front(); }
void FreeItsKeypoint(Map* map) {
  const Observation o = AnObservation(map);
  map->keyframes.Edit(o.keyframe).landmarks[o.keypoint] = LandmarkId{};
}

std::vector<Damage> Damages() {
  return {
      {"KeyframeCounter", [](Map* m) { m->next_keyframe_id = 3; }, "keyframe 3: id not below the counter 3"},
      {"LandmarkCounter", [](Map* m) { m->next_landmark_id = 5; }, "landmark 5: id not below the counter 5"},
      {"OctaveScales", [](Map* m) { std::swap(m->octave_scales[1], m->octave_scales[2]); }, "octave_scales[2]"},
      {"OctaveScaleZero", [](Map* m) { m->octave_scales[0] = 0.0; }, "octave_scales[0]"},
      {"OctaveOutside", [](Map* m) { ChangeFeatures(m, [](FrameFeatures* f) { f->keypoints[2].octave = 8; }); },
       "keyframe 1 keypoint 2: octave 8 of 8"},
      {"PixelNotFinite",
       [](Map* m) { ChangeFeatures(m, [](FrameFeatures* f) { f->keypoints[2].pixel.x() = std::nanf(""); }); },
       "keyframe 1 keypoint 2: pixel not finite"},
      {"DescriptorCount", [](Map* m) { ChangeFeatures(m, [](FrameFeatures* f) { f->descriptors.pop_back(); }); },
       "keyframe 1: 19 descriptors for 20 keypoints"},
      {"NoFeatures", [](Map* m) { AKeyframe(m).features.reset(); }, "keyframe 1: no features"},
      {"LandmarkEntryCount", [](Map* m) { AKeyframe(m).landmarks.emplace_back(); },
       "keyframe 1: 21 landmark entries for 20 keypoints"},
      {"PoseNotFinite", [](Map* m) { AKeyframe(m).T_map_base.translation.z() = kNan; }, "keyframe 1: T_map_base"},
      {"RotationNotUnit", [](Map* m) { AKeyframe(m).T_base_camera.rotation.w() += 0.5; }, "keyframe 1: T_base_camera"},
      {"LinkToNowhere", [](Map* m) { AKeyframe(m).odometry_link->from = K(99); },
       "odometry link from keyframe 99 that does not exist"},
      {"LinkToLater", [](Map* m) { AKeyframe(m).odometry_link->from = K(2); },
       "odometry link from keyframe 2 that is not earlier"},
      {"LinkNotFinite", [](Map* m) { AKeyframe(m).odometry_link->motion.covariance(1, 2) = kNan; },
       "odometry link not finite"},
      {"LaserCovarianceNotDefinite",
       [](Map* m) { m->keyframes.Edit(K(2)).laser_links.front().motion.covariance.setZero(); },
       "keyframe 2: laser link from keyframe 0: covariance not positive definite"},
      {"LandmarkMissing", [](Map* m) { m->landmarks.Erase({L(0)}); }, "landmark 0 does not exist"},
      {"KeyframeMissing", [](Map* m) { m->keyframes.Erase({AnObservation(m).keyframe}); },
       "landmark 0: observing keyframe"},
      {"OneWayFromKeyframe", [](Map* m) { ALandmark(m).observations.pop_back(); }, "does not list this observation"},
      {"OneWayFromLandmark", FreeItsKeypoint, "does not refer to it"},
      {"KeypointOutside", [](Map* m) { AnObservation(m).keypoint = 20; }, "keypoint 20 beyond the 20"},
      {"NoObservations", [](Map* m) { ALandmark(m).observations.clear(); }, "landmark 0: no observations"},
      {"ObservationOrder",
       [](Map* m) { std::swap(ALandmark(m).observations.front(), ALandmark(m).observations.back()); },
       "landmark 0: observation in keyframe"},
      {"ObservedTwice",
       [](Map* m) { ALandmark(m).observations.insert(ALandmark(m).observations.begin(), AnObservation(m)); },
       "landmark 0: observation in keyframe"},
      {"CreatorNeverWas", [](Map* m) { ALandmark(m).created_by = KeyframeId{}; }, "landmark 0: created by keyframe"},
      {"LinksNotIndexed", [](Map* m) { AKeyframe(m).linked_by.pop_back(); }, "keyframe 1: not all links from it"},
      {"PlacesNotIndexed", [](Map* m) { AKeyframe(m).T_map_base.translation.x() += 2.0; }, "places of keyframes"},
      {"PointNotFinite", [](Map* m) { ALandmark(m).p_map.x() = kNan; }, "landmark 0: position not finite"},
      {"DirectionNotFinite", [](Map* m) { ALandmark(m).view_direction.x() = kNan; },
       "landmark 0: view direction not finite"},
      {"DistancesReversed", [](Map* m) { std::swap(ALandmark(m).min_distance, ALandmark(m).max_distance); },
       "landmark 0: distance range"},
  };
}

class Validation : public testing::TestWithParam<Damage> {};

TEST_P(Validation, NamesWhatIsBroken) {
  std::mt19937 generator(21);
  Map map = RandomMap(generator, 5, 20);
  ASSERT_EQ(Validate(map), std::vector<std::string>());
  GetParam().inflict(&map);
  const std::vector<std::string> problems = Validate(map);
  bool named = false;
  for (const std::string& line : problems) {
    named |= line.find(GetParam().expected) != std::string::npos;
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
  EXPECT_TRUE(named) << GetParam().expected << "\n" << testing::PrintToString(problems);
}

INSTANTIATE_TEST_SUITE_P(Broken, Validation, testing::ValuesIn(Damages()),
                         [](const testing::TestParamInfo<Damage>& damage) { return std::string(damage.param.name); });

TEST(Validate, AnEmptyMapIsSound) { EXPECT_TRUE(Validate(Map{}).empty()); }

}  // namespace
}  // namespace planar_vslam::test
