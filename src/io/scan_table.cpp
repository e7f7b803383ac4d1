#include "scan_table.h"

#include <fmt/format.h>

#include "stamp_text.h"

namespace planar_vslam::io {

Expected<std::unique_ptr<ScanTable>> ScanTable::Open(const std::filesystem::path& path, const LaserGeometry& laser) {
  Expected<TextTable> table = TextTable::Open(path, Separator::kComma);
  if (!table) return table.error();
  return std::unique_ptr<ScanTable>(new ScanTable(std::move(*table), laser));
}

std::optional<Error> ScanTable::Advance(SkipLog* skipped) {
  while (!current_.has_value() && table_.NextLine()) {
    const StampText stamp = ParseStamp(table_.fields().front());
    if (stamp.kind == StampText::Kind::kMalformed) {
      return table_.ErrorHere(
          fmt::format("stamp '{}'; expected t,r0,r1,... in seconds and metres", table_.fields().front()));
    }
    Expected<std::vector<float>> ranges = Ranges();
    if (!ranges) return ranges.error();
    if (stamp.kind == StampText::Kind::kNotFinite) {
      skipped->Count("scan stamp not finite", table_.Position());
    } else if (!gate_.Accept(stamp.stamp)) {
      skipped->Count("scan stamp not increasing", table_.Position());
    } else {
      current_ = PlanarScan{stamp.stamp,      laser_.angle_min, laser_.angle_increment,
                            laser_.range_min, laser_.range_max, std::move(*ranges)};
    }
  }
  return std::nullopt;
}

Expected<std::vector<float>> ScanTable::Ranges() const {
  const auto& fields = table_.fields();
  const std::size_t count = fields.size() - 1;
  if (count == 0 || (laser_.beams.has_value() && static_cast<long>(count) != *laser_.beams)) {
    return table_.ErrorHere(fmt::format("{} ranges; expected {}", count, laser_.beams.value_or(1)));
  }
  std::vector<float> ranges;
  ranges.reserve(count);
  for (std::size_t i = 1; i < fields.size(); ++i) {
    const std::optional<double> range = ParseNumber(fields[i]);
    if (!range.has_value())
      return table_.ErrorHere(fmt::format("range {} is '{}'; expected metres or inf", i, fields[i]));
    ranges.push_back(static_cast<float>(*range));
  }
  return ranges;
}

PlanarScan ScanTable::Take() {
  PlanarScan scan = std::move(*current_);
  current_.reset();
  return scan;
}

}  // namespace planar_vslam::io
