#include "planar_vslam/io/grey_depth.h"

#include <algorithm>
#include <array>

namespace planar_vslam::io {
namespace {

constexpr int kLeast = 8, kMost = 16, kStep = 2;  // bits: sensors have 8, 10, 12, 14 or 16
// Hot pixels and lamps are not what a picture is made of: so many pixels of a thousand may lie above its range.
constexpr std::size_t kBeyond = 1;

int BitsInUse(const std::vector<std::uint16_t>& values) {
  std::array<std::size_t, kMost + 1> count{};  // by the highest bit that is set
  for (const std::uint16_t value : values) {
    ++count[value == 0 ? 0 : 32U - static_cast<unsigned>(__builtin_clz(value))];
  }
  std::size_t above = 0;
  for (int bits = kMost; bits > kLeast; bits -= kStep) {
    for (int k = 0; k < kStep; ++k) above += count[static_cast<std::size_t>(bits - k)];
    if (1000 * above > kBeyond * values.size()) return bits;
  }
  return kLeast;
}

}  // namespace

void GreyDepth::Narrow(const std::vector<std::uint16_t>& values, std::uint8_t* grey) {
  bits_ = std::max(bits_, BitsInUse(values));
  constexpr int kWhite = 255;
  for (std::size_t i = 0; i < values.size(); ++i) {
    grey[i] = static_cast<std::uint8_t>(std::min(values[i] >> (bits_ - kLeast), kWhite));
  }
}

void GreyDepth::NarrowBigEndian(const std::uint8_t* bytes, std::size_t count, std::uint8_t* grey) {
  std::vector<std::uint16_t> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<std::uint16_t>(bytes[2 * i] << 8U | bytes[2 * i + 1]);
  Narrow(values, grey);
}

}  // namespace planar_vslam::io
