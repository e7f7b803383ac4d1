#pragma once
// The voxels one kind of sensor has seen. Evidence is a sum of whole numbers, so that what was added can be taken out
// again and neither order nor history leaves a trace. Sums are kept per epoch (a stretch of the drive) and clamped
// when read, epoch after epoch as in OctoMap (Hornung et al. 2013, Eq. 4): a later epoch overrules an earlier one.
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "planar_vslam/mapping2d/map_builder.h"
#include "sighting.h"

namespace planar_vslam {

// log(p / (1 - p))
double LogOdds(double probability);

// Log-odds in whole numbers.
constexpr double kUnitsPerNat = 1000.0;
std::int32_t ToUnits(double log_odds);

class OccupancyLayer {
 public:
  static constexpr std::int32_t kUnknown = INT32_MIN;
  struct FoldedBlock {
    BlockKey key = 0;
    std::array<std::int32_t, kBlockCells> log_odds{};  // units; kUnknown where nothing was seen
  };

  OccupancyLayer(const SensorModel& model, double clamp_min, double clamp_max);

  // Each voxel of the sighting changes once. `times` is 1, or -1 to take out what 1 put in.
  void Add(const Sighting& sighting, int epoch, int times);
  // Takes out all that was added to the epoch.
  void RemoveEpoch(int epoch) { epochs_.erase(epoch); }
  void Clear() { epochs_.clear(); }

  // All blocks with a known voxel, by ascending key.
  std::vector<FoldedBlock> Fold() const;
  std::size_t MemoryBytes() const;

 private:
  struct Evidence {
    std::int32_t sum = 0;   // units
    std::int32_t seen = 0;  // sightings in the sum
  };
  using Block = std::array<Evidence, kBlockCells>;
  struct Epoch {
    BlockIndex index;
    std::vector<Block> blocks;
  };

  std::array<std::int32_t, 256> units_of_mark_{};
  std::int32_t min_units_, max_units_;
  std::map<int, Epoch> epochs_;
};

}  // namespace planar_vslam
