#include "level_resizer.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/check.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace planar_vslam {
namespace {

using RowTable = LevelResizer::RowTable;

constexpr float kOne = 2048.0F;  // weight 1 in fixed point
constexpr int kDroppedBits = 4;  // of the sums along rows, to fit 16 bits
constexpr int kReach = 16;       // source pixels a group reads
constexpr std::size_t kPadding = 2 * RowTable::kGroup;

// Where a pixel of the smaller image lies in the larger one: weights of `index` and of its successor.
struct Source {
  int index = 0;
  std::int16_t weight = 0, next_weight = 0;
};

Source SourceOf(int i, int source_pixels, int pixels) {
  const double scale = 1.0 / (pixels / static_cast<double>(source_pixels));
  float fraction = static_cast<float>((i + 0.5) * scale - 0.5);
  Source source;
  source.index = cvFloor(fraction);
  fraction -= static_cast<float>(source.index);
  source.weight = cv::saturate_cast<std::int16_t>((1.0F - fraction) * kOne);
  source.next_weight = cv::saturate_cast<std::int16_t>(fraction * kOne);
  return source;
}

void AlongRowPlain(const std::uint8_t* pixels, const RowTable& table, std::int16_t* sums) {
  for (std::size_t x = 0; x < table.columns(); ++x) {
    const std::uint8_t* pair = pixels + table.left[x];
    const int sum = pair[0] * table.weights[2 * x] + pair[1] * table.weights[2 * x + 1];
    sums[x] = static_cast<std::int16_t>(sum >> kDroppedBits);
  }
}

[[gnu::always_inline]] inline void AlongColumn(const std::int16_t* __restrict upper,
                                               const std::int16_t* __restrict lower, const Source& source,
                                               std::size_t columns, std::uint8_t* __restrict pixels) {
  const int weight = source.weight, next_weight = source.next_weight;
  for (std::size_t x = 0; x < columns; ++x) {
    const auto a = static_cast<std::int16_t>((upper[x] * weight) >> 16);
    const auto b = static_cast<std::int16_t>((lower[x] * next_weight) >> 16);
    pixels[x] = static_cast<std::uint8_t>((a + b + 2) >> 2);
  }
}

void AlongColumnPlain(const std::int16_t* upper, const std::int16_t* lower, const Source& source, std::size_t columns,
                      std::uint8_t* pixels) {
  AlongColumn(upper, lower, source, columns, pixels);
}

#if defined(__x86_64__)
PV_TARGET_SSE42 void AlongRowSse42(const std::uint8_t* pixels, const RowTable& table, std::int16_t* sums) {
  const auto load = [](const void* from) { return _mm_loadu_si128(static_cast<const __m128i*>(from)); };
  for (std::size_t group = 0; group < table.begin.size(); ++group) {
    const std::size_t x = group * RowTable::kGroup;
    const __m128i pairs = _mm_shuffle_epi8(load(pixels + table.begin[group]), load(&table.shuffle[2 * x]));
    const __m128i low = _mm_madd_epi16(_mm_cvtepu8_epi16(pairs), load(&table.weights[2 * x]));
    const __m128i high = _mm_madd_epi16(_mm_unpackhi_epi8(pairs, _mm_setzero_si128()), load(&table.weights[2 * x + 8]));
    const __m128i packed = _mm_packs_epi32(_mm_srai_epi32(low, kDroppedBits), _mm_srai_epi32(high, kDroppedBits));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(sums + x), packed);
  }
}

PV_TARGET_AVX2 inline __m256i SumsOfGroup(const std::uint8_t* pixels, const RowTable& table, std::size_t group) {
  const std::size_t x = 2 * group * RowTable::kGroup;
  const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(pixels + table.begin[group]));
  const __m128i shuffle = _mm_loadu_si128(reinterpret_cast<const __m128i*>(&table.shuffle[x]));
  const __m256i weights = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(&table.weights[x]));
  const __m256i pairs = _mm256_cvtepu8_epi16(_mm_shuffle_epi8(bytes, shuffle));
  return _mm256_srai_epi32(_mm256_madd_epi16(pairs, weights), kDroppedBits);
}

