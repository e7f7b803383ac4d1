#pragma once
// A recording driven through the whole estimator, and the files that come out.
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/recording.h"
#include "planar_vslam/pipeline/estimator.h"
#include "planar_vslam/pipeline/motion_comparison.h"

namespace planar_vslam {

struct RunSettings {
  std::optional<double> rate;   // times real time, dropping frames as a live robot would; absent: no frame dropped
  std::optional<double> from;   // s after the first image: images and sweeps before are left out
  std::optional<double> until;  // s after the first image
  std::function<void(long done, long total)> progress;      // called after every image
  std::function<void(const OdometryReading&)> on_odometry;  // each reading as recorded
};

// What was known of a metric map's scale, and by which sources, as of MapScale.
struct ScaleAt {
  double driven = 0.0;  // m, by the wheels
  std::optional<ScaleMeasurement> fused, wheels, laser, floor;
};

struct RunResult {
  std::vector<FrameReport> frames;
  std::map<std::string, long> unused_input;  // by reason
  std::vector<std::string> findings;         // what contradicts what, the most harmful first (pipeline/findings.h)
  MotionAgreement motion;                    // of the frames found by sight and the wheels
  long frames_dropped = 0;                   // by the pace of `rate`
  std::string final_adjustment;              // why it failed, and the map is as it was before; empty where it did not
  std::vector<ScaleAt> scale_history;        // of some of the keyframes, evenly spread over the run
  double wall_seconds = 0.0, cpu_seconds = 0.0;
  double recorded_seconds = 0.0;  // spanned by the processed images
};

// Runs to the end, final optimisation included. An error means the recording could not be read on.
Expected<RunResult> RunSession(Recording& recording, Estimator& estimator, const RunSettings& settings);

// trajectory.txt, trajectory_live.txt, covariance_live.csv, status.csv, keyframes.txt, scale_cameras.txt (the unscaled
// cameras the scale was recovered from, where it was), map.pvm and points.pcd (where there is a map), map.pgm/.yaml/.bt
// (metric maps only), report.json, into an existing or new folder. With `deterministic` no file depends on the clock.
Expected<bool> WriteRunOutputs(const std::filesystem::path& folder, const Estimator& estimator, const RunResult& result,
                               bool deterministic);

}  // namespace planar_vslam
