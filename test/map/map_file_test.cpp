// What is saved comes back to the last bit, and no damage to a file does more than give an error.
#include "planar_vslam/map/map_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "map_file_bytes.h"
#include "support/random_map.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

CameraModel TestCamera() {
  CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 500.1, camera.fy = 501.2, camera.cx = 320.3, camera.cy = 240.4;
  camera.k1 = -0.1, camera.k2 = 0.01, camera.p1 = 1e-4, camera.p2 = -2e-4, camera.k3 = 1e-3;
  camera.k4 = 2e-3, camera.k5 = -1e-3, camera.k6 = 1e-4;
  return camera;
}

float RandomFloat(std::mt19937& generator, float limit) {
  return std::uniform_real_distribution<float>(0.0F, limit)(generator);
}

// Gives the fields that random maps leave at their defaults values of their own.
Map Filled(std::mt19937& generator, Map map) {
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.Edit(id);
    auto features = std::make_shared<FrameFeatures>(*keyframe.features);
    for (Keypoint& keypoint : features->keypoints) {
      keypoint.pixel = {RandomFloat(generator, 640.0F), RandomFloat(generator, 480.0F)};
      keypoint.raw_pixel = {RandomFloat(generator, 640.0F), RandomFloat(generator, 480.0F)};
      keypoint.angle = RandomFloat(generator, 6.0F);
      keypoint.response = RandomFloat(generator, 100.0F);
    }
    features->grid = ImageGrid(features->keypoints);
    keyframe.features = features;
    keyframe.stamp.nanoseconds = 1'700'000'000'123'456'789 + static_cast<std::int64_t>(id.value);
    keyframe.on_floor = generator() % 2 == 0;
  }
  return map;
}

Map EditedMap(std::mt19937& generator) {
  Map map = RandomMap(generator, 3 + RandomIndex(generator, 4), 6 + RandomIndex(generator, 10));
  map = Apply(std::move(map), RandomEditor(generator, map).Write(20));
  return Filled(generator, std::move(map));
}

void ExpectSameFeatures(const FrameFeatures& a, const FrameFeatures& b) {
  const auto same = [](const Keypoint& x, const Keypoint& y) {
    return x.pixel == y.pixel && x.raw_pixel == y.raw_pixel && x.angle == y.angle && x.response == y.response &&
           x.octave == y.octave;
  };
  EXPECT_TRUE(std::equal(a.keypoints.begin(), a.keypoints.end(), b.keypoints.begin(), b.keypoints.end(), same));
  EXPECT_EQ(a.descriptors, b.descriptors);
  std::vector<int> near_a, near_b;
  a.grid.Search(a.keypoints, {320.0F, 240.0F}, 150.0F, 0, 7, &near_a);
  b.grid.Search(b.keypoints, {320.0F, 240.0F}, 150.0F, 0, 7, &near_b);
  EXPECT_EQ(near_a, near_b);
}

void ExpectSameMap(const Map& a, Map b) {
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  for (const KeyframeId id : b.keyframes.Ids()) {
    Keyframe& keyframe = b.keyframes.Edit(id);
    ASSERT_TRUE(a.keyframes.Contains(id));
    const Keyframe& original = a.keyframes.At(id);
    ExpectSameFeatures(*original.features, *keyframe.features);
    EXPECT_EQ(original.on_floor, keyframe.on_floor);
    keyframe.features = original.features;  // Equal() compares them by address
  }
  EXPECT_TRUE(Equal(a, b));
}

class MapFile : public ::testing::Test {
 protected:
  MapFile() : map_(Filled(generator_, RandomMap(generator_, 3, 6))) {}

