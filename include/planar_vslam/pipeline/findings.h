#pragma once
// What contradicts what in a run, in plain words: one line each, with what mends it. A good drive has none.
#include <map>
#include <string>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/pipeline/frame_report.h"
#include "planar_vslam/pipeline/input_watch.h"

namespace planar_vslam {

constexpr std::size_t kMostFindings = 10;

struct FindingsInput {
  const EstimatorReport& report;
  const InputWatch& input;
  const Map* map = nullptr;                 // none: no map came about
  std::map<std::string, long> unused = {};  // input, by reason
  std::vector<std::string> notes = {};      // of the recording: come last
  bool has_base = true;
  bool has_laser = false;
};

// At most kMostFindings, the most harmful first.
std::vector<std::string> Findings(const FindingsInput& input);

}  // namespace planar_vslam
