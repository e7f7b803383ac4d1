#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>

#include "planar_vslam/mapping2d/map_builder.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

std::string Bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// One wall 2 m ahead of a laser that looks around.
MapBuilder SmallMap() {
  MapBuilder builder{MapBuilderOptions{}};
  std::vector<float> ranges;
  for (int i = -45; i <= 45; ++i) ranges.push_back(static_cast<float>(2.0 / std::cos(DegreesToRadians(i))));
  PosedScan scan;
  scan.T_map_laser.translation << 0.025, 0.025, 0.225;
  scan.angle_min = DegreesToRadians(-45.0);
  scan.angle_increment = DegreesToRadians(1.0);
  scan.range_max = 8.0;
  scan.ranges = &ranges;
  scan.level_height = 0.225;
  for (int i = 0; i < 5; ++i) builder.InsertScan(scan);
  return builder;
}

void ExpectWallAndRoom(const octomap::OcTree& tree) {
  const octomap::OcTreeNode* wall = tree.search(2.025, 0.025, 0.225);
  const octomap::OcTreeNode* room = tree.search(1.0, 0.025, 0.225);
  ASSERT_NE(wall, nullptr);
  ASSERT_NE(room, nullptr);
  EXPECT_TRUE(tree.isNodeOccupied(wall));
  EXPECT_FALSE(tree.isNodeOccupied(room));
  EXPECT_EQ(tree.search(2.5, 0.025, 0.225), nullptr);
  EXPECT_DOUBLE_EQ(tree.getResolution(), 0.05);
}

TEST(WriteOctomap, BinaryTreeIsReadByOctomap) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "map.bt";
  ASSERT_TRUE(SmallMap().WriteOctomap(path).ok());
  octomap::OcTree tree(1.0);
  ASSERT_TRUE(tree.readBinary(path.string()));
  ExpectWallAndRoom(tree);
}

TEST(WriteOctomap, FullTreeIsReadByOctomap) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "map.ot";
  ASSERT_TRUE(SmallMap().WriteOctomap(path).ok());
  const std::unique_ptr<octomap::AbstractOcTree> tree(octomap::AbstractOcTree::read(path.string()));
  ASSERT_NE(tree, nullptr);
  ExpectWallAndRoom(dynamic_cast<const octomap::OcTree&>(*tree));
}

TEST(WriteOctomap, EmptyMapIsReadableToo) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "map.bt";
  ASSERT_TRUE(MapBuilder{MapBuilderOptions{}}.WriteOctomap(path).ok());
  octomap::OcTree tree(1.0);
  ASSERT_TRUE(tree.readBinary(path.string()));
  EXPECT_EQ(tree.getNumLeafNodes(), 0U);
}

TEST(WriteOctomap, SameInputGivesTheSameBytes) {
  const test::TemporaryFolder folder;
  for (const char* name : {"a.bt", "b.bt", "a.ot", "b.ot"})
    ASSERT_TRUE(SmallMap().WriteOctomap(folder.path() / name).ok());
  EXPECT_EQ(Bytes(folder.path() / "a.bt"), Bytes(folder.path() / "b.bt"));
  EXPECT_EQ(Bytes(folder.path() / "a.ot"), Bytes(folder.path() / "b.ot"));
}

TEST(OctomapData, IsReadAsTheMessagesConversionsDo) {
  const MapBuilder builder = SmallMap();
  std::istringstream binary(builder.OctomapData(OctomapForm::kBinary)), full(builder.OctomapData(OctomapForm::kFull));
  octomap::OcTree from_binary(0.05), from_full(0.05);
  from_binary.readBinaryData(binary);
  from_full.readData(full);
  ExpectWallAndRoom(from_binary);
  ExpectWallAndRoom(from_full);
  EXPECT_GT(from_full.search(2.025, 0.025, 0.225)->getOccupancy(), 0.9) << "five hits";
  EXPECT_EQ(MapBuilder{MapBuilderOptions{}}.OctomapData(OctomapForm::kBinary), "");
  EXPECT_EQ(MapBuilder{MapBuilderOptions{}}.OctomapData(OctomapForm::kFull), "");
}

TEST(OccupiedCubes, AreTheOccupiedLeaves) {
  const std::vector<OccupiedCube> cubes = SmallMap().OccupiedCubes();
  ASSERT_FALSE(cubes.empty());
  bool wall = false;
  for (const OccupiedCube& cube : cubes) {
    EXPECT_GE(cube.size, 0.0499F);
    const Eigen::Vector3f offset = (cube.center - Eigen::Vector3f(2.025F, 0.025F, 0.225F)).cwiseAbs();
    wall = wall || offset.maxCoeff() <= 0.5F * cube.size;
    EXPECT_GT(cube.center.x(), 1.3F) << "the room is free";
  }
  EXPECT_TRUE(wall);
  EXPECT_TRUE(MapBuilder{MapBuilderOptions{}}.OccupiedCubes().empty());
}

TEST(WriteOctomap, UnwritableFileIsNamed) {
  const test::TemporaryFolder folder;
  const auto written = SmallMap().WriteOctomap(folder.path() / "absent" / "map.bt");
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().message.find("absent"), std::string::npos);
}

// The fields of a point in a binary PCD, in the order the header gives them.
std::vector<float> FirstPoint(const std::string& pcd, std::size_t fields) {
  const std::string marker = "DATA binary\n";
  const std::size_t begin = pcd.find(marker) + marker.size();
  std::vector<float> values(fields);
  std::memcpy(values.data(), pcd.data() + begin, fields * sizeof(float));
  return values;
}

