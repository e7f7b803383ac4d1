// The price of a loop closure to the whole navigation map: landmarks and their rays, faces, legs and posts, scans,
// grid. PLANAR_VSLAM_BENCH_MAP names a saved map (.pvm); it is laid beside itself until it has as many keyframes as
// asked for.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <string>

#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/navigation_map.h"

namespace planar_vslam {
namespace {

KeyframeId Shifted(KeyframeId id, std::uint32_t by) { return id.valid() ? KeyframeId{id.value + by} : id; }
LandmarkId Shifted(LandmarkId id, std::uint32_t by) { return id.valid() ? LandmarkId{id.value + by} : id; }

void Move(const Rigid3& T_new_old, Map* map) {
  for (const KeyframeId id : map->keyframes.Ids()) {
    Keyframe& keyframe = map->keyframes.Edit(id);
    keyframe.T_map_base = T_new_old * keyframe.T_map_base;
  }
  for (const LandmarkId id : map->landmarks.Ids()) {
    Landmark& landmark = map->landmarks.Edit(id);
    landmark.p_map = T_new_old * landmark.p_map;
  }
}

// `part`'s keyframes, as far as `count` goes, with what they see.
void Append(const Map& part, std::size_t count, Map* map) {
  const std::uint32_t keyframes = map->next_keyframe_id, landmarks = map->next_landmark_id;
  for (const auto& [id, keyframe] : part.keyframes) {
    if (map->keyframes.size() == count) break;
    Keyframe copy = keyframe;
    for (LandmarkId& landmark : copy.landmarks) landmark = Shifted(landmark, landmarks);
    if (copy.odometry_link.has_value()) copy.odometry_link->from = Shifted(copy.odometry_link->from, keyframes);
    copy.laser_links.clear();
    map->keyframes.Insert(Shifted(id, keyframes), std::move(copy));
  }
  for (const auto& [id, landmark] : part.landmarks) {
    Landmark copy = landmark;
    copy.observations.clear();
    for (Observation o : landmark.observations) {
      o.keyframe = Shifted(o.keyframe, keyframes);
      if (map->keyframes.Contains(o.keyframe)) copy.observations.push_back(o);
    }
    if (!copy.observations.empty()) map->landmarks.Insert(Shifted(id, landmarks), std::move(copy));
  }
  for (const KeyframeId id : map->keyframes.Ids()) {
    Keyframe& keyframe = map->keyframes.Edit(id);
    for (LandmarkId& landmark : keyframe.landmarks) {
      if (landmark.valid() && !map->landmarks.Contains(landmark)) landmark = LandmarkId{};
    }
  }
  map->next_keyframe_id += part.next_keyframe_id;
  map->next_landmark_id += part.next_landmark_id;
}

// Every one of the argument's number of keyframes moves by 25 cm and a degree, and what it sees with it.
void EverythingMoves(benchmark::State& state) {
  const char* path = std::getenv("PLANAR_VSLAM_BENCH_MAP");
  if (path == nullptr) return state.SkipWithError("PLANAR_VSLAM_BENCH_MAP: not set, expected a saved map");
  const Expected<SavedMap> saved = LoadMapFile(path);
  if (!saved) return state.SkipWithError(saved.error().message.c_str());
  const auto count = static_cast<std::size_t>(state.range(0));
  Map map = saved->map, part = saved->map;
  map.keyframes = {}, map.landmarks = {};
  map.next_keyframe_id = map.next_landmark_id = 0;
  while (map.keyframes.size() < count && !part.keyframes.empty()) {
    Append(part, count, &map);
    Move(Embed3(Rigid2(15.0, 0.0, 0.0)), &part);
  }
  const MapBuilderOptions options;
  NavigationMap navigation(options, LandmarkAcceptance{}, NavigationTolerance::For(options.resolution));
  navigation.Update(map, saved->camera);
  Rigid3 T_new_old = Embed3(Rigid2(0.2, -0.15, DegreesToRadians(1.0)));
  int moved = 0;
  for (auto _ : state) {
    state.PauseTiming();
    Move(T_new_old, &map);
    T_new_old = T_new_old.Inverse();
    state.ResumeTiming();
    moved = navigation.Update(map, saved->camera);
    benchmark::DoNotOptimize(navigation.builder().Grid());
  }
  std::size_t sweeps = 0;
  for (const auto& [id, keyframe] : map.keyframes) sweeps += keyframe.sweeps.size();
  state.counters["keyframes_moved"] = moved;
  state.counters["landmarks"] = static_cast<double>(map.landmarks.size());
  state.counters["sweeps"] = static_cast<double>(sweeps);
  state.counters["faces"] = static_cast<double>(navigation.builder().overhangs().size());
}
BENCHMARK(EverythingMoves)->ArgName("keyframes")->Arg(300)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace planar_vslam
