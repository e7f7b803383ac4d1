#pragma once
// What contradicts what in a run, in plain words: one line each, with what mends it. A good drive has none.
#include <map>
#include <string>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/pipeline/frame_report.h"
#include "planar_vslam/pipeline/input_watch.h"
#include "planar_vslam/pipeline/motion_comparison.h"

namespace planar_vslam {

constexpr std::size_t kMostFindings = 10;

// How much a fault spoils: something is missing, everything is bent by it, or the map is worthless.
enum class Harm { kMissing, kBent, kWorthless };

struct Finding {
  Harm harm;
  const char*
      subject;  // one word, what it is about: "mount", "odometry", "clocks", "scale", "laser", "images", "input"
  std::string text;
};

struct FindingsInput {
  const EstimatorReport& report;
  const InputWatch& input;
  const Map* map = nullptr;                 // none: no map came about
  std::map<std::string, long> unused = {};  // input, by reason
  std::vector<std::string> notes = {};      // of the recording: come last
  bool has_base = true;
  bool has_laser = false;
  MotionAgreement motion = {};        // of the poses found by sight and the wheels as they were corrected
  bool laser_is_matched = true;       // as the configuration says
  bool starts_by_images = false;      // the same: a map begins without the wheels
  double readout = 0.0;               // s, of an image's rows, as the configuration says
  std::optional<Deviation> yaw = {};  // rad, of the camera, further to the left than said; by an adjustment of the map
  bool recorded = true;               // not a robot that runs, whose drivers start one after the other
};

// Whether there is no map, or one that held so few of the frames that it says nothing.
bool HardlyMapped(const EstimatorReport& report, const Map* map);

// All of them, the most harmful first; notes are not among them.
std::vector<Finding> FindAll(const FindingsInput& input);

// Their texts and the notes: at most kMostFindings, the most harmful first.
std::vector<std::string> Findings(const FindingsInput& input);

}  // namespace planar_vslam
