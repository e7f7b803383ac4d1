#pragma once
// 16-bit grey -> 8 bits, by the bits that a stream of images really uses.
#include <cstddef>
#include <cstdint>
#include <vector>

namespace planar_vslam::io {

// Sensors of 10 or 12 bits leave their values in the low bits of 16. One of these goes with each stream: what is taken
// for its range only grows, so that images keep their brightness against each other.
class GreyDepth {
 public:
  // Takes the highest of the bits in use for the highest of 8; what little lies above becomes white.
  void Narrow(const std::vector<std::uint16_t>& values, std::uint8_t* grey);
  // The same of values of two bytes, the high one first. `grey` may be where the bytes are.
  void NarrowBigEndian(const std::uint8_t* bytes, std::size_t count, std::uint8_t* grey);

 private:
  int bits_ = 8;
};

}  // namespace planar_vslam::io