PV_TARGET_AVX2 void AlongRowAvx2(const std::uint8_t* pixels, const RowTable& table, std::int16_t* sums) {
  for (std::size_t group = 0; group < table.begin.size(); group += 2) {
    const __m256i packed = _mm256_packs_epi32(SumsOfGroup(pixels, table, group), SumsOfGroup(pixels, table, group + 1));
    // The packing works on halves: it leaves the quarters in the order 0 2 1 3.
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums + group * RowTable::kGroup),
                        _mm256_permute4x64_epi64(packed, 0xD8));
  }
}

PV_TARGET_AVX2 void AlongColumnAvx2(const std::int16_t* upper, const std::int16_t* lower, const Source& source,
                                    std::size_t columns, std::uint8_t* pixels) {
  AlongColumn(upper, lower, source, columns, pixels);
}
#endif

void AlongRow(InstructionSet set, const std::uint8_t* pixels, const RowTable& table, std::int16_t* sums) {
#if defined(__x86_64__)
  if (table.has_groups && set == InstructionSet::kSse42) return AlongRowSse42(pixels, table, sums);
  if (table.has_groups && set == InstructionSet::kAvx2) return AlongRowAvx2(pixels, table, sums);
#endif
  static_cast<void>(set);
  AlongRowPlain(pixels, table, sums);
}

void AlongColumn(InstructionSet set, const std::int16_t* upper, const std::int16_t* lower, const Source& source,
                 std::size_t columns, std::uint8_t* pixels) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx2) return AlongColumnAvx2(upper, lower, source, columns, pixels);
#endif
  static_cast<void>(set);
  AlongColumnPlain(upper, lower, source, columns, pixels);
}

}  // namespace

LevelResizer::RowTable::RowTable(int source_columns, int columns) {
  const std::size_t padded = (static_cast<std::size_t>(columns) + kPadding - 1) / kPadding * kPadding;
  has_groups = source_columns >= kReach;
  for (std::size_t x = 0; x < padded; ++x) {
    Source source = SourceOf(std::min(static_cast<int>(x), columns - 1), source_columns, columns);
    if (source.index < 0) source = {0, static_cast<std::int16_t>(kOne), 0};
    if (source.index > source_columns - 2) source = {source_columns - 2, 0, static_cast<std::int16_t>(kOne)};
    if (x % kGroup == 0) begin.push_back(std::max(0, std::min(source.index, source_columns - kReach)));
    left.push_back(source.index);
    weights.push_back(source.weight);
    weights.push_back(source.next_weight);
    const int first = source.index - begin.back();
    shuffle.push_back(static_cast<std::uint8_t>(first));
    shuffle.push_back(static_cast<std::uint8_t>(first + 1));
    has_groups = has_groups && first + 1 < kReach;
  }
}

const std::int16_t* LevelResizer::SumsOf(const cv::Mat& source, int row) {
  const std::size_t slot = static_cast<std::size_t>(row % 2);
  if (sums_row_[slot] != row) AlongRow(set_, source.ptr<std::uint8_t>(row), table_, sums_[slot].data());
  sums_row_[slot] = row;
  return sums_[slot].data();
}

void LevelResizer::Resize(const cv::Mat& source, const cv::Size& size, cv::Mat* resized) {
  PV_CHECK(source.cols >= 2 && size.width >= 1 && size.height >= 1 && size.width <= source.cols &&
               size.height <= source.rows,
           "from " << source.size() << " to " << size);
  if (source.size() != source_size_ || size != size_) table_ = RowTable(source.cols, size.width);
  source_size_ = source.size();
  size_ = size;
  for (std::vector<std::int16_t>& sums : sums_) sums.resize(table_.columns());
  sums_row_ = {-1, -1};
  buffer_.create(size.height, static_cast<int>(table_.columns()), CV_8UC1);
  for (int y = 0; y < size.height; ++y) {
    const Source rows = SourceOf(y, source.rows, size.height);
    const int last = source.rows - 1;
    const std::int16_t* upper = SumsOf(source, std::clamp(rows.index, 0, last));
    const std::int16_t* lower = SumsOf(source, std::clamp(rows.index + 1, 0, last));
    AlongColumn(set_, upper, lower, rows, table_.columns(), buffer_.ptr<std::uint8_t>(y));
  }
  *resized = buffer_.colRange(0, size.width);
}

}  // namespace planar_vslam
