#pragma once
// Seeds of independent random streams, all derived from the one seed of a simulation.
#include <cstdint>

namespace planar_vslam {

// A well-mixed 64-bit value of (seed, stream): the finaliser of Steele, Lea, Flood, "Fast splittable pseudorandom
// number generators" (OOPSLA 2014), SplitMix64.
constexpr std::uint64_t MixSeed(std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t z = seed + 0x9e3779b97f4a7c15ULL * (stream + 1);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// What a stream is for; further numbers (surface, image) are mixed in on top.
enum class RandomStream : std::uint64_t {
  kTexture = 1,
  kImageNoise = 2,
  kCameraShake = 3,
  kLaser = 4,
  kOdometry = 5,
  kSlips = 6,
  kFurniture = 7,
  kWorld = 8,
  kPeople = 9
};

constexpr std::uint64_t MixSeed(std::uint64_t seed, RandomStream stream) {
  return MixSeed(seed, static_cast<std::uint64_t>(stream));
}

}  // namespace planar_vslam
