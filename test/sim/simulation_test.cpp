#include "planar_vslam/sim/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "planar_vslam/sim/dataset_writer.h"
#include "sim_fixtures.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

Simulation SmallSimulation(std::uint64_t seed, double until) {
  const World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  SimulationOptions options;
  options.seed = seed;
  options.until = until;
  return Simulation::Create(world, options).value();
}

std::string Contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// All files below a folder by relative name.
std::map<std::string, std::string> AllFiles(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = Contents(entry.path());
  }
  return files;
}

TEST(Simulation, StreamsEventsInTimeOrderAtTheirRates) {
  Simulation simulation = SmallSimulation(1, 1.0);
  std::map<std::size_t, int> counts;
  Timestamp last{-1};
  std::size_t last_kind = 0;
  while (const std::optional<SimulatedEvent> event = simulation.Next()) {
    EXPECT_LE(last, StampOf(*event));
    const std::size_t kind = event->measurement.index();
    if (last == StampOf(*event)) {
      EXPECT_NE(kind, 1u) << "odometry comes first";
      EXPECT_NE(last_kind, 0u) << "the image comes last";
    }
    ++counts[kind];
    last = StampOf(*event);
    last_kind = kind;
  }
  EXPECT_EQ(counts[0], 11) << "images at 0, 0.1, ..., 1.0";
  EXPECT_EQ(counts[1], 51);
  EXPECT_EQ(counts[2], 6);
}

TEST(Simulation, TruthIsTheDriveAndTheShakeStaysSmall) {
  Simulation simulation = SmallSimulation(1, 1.5);
  int shaken = 0;
  while (const std::optional<SimulatedEvent> event = simulation.Next()) {
    const Rigid3 expected = Embed3(simulation.drive().At(StampOf(*event).Seconds()));
    EXPECT_LT((event->T_world_base.translation - expected.translation).norm(), 1e-12);
    const auto* frame = std::get_if<CameraFrame>(&event->measurement);
    if (frame == nullptr) continue;
    const Rigid3 nominal = event->T_world_base * frame->T_base_camera;
    EXPECT_LT((nominal.translation - event->T_world_camera.translation).norm(), 1e-12);
    const double angle = LogSo3(nominal.rotation.conjugate() * event->T_world_camera.rotation).norm();
    EXPECT_LT(angle, DegreesToRadians(1.0));
    shaken += angle > DegreesToRadians(0.01) ? 1 : 0;
    EXPECT_EQ(frame->image.image.width, 160);
  }
  EXPECT_GT(shaken, 5);
}

TEST(Simulation, CanLeaveTheImagesOut) {
  const World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
  SimulationOptions options;
  options.render = false;
  options.until = 0.05;
  Simulation simulation = Simulation::Create(world, options).value();
  int images = 0;
  while (const std::optional<SimulatedEvent> event = simulation.Next()) {
    if (const auto* frame = std::get_if<CameraFrame>(&event->measurement)) {
      EXPECT_TRUE(frame->image.image.empty());
      ++images;
    }
  }
  EXPECT_EQ(images, 1);
}

TEST(Simulation, RefusesAnImpossibleWorld) {
  World world = test::BareRoom();
  world.source = "here";
  world.room.size.x() = 0.0;
  EXPECT_EQ(
      Simulation::Create(world, {}).error().message.rfind("here: room.size: expected 1 to 100 m along x, got 0", 0),
      0u);
}

TEST(Dataset, SameSeedSameBytesOtherSeedOtherBytes) {
  const test::TemporaryFolder folder;
  for (const auto& [name, seed] : {std::pair("a", 7), std::pair("b", 7), std::pair("c", 8)}) {
    Simulation simulation = SmallSimulation(static_cast<std::uint64_t>(seed), 0.5);
    ASSERT_TRUE(WriteDataset(simulation, folder.path() / name).ok());
  }
  const auto a = AllFiles(folder.path() / "a"), b = AllFiles(folder.path() / "b"), c = AllFiles(folder.path() / "c");
  EXPECT_TRUE(a == b);
  for (const char* name : {"images/000003.jpg", "odometry.csv", "scan.csv", "groundtruth_camera.txt"}) {
    EXPECT_NE(a.at(name), c.at(name)) << name;
  }
  for (const char* name : {"calibration.yaml", "groundtruth_base.txt", "groundtruth_grid.pgm", "images.csv"}) {
    EXPECT_EQ(a.at(name), c.at(name)) << name;
  }
}

