#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "planar_vslam/mapping2d/grid.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kYaml =
    "image: map.pgm\nresolution: 0.1\norigin: [-1.5, 2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
const std::string kPgm = std::string("P5\n3 2\n255\n") + '\xFE' + '\xCD' + '\0' + '\0' + '\xFE' + '\xFE';

std::string WithLine(const std::string& key, const std::string& line) {
  std::string yaml = kYaml;
  const std::size_t begin = yaml.find(key + ":"), end = yaml.find('\n', begin);
  return yaml.replace(begin, end - begin, line);
}

std::string Bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

class GridFiles : public ::testing::Test {
 protected:
  Expected<OccupancyGrid2d> Read(const std::string& yaml, const std::string& pgm) const {
    std::ofstream(folder_.path() / "map.yaml", std::ios::binary) << yaml;
    std::ofstream(folder_.path() / "map.pgm", std::ios::binary) << pgm;
    return ReadMapServerFiles(folder_.path() / "map.yaml");
  }

  void ExpectError(const Expected<OccupancyGrid2d>& grid, const std::string& file, const std::string& what) const {
    ASSERT_FALSE(grid.ok()) << what;
    const std::string& message = grid.error().message;
    EXPECT_NE(message.find((folder_.path() / file).string()), std::string::npos) << message;
    EXPECT_NE(message.find(what), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }

  test::TemporaryFolder folder_;
};

TEST_F(GridFiles, ReadsMapServersConventions) {
  const auto grid = Read(kYaml, kPgm);
  ASSERT_TRUE(grid.ok()) << grid.error().message;
  EXPECT_EQ(grid->width, 3);
  EXPECT_EQ(grid->height, 2);
  EXPECT_DOUBLE_EQ(grid->resolution, 0.1);
  EXPECT_EQ(grid->origin, Eigen::Vector2d(-1.5, 2.0));
  // The image's last row is the grid's first.
  EXPECT_EQ(grid->cells, (std::vector<std::int8_t>{100, 0, 0, 0, -1, 100}));
}

TEST_F(GridFiles, NegateTurnsGreyAround) {
  const auto grid = Read(WithLine("negate", "negate: 1"), kPgm);
  ASSERT_TRUE(grid.ok()) << grid.error().message;
  EXPECT_EQ(grid->cells, (std::vector<std::int8_t>{0, 100, 100, 100, 100, 0}));
}

TEST_F(GridFiles, ReadsTextPgmWithCommentsAndItsOwnWhite) {
  const auto grid = Read(kYaml, "P2 # a map\n# drawn by hand\n3 2\n10\n10 8 0\n0 10 10\n");
  ASSERT_TRUE(grid.ok()) << grid.error().message;
  EXPECT_EQ(grid->cells, (std::vector<std::int8_t>{100, 0, 0, 0, -1, 100}));
}

TEST_F(GridFiles, RoundTripKeepsEverything) {
  OccupancyGrid2d grid{3, 2, 0.05, {-3.15, 0.1}, {0, 100, -1, -1, 0, 100}};
  const fs::path path = folder_.path() / "a map.yaml";
  ASSERT_TRUE(WriteMapServerFiles(grid, path).ok());
  const auto back = ReadMapServerFiles(path);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->width, grid.width);
  EXPECT_EQ(back->height, grid.height);
  EXPECT_EQ(back->cells, grid.cells);
  EXPECT_NEAR(back->resolution, grid.resolution, 1e-12);
  EXPECT_NEAR((back->origin - grid.origin).norm(), 0.0, 1e-9);
}

TEST_F(GridFiles, WritesWhatMapServerExpects) {
  const OccupancyGrid2d grid{2, 1, 0.05, {0.0, 0.0}, {100, 0}};
  ASSERT_TRUE(WriteMapServerFiles(grid, folder_.path() / "map.yaml").ok());
  EXPECT_EQ(Bytes(folder_.path() / "map.pgm"), std::string("P5\n2 1\n255\n") + '\0' + '\xFE');
  EXPECT_EQ(Bytes(folder_.path() / "map.yaml"),
            "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
            "free_thresh: 0.196\n");
}

