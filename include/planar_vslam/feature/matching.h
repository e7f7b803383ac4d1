#pragma once
// Descriptor matching between two images, with ratio and rotation checks.
#include <utility>
#include <vector>

#include "planar_vslam/feature/features.h"

namespace planar_vslam {

struct MatchOptions {
  int max_distance = 50;       // bits
  double ratio = 0.9;          // best must be below ratio * second best
  bool check_rotation = true;  // keep only matches in the three largest 12-degree bins of orientation change
};

struct FeatureMatch {
  int first = -1;    // keypoint index in the first image
  int second = -1;   // in the second
  int distance = 0;  // bits
};

// Each keypoint of `first` against the keypoints of `second` within `radius` px of `predicted[i]` (predicted.size() ==
// first.keypoints.size(); use the keypoints' own pixels when nothing better is known) and at most `octave_margin`
// pyramid levels apart. One-to-one: on conflict the smaller distance wins, then the smaller index.
std::vector<FeatureMatch> MatchWithinRadius(const FrameFeatures& first, const FrameFeatures& second,
                                            const std::vector<Eigen::Vector2f>& predicted, float radius,
                                            int octave_margin, const MatchOptions& options);

// All against all, restricted to the given subsets of indices. One-to-one as above.
std::vector<FeatureMatch> MatchBruteForce(const FrameFeatures& first, const std::vector<int>& first_indices,
                                          const FrameFeatures& second, const std::vector<int>& second_indices,
                                          const MatchOptions& options);

// The nearest of `database` (not empty) for each query; the smaller index on ties.
struct NearestDescriptor {
  int index = -1;
  int distance = 0;  // bits
};
std::vector<NearestDescriptor> FindNearestDescriptors(const std::vector<Descriptor>& queries,
                                                      const std::vector<Descriptor>& database);

// Drops the matches outside the three largest bins of angle(second) - angle(first). Keeps order.
void KeepConsistentRotation(const FrameFeatures& first, const FrameFeatures& second,
                            std::vector<FeatureMatch>* matches);

}  // namespace planar_vslam