TEST(Dataset, HasTheFilesOfTheLayout) {
  const test::TemporaryFolder folder;
  Simulation simulation = SmallSimulation(1, 0.4);
  const Expected<DatasetCounts> counts = WriteDataset(simulation, folder.path());
  ASSERT_TRUE(counts.ok()) << counts.error().message;
  EXPECT_EQ(counts->images, 5);
  EXPECT_EQ(counts->odometry_readings, 21);
  EXPECT_EQ(counts->scans, 3);
  const auto files = AllFiles(folder.path());
  const auto lines = [&files](const char* name) {
    return std::count(files.at(name).begin(), files.at(name).end(), '\n');
  };
  EXPECT_EQ(files.at("images.csv").rfind("#t,file\n0.000000,images/000000.jpg\n0.100000,images/000001.jpg\n", 0), 0u);
  EXPECT_EQ(lines("images.csv"), 6);
  EXPECT_EQ(lines("odometry.csv"), 22);
  EXPECT_EQ(lines("scan.csv"), 3);
  EXPECT_EQ(lines("groundtruth_base.txt"), 6);
  EXPECT_EQ(lines("groundtruth_camera.txt"), 6);
  for (const char* name : {"groundtruth_grid.pgm", "groundtruth_grid.yaml", "groundtruth_grid_laser.pgm",
                           "groundtruth_grid_laser.yaml", "calibration.yaml", "images/000004.jpg"}) {
    EXPECT_EQ(files.count(name), 1u) << name;
  }
  const std::string scan = files.at("scan.csv").substr(0, files.at("scan.csv").find('\n'));
  EXPECT_EQ(std::count(scan.begin(), scan.end(), ','), 541);
}

TEST(Dataset, WithoutImagesTheRestIsTheSame) {
  const test::TemporaryFolder folder;
  for (const bool render : {true, false}) {
    SimulationOptions options;
    options.until = 0.4;
    options.render = render;
    Simulation simulation = Simulation::Create(*ParseWorld(test::SmallWorldYaml(), "small.yaml"), options).value();
    ASSERT_TRUE(WriteDataset(simulation, folder.path() / (render ? "all" : "rest")).ok());
  }
  const auto all = AllFiles(folder.path() / "all"), rest = AllFiles(folder.path() / "rest");
  EXPECT_EQ(rest.count("images.csv"), 0u);
  EXPECT_EQ(rest.size() + 6, all.size()) << "images.csv and five images";
  for (const auto& [name, bytes] : rest) EXPECT_EQ(bytes, all.at(name)) << name;
}

TEST(Dataset, OfARobotWithoutLaserHasNothingOfOne) {
  const test::TemporaryFolder scratch;
  const fs::path& folder = scratch.path();
  for (const LaserKind kind : {LaserKind::kFull, LaserKind::kNone}) {
    World world = *ParseWorld(test::SmallWorldYaml(), "small.yaml");
    world.laser.kind = kind;
    SimulationOptions options;
    options.until = 0.5;
    options.render = false;
    Simulation simulation = Simulation::Create(world, options).value();
    const Expected<DatasetCounts> counts = WriteDataset(simulation, folder);
    ASSERT_TRUE(counts.ok()) << counts.error().message;
    const bool has_laser = kind != LaserKind::kNone;
    EXPECT_EQ(counts->scans > 0, has_laser);
    EXPECT_EQ(fs::exists(folder / "scan.csv"), has_laser);
    EXPECT_EQ(fs::exists(folder / "groundtruth_grid_laser.yaml"), has_laser);
    EXPECT_EQ(Contents(folder / "calibration.yaml").find("laser") != std::string::npos, has_laser);
  }
}

TEST(Dataset, NamesTheFolderItCannotWrite) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "file") << "in the way";
  Simulation simulation = SmallSimulation(1, 0.1);
  const Expected<DatasetCounts> counts = WriteDataset(simulation, folder.path() / "file");
  ASSERT_FALSE(counts.ok());
  EXPECT_NE(counts.error().message.find((folder.path() / "file").string()), std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
