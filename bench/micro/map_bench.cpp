// The map as a value: copying it, and the edits of mapping one keyframe. The argument is the number of keyframes; each
// has 1,000 keypoints and is the first to see 100 landmarks, which the five after it see as well.
#include <benchmark/benchmark.h>

#include <random>

#include "planar_vslam/map/map_edit.h"

namespace planar_vslam {
namespace {

constexpr std::uint32_t kKeypoints = 1000, kNewLandmarks = 100, kViews = 6;

Keyframe EmptyKeyframe(std::mt19937_64& generator, std::uint32_t number) {
  auto features = std::make_shared<FrameFeatures>();
  features->keypoints.resize(kKeypoints);
  for (std::uint32_t i = 0; i < kKeypoints; ++i) {
    features->descriptors.push_back({generator(), generator(), generator(), generator()});
  }
  Keyframe keyframe;
  keyframe.stamp = Timestamp::FromSeconds(number);
  keyframe.T_map_base = Embed3(Rigid2(0.25 * number, 0.0, 0.0));
  keyframe.features = features;
  keyframe.landmarks.resize(kKeypoints);
  return keyframe;
}

Landmark LandmarkOf(std::uint32_t keyframe, std::uint32_t keyframes, std::uint32_t number) {
  Landmark landmark;
  landmark.p_map = Eigen::Vector3d(0.25 * keyframe + 2.0, 0.01 * number, 1.0);
  for (std::uint32_t view = 0; view < kViews && keyframe + view < keyframes; ++view) {
    landmark.observations.push_back({KeyframeId{keyframe + view}, view * kNewLandmarks + number});
  }
  landmark.created_by = landmark.observations.back().keyframe;
  return landmark;
}

Map DrivenMap(std::int64_t keyframe_count) {
  const auto keyframes = static_cast<std::uint32_t>(keyframe_count);
  std::mt19937_64 generator(1);
  Map map;
  map.octave_scales = {1.0};
  MapEdit edit;
  for (std::uint32_t k = 0; k < keyframes; ++k)
    edit.emplace_back(AddKeyframe{KeyframeId{k}, EmptyKeyframe(generator, k)});
  for (std::uint32_t k = 0; k + 1 < keyframes; ++k) {
    for (std::uint32_t i = 0; i < kNewLandmarks; ++i) {
      edit.emplace_back(AddLandmark{LandmarkId{k * kNewLandmarks + i}, LandmarkOf(k, keyframes, i)});
    }
  }
  return Apply(std::move(map), edit);
}

void CopyMap(benchmark::State& state) {
  const Map map = DrivenMap(state.range(0));
  for (auto _ : state) {
    Map copy = map;
    benchmark::DoNotOptimize(copy);
  }
  state.counters["landmarks"] = static_cast<double>(map.landmarks.size());
}
BENCHMARK(CopyMap)->Arg(30)->Arg(300)->Unit(benchmark::kMicrosecond);

// The time of Apply() alone: the copy it is given is made while the clock stands still.
void ApplyTo(benchmark::State& state, const Map& map, const MapEdit& edit) {
  for (auto _ : state) {
    state.PauseTiming();
    Map copy = map;
    state.ResumeTiming();
    copy = Apply(std::move(copy), edit);
    benchmark::DoNotOptimize(copy);
    state.PauseTiming();
    copy = Map();
    state.ResumeTiming();
  }
  state.counters["steps"] = static_cast<double>(edit.size());
}

void ApplyNewKeyframe(benchmark::State& state) {
  const Map map = DrivenMap(state.range(0));
  std::mt19937_64 generator(2);
  const auto next = static_cast<std::uint32_t>(state.range(0));
  MapEdit edit{AddKeyframe{KeyframeId{next}, EmptyKeyframe(generator, next)}};
  for (std::uint32_t i = 0; i < kNewLandmarks; ++i) {
    Landmark landmark = LandmarkOf(next - 1, next, i);
    landmark.observations = {{KeyframeId{next - 1}, 900 + i}, {KeyframeId{next}, i}};
    landmark.created_by = KeyframeId{next};
    edit.emplace_back(AddLandmark{LandmarkId{next * kNewLandmarks + i}, landmark});
  }
  ApplyTo(state, map, edit);
}
BENCHMARK(ApplyNewKeyframe)->Arg(30)->Arg(300)->Unit(benchmark::kMicrosecond);

// What a local bundle adjustment gives: poses and points of the last 20 keyframes.
void ApplyAdjustment(benchmark::State& state) {
  constexpr std::int64_t kAdjusted = 20;
  const Map map = DrivenMap(state.range(0));
  const auto first = static_cast<std::uint32_t>(state.range(0) - kAdjusted);
  MapEdit edit;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (id.value >= first) edit.emplace_back(SetKeyframePose{id, keyframe.T_map_base});
  }
  for (const auto& [id, landmark] : map.landmarks) {
    if (id.value >= first * kNewLandmarks) edit.emplace_back(SetLandmarkPosition{id, landmark.p_map});
  }
  ApplyTo(state, map, edit);
}
BENCHMARK(ApplyAdjustment)->Arg(30)->Arg(300)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace planar_vslam
