#pragma once
// ORB features (Rublee et al., ICCV 2011) spread evenly over the image: FAST corners on a scale pyramid, thinned by a
// quadtree, oriented by the intensity centroid, described by the rotated 256-pair BRIEF pattern of OpenCV's ORB.
#include <memory>
#include <string>
#include <vector>

#include "planar_vslam/feature/features.h"
#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct OrbOptions {
  int feature_count = 1000;
  double scale_factor = 1.2;
  int level_count = 8;
  int fast_threshold = 20;
  int fast_min_threshold = 7;
  int cell_pixels = 30;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr double kMaxScaleFactor = 2.0;  // beyond, bilinear interpolation skips pixels
    constexpr int kMaxLevels = 16;           // by then 640x480 px, at 1.2 a level, are smaller than a patch
    constexpr int kMinCellPixels = 8;        // below, the 4 px around a cell cost more than the cell
    v("feature_count", o.feature_count, unit::kNone, bound::AtLeast(1),
      "keypoints per image; twice as many until there is a map");
    v("scale_factor", o.scale_factor, unit::kNone, bound::MoreThan(1.0).And(bound::AtMost(kMaxScaleFactor)),
      "between pyramid levels");
    v("level_count", o.level_count, unit::kNone, bound::FromTo(1, kMaxLevels), "pyramid levels");
    v("fast_threshold", o.fast_threshold, unit::kNone, bound::FromTo(1, 254), "grey levels a corner stands out by...");
    v("fast_min_threshold", o.fast_min_threshold, unit::kNone,
      bound::AtLeast(1).And(bound::AtMost("fast_threshold", o.fast_threshold)),
      "...and where a cell has no such corner");
    v("cell_pixels", o.cell_pixels, unit::kPixels, bound::AtLeast(kMinCellPixels),
      "side of the cells of the adaptive threshold");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
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

  class Stages;  // internal

 private:
  OrbOptions options_;
  CameraModel camera_;
  std::unique_ptr<Stages> stages_;
};

}  // namespace planar_vslam
