// Laser and camera of a robot that stands in a known map and does not know where: both together tell, as soon as the
// map is ready to be compared with images.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "localize/floor_plan.h"
#include "planar_vslam/pipeline/saved_place.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

using test::FloorPlan;

// Runs jobs when it is told to.
class LateExecutor final : public Executor {
 public:
  void Submit(std::function<void()> job) override { jobs_.push_back(std::move(job)); }
  void RunAll() {
    for (const auto& job : std::exchange(jobs_, {})) job();
  }

 private:
  std::vector<std::function<void()>> jobs_;
};

class PlaceFinderTest : public ::testing::Test {
 protected:
  // What the laser sees is an office around the landmarks' robot.
  PlaceFinderTest() : world_(test::MakeSyntheticWorld({})), T_map_base_(test::SyntheticPose(0.8)) {
    plan_.Add(test::Office(), T_map_office());
    for (PosedSweep sweep : test::MappedOffice()) {
      sweep.T_map_base = T_map_office() * sweep.T_map_base;
      sweeps_.push_back(sweep);
    }
  }
  Rigid2 T_map_office() const { return ProjectToPlane(T_map_base_) * Rigid2(1.0, 1.0, 0.3).Inverse(); }

  PlaceFinder Finder(Executor* executor) const {
    const auto map = std::make_shared<const Map>(world_.map);
    const SightMapFuture sights = Submit(executor, [map] { return std::make_shared<SightMap>(map); }).share();
    return {std::make_shared<const LikelihoodField>(sweeps_), false, sights, SightSearch(sights, executor)};
  }
  FramePacket Packet() const {
    FramePacket packet;
    packet.scans.push_back({plan_.Sweep(ProjectToPlane(T_map_base_)), FloorPlan::T_base_laser(), Rigid2()});
    return packet;
  }
  // By other light: one of three landmarks looks as it did.
  CameraView View() const {
    std::mt19937_64 generator(5);
    const auto seen = test::Observe(world_, T_map_base_ * world_.T_base_camera, 0.5, 1);
    auto features = std::make_shared<FrameFeatures>(*seen.features);
    for (std::size_t i = 0; i < features->descriptors.size(); ++i)
      if (i % 3 != 0) features->descriptors[i] = {generator(), generator(), generator(), generator()};
    return {features, world_.T_base_camera, world_.camera, PlanarPriorOptions{}, 1.0};
  }
  void ExpectFound(PlaceFinder* finder) const {
    const std::optional<SettledPlace> found = finder->Found();
    ASSERT_TRUE(found.has_value());
    EXPECT_TRUE(IsSamePlace(found->T_map_base, ProjectToPlane(T_map_base_)));
  }

  test::SyntheticWorld world_;
  Rigid3 T_map_base_;
  FloorPlan plan_;
  std::vector<PosedSweep> sweeps_;
};

TEST_F(PlaceFinderTest, AViewBesideTheLaserDoesNotWaitForTheMap) {
  LateExecutor executor;
  PlaceFinder finder = Finder(&executor);
  finder.Add(Packet(), Rigid2());
  ASSERT_TRUE(finder.ByLaser());
  finder.AddView(View(), {}, std::nullopt);
  EXPECT_FALSE(finder.Found().has_value()) << "the view was not looked at";
  executor.RunAll();
  finder.AddView(View(), {}, std::nullopt);
  ExpectFound(&finder);
}

// A wide lens moves keypoints little when the robot turns, and those of high octaves are placed coarsely: what it sees
// of the place itself must not count as chance.
TEST_F(PlaceFinderTest, CoarseKeypointsOfAWideLensTellThePlaceToo) {
  constexpr double kCoarsest = 3.6;  // px at octave 0: the seventh of 1.2
  world_.map.octave_scales = {kCoarsest};
  world_.camera.fx = world_.camera.fy = 300.0;
  InlineExecutor executor;
  PlaceFinder finder = Finder(&executor);
  finder.Add(Packet(), Rigid2());
  finder.AddView(View(), {}, std::nullopt);
  ExpectFound(&finder);
}

}  // namespace
}  // namespace planar_vslam
