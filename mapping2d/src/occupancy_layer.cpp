#include "occupancy_layer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace planar_vslam {

namespace {

// Marks looked at in one word: rays touch few of a block's cells.
constexpr std::size_t kAtOnce = sizeof(std::uint64_t);
static_assert(kBlockCells % kAtOnce == 0 && Sighting::kUnseen == 0);

bool IsUnseen(const std::uint8_t* marks) {
  std::uint64_t word = 0;
  std::memcpy(&word, marks, kAtOnce);
  return word == 0;
}

}  // namespace

double LogOdds(double probability) { return std::log(probability / (1.0 - probability)); }

std::int32_t ToUnits(double log_odds) { return static_cast<std::int32_t>(std::lround(log_odds * kUnitsPerNat)); }

OccupancyLayer::OccupancyLayer(const SensorModel& model, double clamp_min, double clamp_max)
    : min_units_(ToUnits(LogOdds(clamp_min))), max_units_(ToUnits(LogOdds(clamp_max))) {
  units_of_mark_[Sighting::kFree] = ToUnits(LogOdds(model.p_miss));
  for (int mark = Sighting::kLightestHit; mark <= Sighting::kFullHit; ++mark) {
    const double weight = Sighting::WeightOf(static_cast<std::uint8_t>(mark));
    units_of_mark_[static_cast<std::size_t>(mark)] = ToUnits(weight * LogOdds(model.p_hit));
  }
}

void OccupancyLayer::Add(const Sighting& sighting, int epoch, int times) {
  auto& [index, blocks] = epochs_[epoch];
  for (std::size_t i = 0; i < sighting.blocks().size(); ++i) {
    const std::uint32_t number = index.FindOrInsert(sighting.blocks()[i]);
    if (number == blocks.size()) blocks.emplace_back();
    const Sighting::Marks& marks = sighting.marks(i);
    Block& block = blocks[number];
    for (std::size_t first = 0; first < kBlockCells; first += kAtOnce) {
      if (IsUnseen(marks.data() + first)) continue;
      for (std::size_t cell = first; cell < first + kAtOnce; ++cell) {
        const std::int32_t units = units_of_mark_[marks[cell]];  // 0 where nothing was seen, or spared
        block[cell].sum += times * units;
        block[cell].seen += units != 0 ? times : 0;
      }
    }
  }
}

std::vector<OccupancyLayer::FoldedBlock> OccupancyLayer::Fold() const {
  std::vector<std::pair<BlockKey, const Block*>> in_order;  // of one key the earlier epoch first
  for (const auto& [number, epoch] : epochs_) {
    for (std::size_t i = 0; i < epoch.blocks.size(); ++i)
      in_order.emplace_back(epoch.index.keys()[i], &epoch.blocks[i]);
  }
  std::stable_sort(in_order.begin(), in_order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FoldedBlock> folded;
  for (const auto& [key, block] : in_order) {
    const auto seen = [](const Evidence& e) { return e.seen > 0; };
    if (std::none_of(block->begin(), block->end(), seen)) continue;  // all taken out again
    if (folded.empty() || folded.back().key != key) {
      folded.push_back({key, {}});
      folded.back().log_odds.fill(kUnknown);
    }
    for (std::size_t cell = 0; cell < kBlockCells; ++cell) {
      if (!seen((*block)[cell])) continue;
      std::int32_t& value = folded.back().log_odds[cell];
      value = std::clamp((value == kUnknown ? 0 : value) + (*block)[cell].sum, min_units_, max_units_);
    }
  }
  return folded;
}

std::size_t OccupancyLayer::MemoryBytes() const {
  std::size_t count = 0;
  for (const auto& [number, epoch] : epochs_) count += epoch.blocks.size();
  return count * (sizeof(Block) + sizeof(BlockKey) + 2 * sizeof(std::uint32_t));
}

}  // namespace planar_vslam
