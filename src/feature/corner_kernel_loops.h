// Included once for each vector width: PV_VECTOR_BYTES, 16 or 32, and PV_TARGET before each function.
using Pixels [[gnu::vector_size(PV_VECTOR_BYTES)]] = std::uint8_t;

PV_TARGET inline Pixels Load(const std::uint8_t* from) {
  Pixels pixels;
  std::memcpy(&pixels, from, sizeof pixels);
  return pixels;
}
PV_TARGET inline void Store(const Pixels& pixels, std::uint8_t* to) { std::memcpy(to, &pixels, sizeof pixels); }
PV_TARGET inline Pixels Min(const Pixels& a, const Pixels& b) { return a < b ? a : b; }
PV_TARGET inline Pixels Max(const Pixels& a, const Pixels& b) { return a > b ? a : b; }
// a - b, or 0 where b is larger.
PV_TARGET inline Pixels Excess(const Pixels& a, const Pixels& b) { return Max(a, b) - b; }

PV_TARGET inline bool Any(const Pixels& pixels) {
#if PV_VECTOR_BYTES == 32
  const __m256i bits = reinterpret_cast<__m256i>(pixels);
  return _mm256_testz_si256(bits, bits) == 0;
#else
  std::uint64_t words[sizeof(Pixels) / sizeof(std::uint64_t)];
  std::memcpy(words, &pixels, sizeof words);
  return (words[0] | words[1]) != 0;
#endif
}

// Of 9 neighbours in a row two at least are of the four at the ends of the axes, next to each other.
PV_TARGET inline bool MayHoldCorner(const std::uint8_t* center, std::ptrdiff_t step, const Pixels& threshold) {
  const Pixels pixel = Load(center);
  const Pixels above = Load(center - 3 * step), below = Load(center + 3 * step);
  const Pixels left = Load(center - 3), right = Load(center + 3);
  const Pixels bright = Min(Max(above, below), Max(left, right));
  const Pixels dark = Max(Min(above, below), Min(left, right));
  return Any(Excess(Max(Excess(bright, pixel), Excess(pixel, dark)), threshold));
}

PV_TARGET inline Pixels Contrast(const std::uint8_t* center, std::ptrdiff_t step) {
  std::array<Pixels, 16> circle;
  for (std::size_t k = 0; k < 16; ++k) circle[k] = Load(center + kCircleY[k] * step + kCircleX[k]);
  // Runs of 2, 4, 8 neighbours that begin at even places; each run of 8 takes one more at either end.
  std::array<Pixels, 8> least2, most2, least4, most4;
  for (std::size_t k = 0; k < 8; ++k) {
    least2[k] = Min(circle[2 * k], circle[2 * k + 1]);
    most2[k] = Max(circle[2 * k], circle[2 * k + 1]);
  }
  for (std::size_t k = 0; k < 8; ++k) {
    least4[k] = Min(least2[k], least2[(k + 1) % 8]);
    most4[k] = Max(most2[k], most2[(k + 1) % 8]);
  }
  Pixels bright{}, dark = ~Pixels{};
  for (std::size_t k = 0; k < 8; ++k) {
    const Pixels &before = circle[(2 * k + 15) % 16], &after = circle[(2 * k + 8) % 16];
    bright = Max(bright, Min(Min(least4[k], least4[(k + 2) % 8]), Max(before, after)));
    dark = Min(dark, Max(Max(most4[k], most4[(k + 2) % 8]), Min(before, after)));
  }
  const Pixels pixel = Load(center);
  return Max(Excess(bright, pixel), Excess(pixel, dark));
}

PV_TARGET int FindContrast(const ContrastStretch& stretch, std::uint8_t threshold, std::uint8_t* contrast,
                           int* blocks) {
  const Pixels thresholds = Pixels{} + threshold;
  const int last = stretch.columns - kCircleRadius - kContrastBlock;
  // First where corners may be, then whether they are: no branch depends on the image but the end of the loops.
  int candidate_count = 0;
  for (int begin = stretch.begin; begin < stretch.end; begin += kContrastBlock) {
    const int block = std::min(begin, last);
    int may_hold = 0;
    for (int x = block; x < block + kContrastBlock; x += PV_VECTOR_BYTES) {
      may_hold |= MayHoldCorner(stretch.row + x, stretch.step, thresholds) ? 1 : 0;
      Store(Pixels{}, contrast + x);
    }
    blocks[candidate_count] = block;
    candidate_count += may_hold;
  }
  int count = 0;
  for (int candidate = 0; candidate < candidate_count; ++candidate) {
    const int block = blocks[candidate];
    int holds = 0;
    for (int x = block; x < block + kContrastBlock; x += PV_VECTOR_BYTES) {
      const Pixels found = Contrast(stretch.row + x, stretch.step);
      const Pixels above = found > thresholds ? found : Pixels{};
      holds |= Any(above) ? 1 : 0;
      Store(above, contrast + x);
    }
    blocks[count] = block;
    count += holds;
  }
  return count;
}

// Bit k: truth k, which is 255 or 0.
PV_TARGET inline std::uint32_t Bits(const Pixels& truths) {
#if PV_VECTOR_BYTES == 32
  return static_cast<std::uint32_t>(_mm256_movemask_epi8(reinterpret_cast<__m256i>(truths)));
#elif defined(__x86_64__)
  return static_cast<std::uint32_t>(_mm_movemask_epi8(reinterpret_cast<__m128i>(truths)));
#else
  std::uint32_t bits = 0;
  for (int k = 0; k < PV_VECTOR_BYTES; ++k) bits |= (truths[k] != 0 ? 1U : 0U) << k;
  return bits;
#endif
}

PV_TARGET void FindPeaks(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below,
                         const int* blocks, int block_count, std::uint32_t* peaks) {
  for (int b = 0; b < block_count; ++b) {
    peaks[b] = 0;
    for (int k = 0; k < kContrastBlock; k += PV_VECTOR_BYTES) {
      const int x = blocks[b] + k;
      Pixels around = Max(Load(row + x - 1), Load(row + x + 1));
      around = Max(around, Max(Load(above + x), Max(Load(above + x - 1), Load(above + x + 1))));
      around = Max(around, Max(Load(below + x), Max(Load(below + x - 1), Load(below + x + 1))));
      const Pixels is_peak = reinterpret_cast<Pixels>(Load(row + x) > around);
      peaks[b] |= Bits(is_peak) << k;
    }
  }
}
