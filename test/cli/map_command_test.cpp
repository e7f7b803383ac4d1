// `planar_vslam map ...` and `run --save-map`, as a user calls them.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>

#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/mapping2d/grid.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

std::string Bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool Contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

CameraModel TestCamera() {
  CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 500.0;
  camera.cx = 320.0, camera.cy = 240.0;
  return camera;
}

constexpr std::uint32_t kKeyframes = 6;
constexpr std::uint32_t kLandmarks = 25;

// A robot drives 1 m along a wall on its left, 2 m away, which has points at 0.2 to 1 m height.
Map WallMap(bool metric) {
  Map map;
  map.octave_scales = {1.0, 1.2};
  map.metric = metric;
  Rigid3 T_base_camera;  // looks left
  T_base_camera.rotation = Eigen::Quaterniond((Eigen::Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished());
  T_base_camera.translation.z() = 0.5;
  std::vector<Landmark> landmarks(kLandmarks);
  for (std::uint32_t k = 0; k < kLandmarks; ++k) {
    landmarks[k].p_map = {0.125 + 0.15 * (k % 5), 2.025, 0.2 + 0.2 * (k / 5)};
    landmarks[k].created_by = KeyframeId{0};
  }
  MapEdit edit;
  for (std::uint32_t i = 0; i < kKeyframes; ++i) {
    Keyframe keyframe;
    keyframe.stamp.nanoseconds = 500'000'000LL * i;
    keyframe.T_map_base.translation.x() = 0.2 * i;
    keyframe.T_base_camera = T_base_camera;
    auto features = std::make_shared<FrameFeatures>();
    features->keypoints.resize(kLandmarks);
    features->descriptors.resize(kLandmarks);
    for (std::uint32_t k = 0; k < kLandmarks; ++k) {
      const Eigen::Vector3d p_camera = keyframe.T_map_camera().Inverse() * landmarks[k].p_map;
      features->keypoints[k].pixel = TestCamera().ProjectUndistorted(p_camera).cast<float>();
      features->descriptors[k] = {k, 0, 0, 0};
      landmarks[k].observations.push_back({KeyframeId{i}, k});
    }
    features->grid = ImageGrid(features->keypoints);
    keyframe.features = features;
    keyframe.landmarks.resize(kLandmarks);
    edit.push_back(AddKeyframe{KeyframeId{i}, keyframe});
  }
  for (std::uint32_t k = 0; k < kLandmarks; ++k) edit.push_back(AddLandmark{LandmarkId{k}, landmarks[k]});
  return Apply(std::move(map), edit);
}

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

class MapCommand : public ::testing::Test {
 protected:
  MapCommand() {
    EXPECT_TRUE(SaveMapFile(WallMap(true), TestCamera(), map_).ok());
    EXPECT_TRUE(SaveMapFile(WallMap(false), TestCamera(), unscaled_).ok());
  }

  Outcome Call(const std::string& arguments) const {
    const fs::path err = folder_.path() / "stderr.txt";
    Outcome outcome;
    FILE* pipe = ::popen((test::Executable() + " " + arguments + " 2>" + err.string()).c_str(), "r");
    if (pipe == nullptr) return outcome;
    std::array<char, 4096> buffer{};
    while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe))
      outcome.out.append(buffer.data(), size);
    const int status = ::pclose(pipe);
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    outcome.err = Bytes(err);
    return outcome;
  }
  // The call fails with `exit_code` and one line on stderr that has `part` in it.
  Outcome ExpectFailure(const std::string& arguments, int exit_code, const std::string& part) const {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments;
    EXPECT_TRUE(Contains(outcome.err, part)) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    return outcome;
  }
  std::string At(const std::string& name) const { return (folder_.path() / name).string(); }
  // A saved map with one byte of its last section changed.
  std::string Damaged() const {
    std::string bytes = Bytes(map_);
    bytes.back() = static_cast<char>(~bytes.back());
    std::ofstream(At("damaged.pvm"), std::ios::binary) << bytes;
    return At("damaged.pvm");
  }

  TemporaryFolder folder_;
  fs::path map_ = folder_.path() / "map.pvm";
  fs::path unscaled_ = folder_.path() / "unscaled.pvm";
};

