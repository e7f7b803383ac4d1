#include "planar_vslam/pipeline/options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

const fs::path kConfigFolder = test::SourceFolder() / "config";

std::vector<fs::path> ShippedConfigurations() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kConfigFolder)) {
    if (entry.is_regular_file() && entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string Join(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

// The keys of a file of sections and values, in file order, with the comment each carries.
std::vector<std::pair<std::string, std::string>> KeysAndComments(const fs::path& file) {
  std::vector<std::pair<std::string, std::string>> keys;
  std::ifstream in(file);
  std::string line, section;
  while (std::getline(in, line)) {
    const std::size_t colon = line.find(':'), hash = line.find('#');
    if (line.empty() || line.front() == '#') continue;
    const bool nested = line.front() == ' ';
    const std::string name = line.substr(nested ? 2 : 0, colon - (nested ? 2 : 0));
    const std::string value = line.substr(colon + 1, hash == std::string::npos ? hash : hash - colon - 1);
    if (value.find_first_not_of(' ') == std::string::npos) {
      section = name + ".";
      continue;
    }
    keys.emplace_back((nested ? section : "") + name, hash == std::string::npos ? "" : line.substr(hash + 1));
  }
  return keys;
}

class LoadOptionsTest : public ::testing::Test {
 protected:
  Expected<PipelineOptions> Load(const std::string& text) {
    file_ = folder_.path() / "test.yaml";
    std::ofstream(file_) << text;
    return LoadOptions(file_);
  }
  // The message of a file that must not load; it has to be one line and name the file.
  std::string Problem(const std::string& text) {
    const Expected<PipelineOptions> options = Load(text);
    if (options.ok()) {
      ADD_FAILURE() << "loaded: " << text;
      return "";
    }
    EXPECT_NE(options.error().message.find(file_.string()), std::string::npos) << options.error().message;
    EXPECT_EQ(options.error().message.find('\n'), std::string::npos) << options.error().message;
    return options.error().message;
  }

  test::TemporaryFolder folder_;
  fs::path file_;
};

void ExpectMentions(const std::string& message, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(message.find(word), std::string::npos) << "'" << word << "' not in: " << message;
}

TEST(PipelineOptions, DefaultsHaveNoProblems) { EXPECT_EQ(Join(PipelineOptions{}.Problems()), ""); }

TEST(PipelineOptions, KeysAreUnique) {
  std::set<std::string> keys;
  for (const auto& [key, value] : OptionValues({})) EXPECT_TRUE(keys.insert(key).second) << key;
}

TEST(ShippedConfigurations, AllLoadWithoutProblems) {
  ASSERT_FALSE(ShippedConfigurations().empty());
  for (const fs::path& file : ShippedConfigurations()) {
    const Expected<PipelineOptions> options = LoadOptions(file);
    ASSERT_TRUE(options.ok()) << options.error().message;
    EXPECT_EQ(Join(options->Problems()), "") << file;
  }
}

TEST(ShippedConfigurations, DefaultIsTheDefaults) {
  const Expected<PipelineOptions> options = LoadOptions(kConfigFolder / "default.yaml");
  ASSERT_TRUE(options.ok()) << options.error().message;
  EXPECT_EQ(OptionValues(*options), OptionValues({}));
}

TEST(ShippedConfigurations, DefaultIsWhatTheCodeWrites) {
  std::ifstream in(kConfigFolder / "default.yaml");
  const std::string file((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_EQ(file, DefaultConfiguration()) << "write it anew: planar_vslam config > config/default.yaml";
}

TEST(ShippedConfigurations, WhatWasFittedSaysSo) {
  std::set<std::string> fitted;
  for (const auto& [key, comment] : KeysAndComments(kConfigFolder / "default.yaml")) {
    if (comment.find("(fitted)") != std::string::npos) fitted.insert(key);
  }
  for (const std::string key :
       {"bundle.odometry_loss", "bundle.tilt_loss", "mount.sigma_angle_deg", "odometry_noise.along_per_sqrt_meter",
        "odometry_noise.heading_per_sqrt_meter_deg", "mapper.wide_window", "mapper.wide_every", "mapper.young_map",
        "loop.min_share", "systematic.laser"}) {
    EXPECT_EQ(fitted.count(key), 1U) << key;
  }
  EXPECT_EQ(fitted.count("orb.feature_count"), 0U);
}

TEST(ShippedConfigurations, DefaultDocumentsEveryKey) {
  std::set<std::string> known, documented;
  for (const auto& [key, value] : OptionValues({})) known.insert(key);
  for (const auto& [key, comment] : KeysAndComments(kConfigFolder / "default.yaml")) {
    EXPECT_TRUE(documented.insert(key).second) << key << " twice";
    EXPECT_FALSE(comment.empty()) << key << " has no comment";
  }
  EXPECT_EQ(documented, known);
}

TEST_F(LoadOptionsTest, ReadsNestedAndDottedKeysOverTheDefaults) {
  const auto nested = Load("orb:\n  feature_count: 555\nodometry: required\n"),
             dotted = Load("orb.feature_count: 555\nodometry: required\n");
  ASSERT_TRUE(nested.ok() && dotted.ok());
  EXPECT_EQ(nested->orb.feature_count, 555);
  EXPECT_EQ(nested->odometry, OdometryUse::kRequired);
  EXPECT_EQ(OptionValues(*nested), OptionValues(*dotted));
  PipelineOptions expected;
  expected.orb.feature_count = 555;
  expected.odometry = OdometryUse::kRequired;
  EXPECT_EQ(OptionValues(*nested), OptionValues(expected));
}

TEST_F(LoadOptionsTest, DegreesBecomeRadians) {
  const auto options = Load("planar: {sigma_tilt_deg: 2.0}");
  ASSERT_TRUE(options.ok());
  EXPECT_NEAR(options->planar.sigma_tilt, DegreesToRadians(2.0), 1e-12);
}

TEST_F(LoadOptionsTest, AnEmptyFileIsTheDefaults) {
  const auto options = Load("# nothing but a comment\n");
  ASSERT_TRUE(options.ok());
  EXPECT_EQ(OptionValues(*options), OptionValues({}));
}

TEST_F(LoadOptionsTest, NamesUnknownKeys) {
  ExpectMentions(Problem("orb:\n  feature_cuont: 500\n"),
                 {"orb.feature_cuont is unknown", "did you mean orb.feature_count?"});
  ExpectMentions(Problem("trakcer:\n  min_inliers: 5\n"),
                 {"trakcer.min_inliers is unknown", "did you mean tracker.min_inliers?"});
  ExpectMentions(Problem("sdfghjkl: 5\n"), {"sdfghjkl is unknown", "planar_vslam config"});
  ExpectMentions(Problem("orb: 500\n"), {"orb is a section"});
}

TEST_F(LoadOptionsTest, NamesKeysOfTheWrongType) {
  ExpectMentions(Problem("orb: {feature_count: many}"), {"orb.feature_count", "many", "integer"});
  ExpectMentions(Problem("orb: {feature_count: 10.5}"), {"orb.feature_count", "10.5", "integer"});
  ExpectMentions(Problem("orb: {scale_factor: large}"), {"orb.scale_factor", "number"});
  ExpectMentions(Problem("orb: {scale_factor: }"), {"orb.scale_factor", "number"});
  ExpectMentions(Problem("orb: {scale_factor: [1, 2]}"), {"orb.scale_factor", "single value"});
  ExpectMentions(Problem("bundle: {use_odometry: 7}"), {"bundle.use_odometry", "true or false"});
  ExpectMentions(Problem("odometry: maybe"), {"odometry is 'maybe'", "auto", "required", "off"});
  ExpectMentions(Problem("odometry: {wheel: 1}"), {"odometry.wheel", "unknown"});
}

TEST_F(LoadOptionsTest, NamesAllProblemsInOneLine) {
  ExpectMentions(Problem("orb: {feature_cuont: 500, level_count: many}\nodometry: maybe\nmapper: {window: 0}\n"),
                 {"orb.feature_cuont is unknown", "; orb.level_count is 'many'", "; odometry is 'maybe'",
                  "; mapper.window is 0; expected at least 1"});
  ExpectMentions(Problem("mapper: {window: 5}\nmapper.window: 6\n"), {"mapper.window stands twice"});
}

TEST_F(LoadOptionsTest, ValuesOutOfBoundsAloneMayStillBeSetRight) {
  const auto options = Load("mapper: {window: 0}\n");
  ASSERT_TRUE(options.ok()) << options.error().message;
  std::vector<std::string> problems;
  CollectOptions(file_, {"mapper.window=3"}, &problems);
  EXPECT_EQ(Join(problems), "");
  CollectOptions(file_, {"mapper.windwo=3", "orb.level_count=0"}, &problems);
  ASSERT_EQ(problems.size(), 3U) << Join(problems);
  ExpectMentions(problems[0], {"--set mapper.windwo=3", "did you mean mapper.window?"});
  EXPECT_EQ(problems[1], "orb.level_count is 0; expected at least 1 and at most 16");
  EXPECT_EQ(problems[2], "mapper.window is 0; expected at least 1");
}

TEST_F(LoadOptionsTest, FileProblemsHasOneLineForEach) {
  ASSERT_TRUE(Load("mapper: {window: 0, min_parallax_deg: 0}\nodometry: off\n").ok());
  EXPECT_EQ(Join(FileProblems(file_)),
            "mapper.window is 0; expected at least 1\n"
            "mapper.min_parallax_deg is 0; expected more than 0 deg and less than 90 deg\n"
            "init is odometry while odometry is off; expected init visual, or odometry auto\n");
  EXPECT_EQ(Join(FileProblems(kConfigFolder / "default.yaml")), "");
  EXPECT_EQ(FileProblems(folder_.path() / "missing.yaml").size(), 1U);
}

TEST_F(LoadOptionsTest, NamesTheLineThatIsNotYaml) {
  ExpectMentions(Problem("orb:\n  feature_count: [1, 2\n"), {".yaml:", "YAML"});
}

TEST_F(LoadOptionsTest, WantsAMap) {
  ExpectMentions(Problem("- a\n- b\n"), {"map of keys"});
  ExpectMentions(Problem("just text\n"), {"map of keys"});
}

TEST_F(LoadOptionsTest, NamesFilesThatCannotBeRead) {
  const auto missing = LoadOptions(folder_.path() / "missing.yaml");
  ASSERT_FALSE(missing.ok());
  ExpectMentions(missing.error().message, {"missing.yaml", "cannot be read"});
  const auto folder = LoadOptions(folder_.path());
  ASSERT_FALSE(folder.ok()) << "a folder is no configuration file";
  ExpectMentions(folder.error().message, {folder_.path().string()});
}

// One assignment of each key with bounds that makes exactly one problem, and what is said of it.
TEST(PipelineOptions, ProblemsNameTheKeyAsTyped) {
  const std::pair<const char*, const char*> kWrong[] = {
      {"pixel_sigma=0", "pixel_sigma is 0; expected more than 0 px"},
      {"orb.feature_count=-3", "orb.feature_count is -3; expected at least 1"},
      {"initializer.min_features=2", "initializer.min_features is 2; expected at least 8"},
      {"initializer.min_parallax_deg=0",
       "initializer.min_parallax_deg is 0; expected more than 0 deg and less than 90 deg"},
      {"initializer.min_median_parallax_deg=90",
       "initializer.min_median_parallax_deg is 90; expected more than 0 deg and less than 90 deg"},
      {"tracker.keyframe_ratio=1.5", "tracker.keyframe_ratio is 1.5; expected more than 0 and less than 1"},
      {"tracker.min_inliers=3", "tracker.min_inliers is 3; expected at least tracker.min_inliers_odometry (12)"},
      {"tracker.min_inliers_rematch=0", "tracker.min_inliers_rematch is 0; expected at least 1"},
      {"tracker.nearby_distance=-1", "tracker.nearby_distance is -1; expected at least 0 m"},
      {"tracker.nearby_angle_deg=200", "tracker.nearby_angle_deg is 200; expected at least 0 deg and at most 180 deg"},
      {"tracker.keyframe_min_features=-1", "tracker.keyframe_min_features is -1; expected at least 0"},
      {"mapper.link_neighbors=-1", "mapper.link_neighbors is -1; expected at least 0"},
      {"mapper.fusion_neighbors=-1", "mapper.fusion_neighbors is -1; expected at least 0"},
      {"mapper.min_shared=0", "mapper.min_shared is 0; expected at least 1"},
      {"mapper.max_descriptor_distance=300",
       "mapper.max_descriptor_distance is 300; expected at least 0 and at most 256"},
      {"mapper.min_baseline_ratio=-0.1", "mapper.min_baseline_ratio is -0.1; expected at least 0"},
      {"mapper.nearby_distance=.inf", "mapper.nearby_distance is inf; expected at least 0 m"},
      {"mapper.window=0", "mapper.window is 0; expected at least 1"},
      {"mapper.wide_window=5", "mapper.wide_window is 5; expected at least mapper.window (10)"},
      {"mapper.young_map=-1", "mapper.young_map is -1; expected at least 0"},
      {"planar.sigma_height=0", "planar.sigma_height is 0; expected more than 0 m"},
      {"odometry_noise.along_per_sqrt_meter=-1",
       "odometry_noise.along_per_sqrt_meter is -1; expected at least 0 m / sqrt(m)"},
      {"mapping2d.resolution=0", "mapping2d.resolution is 0; expected more than 0 m"},
      {"mapping2d.tilt_sigma_deg=45", "mapping2d.tilt_sigma_deg is 45; expected at least 0 deg and less than 45 deg"},
      {"mapping2d.overhang_max_height=0.1",
       "mapping2d.overhang_max_height is 0.1; expected more than mapping2d.overhang_min_height (0.3 m)"},
      {"systematic.wheels=0", "systematic.wheels is 0; expected more than 0"},
      {"scale.keyframes=1", "scale.keyframes is 1; expected 0 or at least 3"},
      {"calibration.time_offset=1", "calibration.time_offset is 1; expected at least -0.5 s and at most 0.5 s"},
      {"calibration.camera_z=.nan", "calibration.camera_z is nan; expected a finite number"},
      {"mount.sigma_angle_deg=0", "mount.sigma_angle_deg is 0; expected more than 0 deg"},
      {"laser.min_share=1", "laser.min_share is 1; expected more than 0 and less than 1"},
      {"loop.min_inliers=3", "loop.min_inliers is 3; expected at least 12"},
      {"odometry=off", "init is odometry while odometry is off; expected init visual, or odometry auto"},
  };
  for (const auto& [assignment, problem] : kWrong) {
    const auto options = SetOption({}, assignment);
    ASSERT_TRUE(options.ok()) << options.error().message;
    EXPECT_EQ(Join(options->Problems()), std::string(problem) + "\n") << assignment;
  }
}

TEST(PipelineOptions, LimitsGivenInDegreesAreAllowed) {
  for (const std::string assignment : {"mapping2d.overhang_max_tilt_deg=45", "tracker.nearby_angle_deg=180"}) {
    EXPECT_EQ(Join(SetOption({}, assignment)->Problems()), "") << assignment;
  }
}

TEST(SetOption, NamesWhatAKeyIsCalledNow) {
  ExpectMentions(SetOption({}, "bundle.pixel_sigma=2").error().message,
                 {"bundle.pixel_sigma was renamed to pixel_sigma"});
  ExpectMentions(SetOption({}, "scale.wheel_sigma=2").error().message,
                 {"scale.wheel_sigma was renamed to systematic.wheels"});
  ExpectMentions(SetOption({}, "scale.laser_sigma=2").error().message,
                 {"scale.laser_sigma was renamed to systematic.laser"});
}

TEST(SetOption, SetsOneKeyAndLeavesTheRest) {
  const auto options = SetOption({}, "mapper.window=7");
  ASSERT_TRUE(options.ok()) << options.error().message;
  EXPECT_EQ(options->mapper.window, 7);
  PipelineOptions expected;
  expected.mapper.window = 7;
  EXPECT_EQ(OptionValues(*options), OptionValues(expected));
  const auto topic = SetOption({}, "topics.image=/camera/a=b");
  ASSERT_TRUE(topic.ok());
  EXPECT_EQ(topic->topics.image, "/camera/a=b") << "only the first = separates";
}

TEST(SetOption, NamesWhatIsWrong) {
  ExpectMentions(SetOption({}, "mapper.windwo=7").error().message, {"--set", "mapper.windwo", "unknown"});
  ExpectMentions(SetOption({}, "mapper.window").error().message, {"--set mapper.window", "key=value"});
  ExpectMentions(SetOption({}, "mapper.window=wide").error().message, {"mapper.window", "wide", "integer"});
  ExpectMentions(SetOption({}, "mapper.window=").error().message, {"mapper.window", "integer"});
  ExpectMentions(SetOption({}, "planar.mode=soft").error().message,
                 {"planar.mode", "soft", "off", "soft_se3", "se2_xyz", "hard"});
  ExpectMentions(SetOption({}, "=3").error().message, {"unknown"});
}

TEST(OptionValues, CanBeReadBackOneByOne) {
  for (const auto& [key, value] : OptionValues({})) {
    const auto options = SetOption({}, key + "=" + value);
    ASSERT_TRUE(options.ok()) << options.error().message;
    EXPECT_EQ(OptionValues(*options), OptionValues({})) << key;
  }
}

}  // namespace
}  // namespace planar_vslam