  std::string Saved(const Map& map) const {
    const Expected<bool> saved = SaveMapFile(map, TestCamera(), path_);
    EXPECT_TRUE(saved.ok()) << saved.error().message;
    return ReadBytes(path_);
  }
  Expected<SavedMap> Loaded(const std::string& bytes) const {
    WriteBytes(path_, bytes);
    return LoadMapFile(path_);
  }
  // The message names the file and is one line.
  void ExpectUseful(const std::string& message) const {
    EXPECT_EQ(message.find(path_.string() + ": "), 0U) << message;
    EXPECT_NE(message.find("expected"), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
  // The error for `bytes`; empty, with a failure, where there is none.
  std::string ErrorOf(const std::string& bytes) const {
    const Expected<SavedMap> loaded = Loaded(bytes);
    EXPECT_FALSE(loaded.ok());
    if (loaded.ok()) return "";
    ExpectUseful(loaded.error().message);
    return loaded.error().message;
  }
  // Damage that no checksum tells: an error, or a map that is sound.
  void ExpectErrorOrSoundMap(const std::string& bytes) const {
    const Expected<SavedMap> loaded = Loaded(bytes);
    if (loaded.ok()) {
      EXPECT_TRUE(Validate(loaded->map).empty());
      EXPECT_TRUE(loaded->camera.Problems().empty());
    } else {
      ExpectUseful(loaded.error().message);
    }
  }

  std::mt19937 generator_{1};
  TemporaryFolder folder_;
  fs::path path_ = folder_.path() / "map.pvm";
  Map map_;
};

TEST_F(MapFile, KeepsEverythingToTheLastBit) {
  for (int round = 0; round < 50; ++round) {
    const Map map = EditedMap(generator_);
    ASSERT_TRUE(Validate(map).empty());
    const Expected<SavedMap> loaded = Loaded(Saved(map));
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    ExpectSameMap(map, loaded->map);
  }
}

TEST_F(MapFile, KeepsTheCamera) {
  const Expected<SavedMap> loaded = Loaded(Saved(map_));
  ASSERT_TRUE(loaded.ok());
  const CameraModel expected = TestCamera(), found = loaded->camera;
  EXPECT_EQ(found.width, expected.width);
  EXPECT_EQ(found.height, expected.height);
  for (const auto field :
       {&CameraModel::fx, &CameraModel::fy, &CameraModel::cx, &CameraModel::cy, &CameraModel::k1, &CameraModel::k2,
        &CameraModel::p1, &CameraModel::p2, &CameraModel::k3, &CameraModel::k4, &CameraModel::k5, &CameraModel::k6}) {
    EXPECT_EQ(found.*field, expected.*field);
  }
}

TEST_F(MapFile, KeepsAnEmptyMapAndItsCounters) {
  Map map;
  map.next_keyframe_id = 7;
  map.next_landmark_id = 9;
  map.metric = true;
  const Expected<SavedMap> loaded = Loaded(Saved(map));
  ASSERT_TRUE(loaded.ok());
  EXPECT_TRUE(Equal(map, loaded->map));
}

TEST_F(MapFile, TheSameMapGivesTheSameBytes) {
  const Map map = EditedMap(generator_);
  const std::string first = Saved(map);
  EXPECT_EQ(Saved(map), first);
  EXPECT_EQ(Saved(Loaded(first)->map), first);
}

TEST_F(MapFile, WhatShrinksBeyondBeliefIsReadableToo) {
  Map map;
  map.octave_scales = {1.0};
  auto features = std::make_shared<FrameFeatures>();
  features->keypoints.resize(100'000);
  features->descriptors.resize(100'000);
  Keyframe keyframe;
  keyframe.features = features;
  keyframe.landmarks.resize(100'000);
  const Map uniform = Apply(std::move(map), {AddKeyframe{K(0), keyframe}});
  EXPECT_TRUE(Loaded(Saved(uniform)).ok());
}

TEST_F(MapFile, SavingReplacesAFileAndLeavesNothingElse) {
  const std::string empty = Saved(Map());
  EXPECT_NE(Saved(map_), empty);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()), 1);
}

TEST_F(MapFile, ABrokenMapIsNotSavedOverASoundOne) {
  const std::string before = Saved(map_);
  Map broken = map_;
  broken.landmarks.Edit(broken.landmarks.begin()->first).p_map.x() = std::nan("");
  const Expected<bool> saved = SaveMapFile(broken, TestCamera(), path_);
  ASSERT_FALSE(saved.ok());
  EXPECT_NE(saved.error().message.find("position not finite"), std::string::npos) << saved.error().message;
  EXPECT_FALSE(SaveMapFile(map_, CameraModel(), path_).ok());
  EXPECT_EQ(ReadBytes(path_), before);
}

TEST_F(MapFile, PlacesThatCannotBeWrittenAreNamed) {
  const fs::path absent = folder_.path() / "absent" / "map.pvm";
  for (const fs::path& path : {absent, folder_.path(), fs::path("/dev/null")}) {
    const Expected<bool> saved = SaveMapFile(map_, TestCamera(), path);
    ASSERT_FALSE(saved.ok()) << path;
    EXPECT_EQ(saved.error().message.find(path.string() + ": "), 0U) << saved.error().message;
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(MapFile, WhatIsNotASavedMapIsRefused) {
  EXPECT_FALSE(LoadMapFile(folder_.path()).ok());
  EXPECT_FALSE(LoadMapFile(folder_.path() / "absent.pvm").ok());
  EXPECT_FALSE(LoadMapFile("/dev/zero").ok());
  ErrorOf("");
  EXPECT_NE(ErrorOf("# t x y z qx qy qz qw\n").find("not a saved map"), std::string::npos);
}

TEST_F(MapFile, ANewerVersionIsCalledNewer) {
  const std::vector<MapFileSection> sections = SectionsOf(Saved(map_));
  EXPECT_TRUE(Loaded(JoinSections(sections)).ok());
  EXPECT_NE(ErrorOf(JoinSections(sections, kVersion + 1)).find("newer"), std::string::npos);
  ErrorOf(JoinSections(sections, 0));
}

// Of a version before lenses had more than plumb_bob's coefficients.
std::vector<MapFileSection> WithoutLens(std::vector<MapFileSection> sections) {
  constexpr std::size_t kLens = 3 * 8 + 1;  // k4 k5 k6 and a flag
  sections = Uncompressed(std::move(sections));
  sections[0].plain.resize(sections[0].plain.size() - kLens);
  sections[0].stored = sections[0].plain;
  return sections;
}

TEST_F(MapFile, VersionTwoIsReadWithAPlumbBob) {
  const std::vector<MapFileSection> sections = WithoutLens(SectionsOf(Saved(map_)));
  const Expected<SavedMap> loaded = Loaded(JoinSections(sections, 2));
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  ExpectSameMap(map_, loaded->map);
  EXPECT_EQ(loaded->camera.lens, Lens::kRadial);
  EXPECT_EQ(loaded->camera.k3, 1e-3);
  ErrorOf(JoinSections(sections));
}

TEST_F(MapFile, VersionOneIsReadWithoutLaser) {
  std::vector<MapFileSection> sections = WithoutLens(SectionsOf(Saved(map_)));
  sections.pop_back();
  const Expected<SavedMap> loaded = Loaded(JoinSections(sections, 1));
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  for (const KeyframeId id : map_.keyframes.Ids()) {
    Keyframe& keyframe = map_.keyframes.Edit(id);
    keyframe.sweeps.clear();
    keyframe.laser_links.clear();
  }
  RebuildIndexes(&map_);
  ExpectSameMap(map_, loaded->map);
}

TEST_F(MapFile, EveryTruncationIsAnError) {
  const std::string file = Saved(map_);
  for (std::size_t size = 0; size < file.size(); ++size) ErrorOf(file.substr(0, size));
  ErrorOf(file + '\0');
  ErrorOf(file + file);
}

TEST_F(MapFile, EveryFlippedBitIsAnError) {
  const std::string file = Saved(map_);
  for (std::size_t i = 0; i < file.size(); ++i) {
    std::string damaged = file;
    damaged[i] = static_cast<char>(static_cast<unsigned char>(file[i]) ^ (1U << RandomIndex(generator_, 8)));
    ErrorOf(damaged);
  }
}

TEST_F(MapFile, SectionsThatAreMissingOrSwappedAreErrors) {
  const std::vector<MapFileSection> sections = SectionsOf(Saved(map_));
  ASSERT_EQ(sections.size(), 5U);
  for (std::size_t i = 0; i < sections.size(); ++i) {
    std::vector<MapFileSection> fewer = sections, more = sections, swapped = sections, empty = sections;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    more.push_back(sections[i]);
    std::swap(swapped[i], swapped[(i + 1) % sections.size()]);
    empty[i].stored = empty[i].plain = "";
    for (const auto& damaged : {fewer, more, swapped, empty}) ErrorOf(JoinSections(damaged));
  }
}

TEST_F(MapFile, LengthsThatLieAreErrors) {
  const std::vector<MapFileSection> sections = SectionsOf(Saved(map_));
  for (std::size_t i = 0; i < sections.size(); ++i) {
    for (const std::size_t length : {std::size_t{0}, sections[i].plain.size() + 1, std::size_t{1} << 24U}) {
      std::vector<MapFileSection> damaged = sections;
      damaged[i].plain.resize(length);  // JoinSections only takes its length
      ErrorOf(JoinSections(damaged));
    }
  }
}

TEST_F(MapFile, DamagedContentWithRightChecksumsNeverCrashes) {
  const std::vector<MapFileSection> sections = SectionsOf(Saved(map_));
  ASSERT_TRUE(std::any_of(sections.begin(), sections.end(), [](const auto& s) { return s.stored != s.plain; }));
  for (const bool compressed : {true, false}) {
    const std::vector<MapFileSection> intact = compressed ? sections : Uncompressed(sections);
    ASSERT_TRUE(Loaded(JoinSections(intact)).ok());
    for (std::size_t s = 0; s < intact.size(); ++s) {
      for (std::size_t i = 0; i < intact[s].stored.size(); ++i) {
        std::vector<MapFileSection> damaged = intact;
        char& byte = damaged[s].stored[i];
        byte = static_cast<char>(static_cast<unsigned char>(byte) ^ (1U << RandomIndex(generator_, 8)));
        ExpectErrorOrSoundMap(JoinSections(damaged));
      }
    }
  }
}

TEST_F(MapFile, NumbersOfAllOnesAndShortSectionsNeverCrash) {
  const std::vector<MapFileSection> intact = Uncompressed(SectionsOf(Saved(map_)));
  for (std::size_t s = 0; s < intact.size(); ++s) {
    for (std::size_t i = 0; i + 4 <= intact[s].plain.size(); i += 1 + RandomIndex(generator_, 3)) {
      std::vector<MapFileSection> damaged = intact;
      damaged[s].stored.replace(i, 4, 4, '\xFF');  // counts, ids, and numbers that are not
      ExpectErrorOrSoundMap(JoinSections(damaged));
      damaged[s].stored = damaged[s].plain = intact[s].plain.substr(0, i);
      ErrorOf(JoinSections(damaged));
    }
  }
}

TEST_F(MapFile, AllProblemsOfAMapAreListed) {
  std::vector<MapFileSection> sections = Uncompressed(SectionsOf(Saved(map_)));
  EXPECT_TRUE(MapFileProblems(path_).empty());
  constexpr std::size_t kNextKeyframeId = 0;  // where MAPS has it
  sections[1].stored.replace(kNextKeyframeId, 4, 4, '\0');
  const std::string message = ErrorOf(JoinSections(sections));
  EXPECT_NE(message.find("keyframe 0: id not below the counter 0 (and "), std::string::npos) << message;
  EXPECT_GE(MapFileProblems(path_).size(), map_.keyframes.size() + map_.landmarks.size());
}

}  // namespace
}  // namespace planar_vslam::test
