#pragma once
// ORB features (Rublee et al., ICCV 2011) spread evenly over the image: FAST corners on a scale pyramid, thinned by a
// quadtree, oriented by the intensity centroid, described by the rotated 256-pair BRIEF pattern of OpenCV's ORB.
#include <memory>
#include <string>
#include <vector>

#include "planar_vslam/feature/features.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct OrbOptions {
  int feature_count = 1000;    // keypoints asked for per image
  double scale_factor = 1.2;   // between pyramid levels
  int level_count = 8;         // pyramid levels
  int fast_threshold = 20;     // grey levels; cells without a corner at this threshold...
  int fast_min_threshold = 7;  // ...are searched at this one
  int cell_pixels = 30;        // side of the cells of the adaptive threshold

  std::vector<std::string> Problems() const;
  // scale_factor^octave
  std::vector<double> ScaleFactors() const;
};

// Keeps scratch memory between images, so one extractor serves one thread.
class OrbExtractor {
 public:
  OrbExtractor(const OrbOptions& options, const CameraModel& camera);
  ~OrbExtractor();
  OrbExtractor(OrbExtractor&&) noexcept;
  OrbExtractor& operator=(OrbExtractor&&) noexcept;

  // The same image gives the same bytes. Images smaller than one patch give no keypoints.
  FrameFeatures Extract(const GrayImage& image, int feature_count);
  FrameFeatures Extract(const GrayImage& image);

 private:
  struct Scratch;
  OrbOptions options_;
  CameraModel camera_;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace planar_vslam