TEST(WritePcd, HeaderAndPointsAreThere) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "points.pcd";
  const CloudPoint seen_from_below{{1.0F, 2.0F, 3.0F}, {0.0F, 0.0F, -1.0F}, 7.0F};
  const CloudPoint seen_from_left{{4.0F, 5.0F, 6.0F}, {0.0F, 1.0F, 0.0F}, 1.0F};
  const std::vector<CloudPoint> cloud = {seen_from_below, seen_from_left};
  ASSERT_TRUE(WritePcd(cloud, path).ok());
  const std::string pcd = Bytes(path);
  EXPECT_NE(pcd.find("POINTS 2\n"), std::string::npos);
  const std::size_t fields = pcd.find("FIELDS ");
  ASSERT_NE(fields, std::string::npos);
  for (const char* field : {" x", " y", " z", " normal_x", " normal_y", " normal_z", " intensity"}) {
    EXPECT_NE(pcd.find(field, fields), std::string::npos) << field;
  }
  const std::vector<float> first = FirstPoint(pcd, 3);
  EXPECT_EQ(first, (std::vector<float>{1.0F, 2.0F, 3.0F}));
}

TEST(WritePcd, EmptyCloudIsAFileWithoutPoints) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(WritePcd({}, folder.path() / "points.pcd").ok());
  EXPECT_NE(Bytes(folder.path() / "points.pcd").find("POINTS 0\n"), std::string::npos);
}

TEST(WritePcd, UnwritableFileIsNamed) {
  const test::TemporaryFolder folder;
  const auto written = WritePcd({CloudPoint{}}, folder.path() / "absent" / "points.pcd");
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().message.find("absent"), std::string::npos);
}

TEST(WritePly, HeaderAndPointsAreThere) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "points.ply";
  ASSERT_TRUE(WritePly({{{1.0F, 2.0F, 3.0F}, {0.0F, 0.0F, -1.0F}, 7.0F}, CloudPoint{}}, path).ok());
  const std::string ply = Bytes(path);
  EXPECT_EQ(ply.rfind("ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\n", 0), 0U);
  const std::string marker = "end_header\n";
  const std::size_t begin = ply.find(marker) + marker.size();
  std::vector<float> first(7);
  ASSERT_EQ(ply.size(), begin + 2 * first.size() * sizeof(float));
  std::memcpy(first.data(), ply.data() + begin, first.size() * sizeof(float));
  EXPECT_EQ(first, (std::vector<float>{1.0F, 2.0F, 3.0F, 0.0F, 0.0F, -1.0F, 7.0F}));
}

TEST(WritePly, EmptyCloudIsAFileWithoutPoints) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(WritePly({}, folder.path() / "points.ply").ok());
  EXPECT_NE(Bytes(folder.path() / "points.ply").find("element vertex 0\n"), std::string::npos);
}

TEST(WritePly, UnwritableFileIsNamed) {
  const test::TemporaryFolder folder;
  const auto written = WritePly({CloudPoint{}}, folder.path() / "absent" / "points.ply");
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().message.find("absent"), std::string::npos);
}

TEST(VoxelFiltered, OnePointACubeWithMeanAndSum) {
  std::vector<CloudPoint> cloud(3);
  cloud[0] = {{0.01F, 0.01F, -0.01F}, {0.0F, 0.0F, 1.0F}, 3.0F};
  cloud[1] = {{0.03F, 0.03F, -0.03F}, {1.0F, 0.0F, 0.0F}, 4.0F};
  cloud[2] = {{0.03F, 0.03F, 0.03F}, {1.0F, 0.0F, 0.0F}, 5.0F};
  const std::vector<CloudPoint> filtered = VoxelFiltered(cloud, 0.1);
  ASSERT_EQ(filtered.size(), 2U);
  EXPECT_LT((filtered[0].position - Eigen::Vector3f(0.02F, 0.02F, -0.02F)).norm(), 1e-6F);
  EXPECT_NEAR(filtered[0].normal.norm(), 1.0F, 1e-6F);
  EXPECT_EQ(filtered[0].intensity, 7.0F);
  EXPECT_EQ(filtered[1].intensity, 5.0F);
  EXPECT_TRUE(VoxelFiltered({}, 0.1).empty());
}

TEST(EstimateNormals, PlaneGivesItsNormalTowardsTheCameraAndLonelyPointsKeepTheirs) {
  std::vector<CloudPoint> cloud;
  const Eigen::Vector3f to_camera = Eigen::Vector3f(0.6F, 0.0F, -0.8F);
  for (int x = 0; x < 5; ++x) {
    for (int y = 0; y < 5; ++y) {
      cloud.push_back(
          {Eigen::Vector3f(0.1F * static_cast<float>(x), 0.1F * static_cast<float>(y), 2.0F), to_camera, 1.0F});
    }
  }
  cloud.push_back({Eigen::Vector3f(5.0F, 5.0F, 1.0F), to_camera, 1.0F});
  EstimateNormals(0.25, &cloud);
  for (std::size_t i = 0; i < 25; ++i) EXPECT_LT((cloud[i].normal + Eigen::Vector3f::UnitZ()).norm(), 1e-3F) << i;
  EXPECT_EQ(cloud.back().normal, to_camera);
}

TEST(RadiusInliers, LonelyPointsGo) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {9, 9, 9}, {0.1, 0, 0}, {0, 0.1, 0}, {5, 0, 0}, {5.1, 0, 0}};
  EXPECT_EQ(RadiusInliers(points, 0.3, 2), (std::vector<int>{0, 2, 3}));
  EXPECT_EQ(RadiusInliers(points, 0.3, 1), (std::vector<int>{0, 2, 3, 4, 5}));
  EXPECT_EQ(RadiusInliers(points, 0.3, 0).size(), points.size());
  EXPECT_TRUE(RadiusInliers({}, 0.3, 2).empty());
}

}  // namespace
}  // namespace planar_vslam
