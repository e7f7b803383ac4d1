#pragma once
// The stages of extraction, with the instruction set they use.
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "brief_blur.h"
#include "corner_detector.h"
#include "level_resizer.h"
#include "orb_descriptor.h"
#include "planar_vslam/feature/instruction_set.h"
#include "planar_vslam/feature/orb_extractor.h"
#include "quadtree.h"

namespace planar_vslam {

// Keeps its memory from image to image.
class OrbExtractor::Stages {
 public:
  explicit Stages(InstructionSet set) : set_(set), detector_(set), orientation_(set), pattern_(set), blur_(set) {}
  FrameFeatures Extract(const cv::Mat& image, const OrbOptions& options, const CameraModel& camera, int feature_count);

 private:
  void BuildPyramid(const cv::Mat& image, const std::vector<double>& scale_factors);
  void SelectCorners(const OrbOptions& options, int feature_count);
  void Describe(std::size_t octave, const CameraModel& camera, FrameFeatures* features);

  InstructionSet set_;
  CornerDetector detector_;
  Quadtree quadtree_;
  PatchOrientation orientation_;
  BriefPattern pattern_;
  BriefBlur blur_;
  std::vector<LevelResizer> resizers_;     // of each level
  std::vector<cv::Mat> levels_;            // level 0 shares the pixels of the image
  std::vector<Corner> corners_;            // of the level at work
  std::vector<std::vector<Corner>> kept_;  // of each level
};

}  // namespace planar_vslam
