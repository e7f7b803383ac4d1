#include "planar_vslam/feature/matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "planar_vslam/feature/hamming.h"
#include "planar_vslam/geometry/check.h"

namespace planar_vslam {
namespace {

constexpr int kRotationBins = 30;  // of 12 degrees each
constexpr int kKeptRotationBins = 3;
constexpr int kNoDistance = 257;  // bits; more than two descriptors can differ by

// The nearest of some candidates, ties to the smaller index, and how far the next one is.
struct NearestTwo {
  int index = -1;
  int distance = kNoDistance;
  int second_distance = kNoDistance;

  void Offer(int candidate, int candidate_distance) {
    if (candidate_distance < distance || (candidate_distance == distance && candidate < index)) {
      second_distance = distance;
      distance = candidate_distance;
      index = candidate;
    } else if (candidate_distance < second_distance) {
      second_distance = candidate_distance;
    }
  }

  bool Accepted(const MatchOptions& options) const {
    return index >= 0 && distance <= options.max_distance &&
           static_cast<double>(distance) < options.ratio * static_cast<double>(second_distance);
  }
};

// `distances` is scratch.
NearestTwo FindNearest(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                       const std::vector<int>& candidates, std::vector<int>* distances) {
  HammingDistances(query, descriptors, candidates, distances);
  NearestTwo nearest;
  for (std::size_t k = 0; k < candidates.size(); ++k) nearest.Offer(candidates[k], (*distances)[k]);
  return nearest;
}

// Matches in the order they were found -> at most one for each keypoint of `second`, in the same order.
std::vector<FeatureMatch> KeepOneToOne(const std::vector<FeatureMatch>& matches, std::size_t second_count) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> owner(second_count, kNone);
  const auto wins = [](const FeatureMatch& a, const FeatureMatch& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.first < b.first;
  };
  for (std::size_t m = 0; m < matches.size(); ++m) {
    std::size_t& current = owner[static_cast<std::size_t>(matches[m].second)];
    if (current == kNone || wins(matches[m], matches[current])) current = m;
  }
  std::vector<FeatureMatch> kept;
  kept.reserve(matches.size());
  for (std::size_t m = 0; m < matches.size(); ++m) {
    if (owner[static_cast<std::size_t>(matches[m].second)] == m) kept.push_back(matches[m]);
  }
  return kept;
}

std::vector<FeatureMatch> Finish(const FrameFeatures& first, const FrameFeatures& second,
                                 const std::vector<FeatureMatch>& found, const MatchOptions& options) {
  std::vector<FeatureMatch> matches = KeepOneToOne(found, second.keypoints.size());
  if (options.check_rotation) KeepConsistentRotation(first, second, &matches);
  return matches;
}

int RotationBin(const FrameFeatures& first, const FrameFeatures& second, const FeatureMatch& match) {
  constexpr double kBinsPerRadian = kRotationBins / (2.0 * M_PI);
  const double change = static_cast<double>(second.keypoints[static_cast<std::size_t>(match.second)].angle) -
                        static_cast<double>(first.keypoints[static_cast<std::size_t>(match.first)].angle);
  // Bins are centred on multiples of 12 degrees: the most common change, none, does not fall on a boundary.
  const int bin = static_cast<int>(std::lround(change * kBinsPerRadian)) % kRotationBins;
  return bin < 0 ? bin + kRotationBins : bin;
}

}  // namespace

std::vector<FeatureMatch> MatchWithinRadius(const FrameFeatures& first, const FrameFeatures& second,
                                            const std::vector<Eigen::Vector2f>& predicted, float radius,
                                            int octave_margin, const MatchOptions& options) {
  PV_CHECK(predicted.size() == first.keypoints.size(),
           "predicted=" << predicted.size() << " keypoints=" << first.keypoints.size());
  std::vector<FeatureMatch> found;
  std::vector<int> candidates, distances;
  for (std::size_t i = 0; i < first.keypoints.size(); ++i) {
    const int octave = first.keypoints[i].octave;
    candidates.clear();
    second.grid.Search(second.keypoints, predicted[i], radius, octave - octave_margin, octave + octave_margin,
                       &candidates);
    const NearestTwo nearest = FindNearest(first.descriptors[i], second.descriptors, candidates, &distances);
    if (nearest.Accepted(options)) found.push_back({static_cast<int>(i), nearest.index, nearest.distance});
  }
  return Finish(first, second, found, options);
}

std::vector<FeatureMatch> MatchBruteForce(const FrameFeatures& first, const std::vector<int>& first_indices,
                                          const FrameFeatures& second, const std::vector<int>& second_indices,
                                          const MatchOptions& options) {
  std::vector<FeatureMatch> found;
  std::vector<int> distances;
  for (const int i : first_indices) {
    const Descriptor& descriptor = first.descriptors[static_cast<std::size_t>(i)];
    const NearestTwo nearest = FindNearest(descriptor, second.descriptors, second_indices, &distances);
    if (nearest.Accepted(options)) found.push_back({i, nearest.index, nearest.distance});
  }
  return Finish(first, second, found, options);
}

std::vector<NearestDescriptor> FindNearestDescriptors(const std::vector<Descriptor>& queries,
                                                      const std::vector<Descriptor>& database) {
  PV_CHECK(!database.empty(), "nothing to find");
  std::vector<NearestDescriptor> nearest;
  nearest.reserve(queries.size());
  for (const Descriptor& query : queries) {
    const auto [index, distance] = NearestByHamming(query, database);
    nearest.push_back({index, distance});
  }
  return nearest;
}

void KeepConsistentRotation(const FrameFeatures& first, const FrameFeatures& second,
                            std::vector<FeatureMatch>* matches) {
  std::array<int, kRotationBins> count{};
  for (const FeatureMatch& match : *matches) ++count[static_cast<std::size_t>(RotationBin(first, second, match))];

  std::array<std::size_t, kRotationBins> by_count;
  std::iota(by_count.begin(), by_count.end(), std::size_t{0});
  std::stable_sort(by_count.begin(), by_count.end(), [&](std::size_t a, std::size_t b) { return count[a] > count[b]; });
  std::array<bool, kRotationBins> kept{};
  for (std::size_t k = 0; k < kKeptRotationBins; ++k) kept[by_count[k]] = true;

  const auto is_outside = [&](const FeatureMatch& match) {
    return !kept[static_cast<std::size_t>(RotationBin(first, second, match))];
  };
  matches->erase(std::remove_if(matches->begin(), matches->end(), is_outside), matches->end());
}

}  // namespace planar_vslam
