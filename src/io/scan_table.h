#pragma once
// scan.csv, one sweep a line (`t,r0,r1,...`), read as it is needed: long recordings have a lot of it.
#include <filesystem>
#include <memory>
#include <optional>

#include "calibration_file.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sensor/measurements.h"
#include "skip_log.h"
#include "text_table.h"

namespace planar_vslam::io {

class ScanTable {
 public:
  static Expected<std::unique_ptr<ScanTable>> Open(const std::filesystem::path& path, const LaserGeometry& laser);

  // Reads the next usable sweep unless one is waiting; an error on a malformed line.
  std::optional<Error> Advance(SkipLog* skipped);
  // The waiting sweep; nothing at the end.
  const std::optional<PlanarScan>& current() const { return current_; }
  PlanarScan Take();

 private:
  ScanTable(TextTable table, const LaserGeometry& laser) : table_(std::move(table)), laser_(laser) {}
  Expected<std::vector<float>> Ranges() const;

  TextTable table_;
  LaserGeometry laser_;
  StampGate gate_;
  std::optional<PlanarScan> current_;
};

}  // namespace planar_vslam::io