TEST_F(MapCommand, InfoCountsWhatIsThere) {
  const Outcome text = Call("map info " + map_.string());
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_TRUE(Contains(text.out, "keyframes        6, over 2.5 s and 1.00 m\n")) << text.out;
  EXPECT_TRUE(Contains(text.out, "landmarks        25, observed 150 times\n")) << text.out;
  const Outcome json = Call("map info --json " + map_.string());
  EXPECT_EQ(json.exit_code, 0);
  for (const std::string& part :
       {std::string("\"metric\": true"), std::string("\"keyframes\": 6"), std::string("\"landmarks\": 25"),
        std::string("\"observations\": 150"), std::string("\"span_seconds\": 2.5"),
        "\"bytes\": " + std::to_string(fs::file_size(map_))}) {
    EXPECT_TRUE(Contains(json.out, part)) << part << " in " << json.out;
  }
  EXPECT_TRUE(Contains(Call("map info --json " + unscaled_.string()).out, "\"metric\": false"));
}

TEST_F(MapCommand, InfoOfAnEmptyMapHasNoExtent) {
  ASSERT_TRUE(SaveMapFile(Map(), TestCamera(), map_).ok());
  const Outcome json = Call("map info --json " + map_.string());
  EXPECT_EQ(json.exit_code, 0);
  EXPECT_TRUE(Contains(json.out, "\"landmark_extent\": null")) << json.out;
}

TEST_F(MapCommand, CheckTellsSoundFromDamaged) {
  EXPECT_EQ(Call("map check " + map_.string()).exit_code, 0);
  const std::string damaged = Damaged();
  EXPECT_TRUE(Contains(ExpectFailure("map check " + damaged, 1, damaged).out, "section SCAN"));
  ExpectFailure("map check " + At("absent.pvm"), 2, "absent.pvm");
}

TEST_F(MapCommand, UnreadableMapsAreNamedInOneLine) {
  const std::string damaged = Damaged();
  ExpectFailure("map info " + damaged, 2, damaged);
  ExpectFailure("map export " + damaged + " --tum " + At("t.txt"), 2, damaged);
  EXPECT_FALSE(fs::exists(At("t.txt")));
}

