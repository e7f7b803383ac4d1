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
  const auto in_file = OptionValues(*options), in_code = OptionValues({});
  ASSERT_EQ(in_file.size(), in_code.size());
  for (std::size_t i = 0; i < in_code.size(); ++i) EXPECT_EQ(in_file[i].second, in_code[i].second) << in_code[i].first;
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
  ExpectMentions(Problem("orb:\n  feature_cuont: 500\n"), {"orb.feature_cuont", "unknown"});
  ExpectMentions(Problem("trakcer:\n  min_inliers: 5\n"), {"trakcer.min_inliers", "unknown"});
  ExpectMentions(Problem("orb: 500\n"), {"'orb'", "unknown"});
}

TEST_F(LoadOptionsTest, NamesKeysOfTheWrongType) {
  ExpectMentions(Problem("orb: {feature_count: many}"), {"orb.feature_count", "many", "integer"});
  ExpectMentions(Problem("orb: {feature_count: 10.5}"), {"orb.feature_count", "10.5", "integer"});
  ExpectMentions(Problem("orb: {scale_factor: large}"), {"orb.scale_factor", "number"});
  ExpectMentions(Problem("orb: {scale_factor: }"), {"orb.scale_factor", "number"});
  ExpectMentions(Problem("orb: {scale_factor: [1, 2]}"), {"orb.scale_factor", "single value"});
  ExpectMentions(Problem("bundle: {use_odometry: 7}"), {"bundle.use_odometry", "true or false"});
  ExpectMentions(Problem("odometry: maybe"), {"'odometry'", "maybe", "auto", "required", "off"});
  ExpectMentions(Problem("odometry: {wheel: 1}"), {"odometry.wheel", "unknown"});
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

TEST(PipelineOptions, ProblemsNameSectionAndField) {
  const auto problem = [](const std::string& assignment) {
    const auto options = SetOption({}, assignment);
    return options.ok() ? Join(options->Problems()) : options.error().message;
  };
  ExpectMentions(problem("orb.feature_count=-3"), {"orb", "feature_count"});
  ExpectMentions(problem("tracker.keyframe_ratio=1.5"), {"tracker", "keyframe_ratio"});
  ExpectMentions(problem("mapper.window=0"), {"mapper", "window"});
  ExpectMentions(problem("planar.sigma_height=0"), {"planar", "sigma_height"});
  ExpectMentions(problem("odometry_noise.along_per_sqrt_meter=-1"), {"odometry_noise", "along_per_sqrt_meter"});
  ExpectMentions(problem("mapping2d.resolution=0"), {"mapping2d", "resolution"});
  ExpectMentions(problem("scale.keyframes=1"), {"scale", "keyframes"});
  ExpectMentions(problem("scale.max_sigma=0"), {"scale", "max_sigma"});
  ExpectMentions(problem("mount.sigma_angle_deg=0"), {"mount", "sigma_angle_deg"});
  ExpectMentions(problem("mapper.young_map=-1"), {"mapper", "young_map"});
  ExpectMentions(problem("mapper.wide_window=5"), {"mapper", "wide_window"});
  ExpectMentions(problem("mapper.wide_every=0"), {"mapper", "wide_every"});
  ExpectMentions(problem("odometry=off"), {"init", "visual"});
  ExpectMentions(problem("bundle.pixel_sigma=.nan"), {"bundle", "pixel_sigma"});
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