TEST_F(GridFiles, EmptyGridIsWrittenAsOneUnknownCell) {
  ASSERT_TRUE(WriteMapServerFiles(OccupancyGrid2d{}, folder_.path() / "map.yaml").ok());
  const auto back = ReadMapServerFiles(folder_.path() / "map.yaml");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->cells, std::vector<std::int8_t>{-1});
}

TEST_F(GridFiles, WritingIntoAMissingFolderNamesTheFile) {
  const OccupancyGrid2d grid{1, 1, 0.05, {0.0, 0.0}, {0}};
  const auto written = WriteMapServerFiles(grid, folder_.path() / "absent" / "map.yaml");
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().message.find("absent"), std::string::npos);
}

TEST_F(GridFiles, BadYamlNamesFileAndKey) {
  ExpectError(ReadMapServerFiles(folder_.path() / "absent.yaml"), "absent.yaml", "cannot be read");
  for (const std::string key : {"image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"}) {
    ExpectError(Read(WithLine(key, ""), kPgm), "map.yaml", key + ": missing");
  }
  ExpectError(Read(WithLine("resolution", "resolution: fine"), kPgm), "map.yaml", "resolution");
  ExpectError(Read(WithLine("resolution", "resolution: 0"), kPgm), "map.yaml", "resolution");
  ExpectError(Read(WithLine("resolution", "resolution: .nan"), kPgm), "map.yaml", "resolution");
  ExpectError(Read(WithLine("origin", "origin: [0, 0, 0.3]"), kPgm), "map.yaml", "yaw 0");
  ExpectError(Read(WithLine("origin", "origin: [0, 0]"), kPgm), "map.yaml", "origin");
  ExpectError(Read(WithLine("origin", "origin: [.inf, 0, 0]"), kPgm), "map.yaml", "origin");
  ExpectError(Read(WithLine("negate", "negate: 2"), kPgm), "map.yaml", "negate");
  ExpectError(Read(WithLine("free_thresh", "free_thresh: 0.9"), kPgm), "map.yaml", "free_thresh");
  ExpectError(Read(std::string(kYaml) + "mode: raw\n", kPgm), "map.yaml", "mode");
  ExpectError(Read("image: [unclosed\n", kPgm), "map.yaml", "not yaml");
  ExpectError(Read("just words\n", kPgm), "map.yaml", "expected the keys");
  ExpectError(Read("", kPgm), "map.yaml", "expected the keys");
}

TEST_F(GridFiles, BadImageNamesTheImage) {
  ExpectError(Read(WithLine("image", "image: other.pgm"), kPgm), "other.pgm", "cannot be read");
  ExpectError(Read(WithLine("image", "image: ."), kPgm), "", "cannot be read");
  ExpectError(Read(kYaml, "P6\n3 2\n255\n"), "map.pgm", "P5 or P2");
  ExpectError(Read(kYaml, ""), "map.pgm", "P5 or P2");
  ExpectError(Read(kYaml, kPgm.substr(0, kPgm.size() - 1)), "map.pgm", "pixels end early");
  ExpectError(Read(kYaml, "P2\n3 2\n255\n0 0 0 0 0"), "map.pgm", "pixels end early");
  ExpectError(Read(kYaml, "P2\n3 2\n255\n0 0 0 0 0 x"), "map.pgm", "pixels end early");
  ExpectError(Read(kYaml, "P2\n1 1\n10\n11 "), "map.pgm", "brighter");
  ExpectError(Read(kYaml, "P5\n0 2\n255\n"), "map.pgm", "width");
  ExpectError(Read(kYaml, "P5\n3 -2\n255\n"), "map.pgm", "height");
  ExpectError(Read(kYaml, "P5\n99999999999999999999 2\n255\n"), "map.pgm", "width");
  ExpectError(Read(kYaml, "P5\n3 2\n65535\n"), "map.pgm", "grey");
  ExpectError(Read(kYaml, "P5\n3 2"), "map.pgm", "grey");
  ExpectError(Read(kYaml, "P5\n32768 32768\n255\n"), "map.pgm", "pixels end early");
}

}  // namespace
}  // namespace planar_vslam
