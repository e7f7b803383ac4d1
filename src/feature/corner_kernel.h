#pragma once
// The FAST-9 segment test (Rosten and Drummond, ECCV 2006) and its score for rows of pixels.
//
// The contrast of a pixel is the most grey levels by which 9 neighbours in a row, of the 16 on a circle of radius 3 px,
// are all brighter than it, or all darker; 0 when neither holds. The pixel is a corner at threshold t when its contrast
// exceeds t. The largest such t, its FAST score, is the contrast less 1.
#include <cstddef>
#include <cstdint>

#include "planar_vslam/feature/instruction_set.h"

namespace planar_vslam {

constexpr int kCircleRadius = 3;    // px
constexpr int kContrastBlock = 32;  // px worked on at a time

// A stretch of one row of an image. Blocks may read beyond `end`, but not beyond column `columns` - kCircleRadius, so
// the image is at least kContrastBlock + 2 * kCircleRadius px wide; 3 rows above and below exist.
struct ContrastStretch {
  const std::uint8_t* row = nullptr;  // column 0
  std::ptrdiff_t step = 0;            // bytes from row to row
  int columns = 0;
  int begin = 0, end = 0;  // columns asked for; begin is kCircleRadius or more
};

struct CornerKernel {
  // contrast[x] becomes the contrast of each pixel of the stretch, or 0 where it is not above `threshold`. Writes the
  // first columns of the blocks with corners to `blocks`, ascending, and returns how many; the last one may overlap the
  // one before.
  int (*find_contrast)(const ContrastStretch& stretch, std::uint8_t threshold, std::uint8_t* contrast, int* blocks);
  // peaks[b] says which pixels of the block that begins at column blocks[b], bit k for pixel k, exceed the contrast of
  // all their 8 neighbours. The arguments before are the contrast of three rows, from column 0 on.
  void (*find_peaks)(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below, const int* blocks,
                     int block_count, std::uint32_t* peaks);
};

CornerKernel CornerKernelOf(InstructionSet set);

}  // namespace planar_vslam