TEST_F(MapCommand, ExportWritesEveryFormat) {
  const Outcome outcome =
      Call("map export " + map_.string() + " --pcd " + At("a.pcd") + " --ply " + At("a.ply") + " --tum " + At("a.txt") +
           " --octomap " + At("a.bt") + " --pgm " + At("a.pgm") + " --yaml " + At("a.yaml"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(Contains(Bytes(At("a.pcd")), "POINTS 25\n"));
  EXPECT_TRUE(Contains(Bytes(At("a.ply")), "element vertex 25\n"));
  EXPECT_EQ(Bytes(At("a.bt")).rfind("# Octomap OcTree binary file", 0), 0U);
  const Expected<Trajectory> keyframes = ReadTrajectory(At("a.txt"));
  ASSERT_TRUE(keyframes.ok()) << keyframes.error().message;
  ASSERT_EQ(keyframes->size(), kKeyframes);
  EXPECT_NEAR(keyframes->back().T_map_base.translation.x(), 1.0, 1e-9);
  const Expected<OccupancyGrid2d> grid = ReadMapServerFiles(At("a.yaml"));
  ASSERT_TRUE(grid.ok()) << grid.error().message;
  const auto cell = [&grid](double x, double y) {
    return grid->At(static_cast<int>((x - grid->origin.x()) / grid->resolution),
                    static_cast<int>((y - grid->origin.y()) / grid->resolution));
  };
  EXPECT_EQ(cell(0.42, 2.02), 100);  // the wall
  EXPECT_EQ(cell(0.42, 1.92), 0);    // seen through from all keyframes
  EXPECT_EQ(cell(1.02, 0.02), 0);    // driven over
}

TEST_F(MapCommand, EitherNameOfTheGridWritesBothFiles) {
  ASSERT_EQ(Call("map export " + map_.string() + " --pgm " + At("a.pgm")).exit_code, 0);
  ASSERT_EQ(Call("map export " + map_.string() + " --yaml " + At("b.yaml") + " --octomap " + At("b.ot")).exit_code, 0);
  EXPECT_TRUE(ReadMapServerFiles(At("a.yaml")).ok());
  EXPECT_EQ(Bytes(At("a.pgm")), Bytes(At("b.pgm")));
  EXPECT_EQ(Bytes(At("b.ot")).rfind("# Octomap OcTree file", 0), 0U);
}

TEST_F(MapCommand, InfoSaysFromWhereTheMapCanBeLocalisedIn) {
  const std::string picture = " --coverage " + At("coverage.svg");
  const Outcome text = Call("map info " + map_.string() + picture);
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_TRUE(Contains(text.out, "coverage         0.0 % of ")) << "25 landmarks are too few: " << text.out;
  EXPECT_TRUE(Contains(Bytes(At("coverage.svg")), "</svg>"));
  EXPECT_TRUE(Contains(Call("map info --json " + map_.string() + picture).out, "\"coverage\": {\"places\": "));
  ExpectFailure("map info " + unscaled_.string() + picture, 1,
                "planar_vslam: " + unscaled_.string() + ": scale unknown");
  const std::string info = "map info " + map_.string() + " --coverage ";
  ExpectFailure(info + At("absent/a.svg"), 1, "planar_vslam: " + At("absent/a.svg"));
  ExpectFailure(info + At("a.png"), 2,
                "planar_vslam: --coverage " + At("a.png") + ": expected a name that ends in .svg");
}

TEST_F(MapCommand, MergeSaysInOneLineWhyItRefuses) {
  CameraModel other = TestCamera();
  other.fx += 5.0;
  ASSERT_TRUE(SaveMapFile(WallMap(true), other, At("other.pvm")).ok());
  const std::string one = map_.string(), out = " -o " + At("merged.pvm"), octaves = " --quiet --set orb.level_count=2";
  ExpectFailure("map merge " + one, 2, "second");
  ExpectFailure("map merge " + one + " " + At("absent.pvm") + out + octaves, 2, "absent.pvm");
  ExpectFailure("map merge " + one + " " + one + out, 2, "orb.level_count");
  ExpectFailure("map merge " + one + " " + unscaled_.string() + out + octaves, 2, "scale unknown");
  ExpectFailure("map merge " + one + " " + At("other.pvm") + out + octaves, 2, "another camera");
  ExpectFailure("map merge " + one + " " + one + out + octaves, 1, "0 places");  // too few landmarks in a view
  EXPECT_FALSE(fs::exists(At("merged.pvm")));
}

TEST_F(MapCommand, BadArgumentsAreNamed) {
  const std::string map = map_.string();
  ExpectFailure("map", 2, "subcommand");
  ExpectFailure("map export " + map, 2, "--tum");
  ExpectFailure("map export " + map + " --octomap " + At("a.txt"), 2, ".bt or .ot");
  ExpectFailure("map export " + map + " --pgm " + At("a.png"), 2, ".pgm");
  ExpectFailure("map export " + map + " --pgm " + At("a.pgm") + " --yaml " + At("b.yaml"), 2, "b.yaml");
  ExpectFailure("map export " + map + " --ply " + At("absent/a.ply"), 1, "absent");
}

TEST_F(MapCommand, AnUnscaledMapGivesPointsButNoGrid) {
  EXPECT_EQ(Call("map export " + unscaled_.string() + " --pcd " + At("a.pcd")).exit_code, 0);
  for (const std::string& option : {"--octomap " + At("a.bt"), "--yaml " + At("a.yaml")}) {
    ExpectFailure("map export " + unscaled_.string() + " " + option, 1, "scale unknown");
  }
}

TEST_F(MapCommand, ExportNamesAMisspeltKeyOfItsConfiguration) {
  std::ofstream(At("wrong.yaml")) << "mapping2d: {resolutoin: 0.1}\n";
  ExpectFailure("map export " + map_.string() + " --yaml " + At("a.yaml") + " --config " + At("wrong.yaml"), 2,
                "mapping2d.resolutoin");
}

TEST_F(MapCommand, RunSavesItsMap) {
  const std::optional<fs::path> sequence = SequenceFolder("dev_lab");
  if (!sequence.has_value()) GTEST_SKIP() << "sequence dev_lab is not on this machine";
  const Outcome run = Call("run " + sequence->string() + " --out " + At("out") + " --save-map " + At("kept/final.pvm") +
                           " --until 4 --deterministic --quiet");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Bytes(At("out/map.pvm")), Bytes(At("kept/final.pvm")));
  ASSERT_EQ(Call("map export " + At("out/map.pvm") + " --tum " + At("keyframes.txt")).exit_code, 0);
  EXPECT_EQ(Bytes(At("keyframes.txt")), Bytes(At("out/keyframes.txt")));
}

TEST_F(MapCommand, RunWithoutAMapSaysSo) {
  const std::optional<fs::path> sequence = SequenceFolder("dev_lab");
  if (!sequence.has_value()) GTEST_SKIP() << "sequence dev_lab is not on this machine";
  const std::string run = "run " + sequence->string() + " --out " + At("out") + " --until 0.1 --quiet --save-map ";
  ExpectFailure(run + At("final.pvm"), 1, "final.pvm: not saved");
  ExpectFailure(run + folder_.path().string(), 2, "expected a file name");
}

}  // namespace
}  // namespace planar_vslam::test
