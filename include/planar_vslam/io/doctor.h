#pragma once
// What is in a recording and what is wrong with it, before it is mapped: all of it is looked through, and its beginning
// is mapped on trial; where that fails or the wheels contradict it, once more from the images alone.
#include <functional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/recording.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam {

enum class Verdict { kOk, kLook, kBroken };

struct Checked {
  Verdict verdict;
  std::string what;  // one word: "odometry"
  std::string text;  // what it is, or what is wrong and what mends it
};

struct DoctorSettings {
  double trial = 90.0;                                  // s from the first image on that are mapped
  std::function<void(long done, long total)> progress;  // of the images of all passes
};

// `open` gives the recording from its start, and is called up to three times. An error where it cannot be read on.
Expected<std::vector<Checked>> Examine(const std::function<Expected<std::unique_ptr<Recording>>()>& open,
                                       const PipelineOptions& options, const DoctorSettings& settings);

std::string ToString(Verdict verdict);  // ok, look, broken
// A list of objects with the keys verdict, what and text.
std::string ToJson(const std::vector<Checked>& checked);

}  // namespace planar_vslam
