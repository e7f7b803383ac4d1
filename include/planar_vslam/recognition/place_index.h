#pragma once
// Which keyframes look like an image: derived from a map, its landmarks' descriptors one behind the other.
//
// Each keypoint votes for the keyframes that see the landmark nearest to it in appearance, found by comparing it with
// all: 50,000 landmarks make 50 million comparisons of 256 bits for one image.
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

class PlaceIndex {
 public:
  // Empty.
  PlaceIndex() = default;
  // Of the landmarks `among`, all in the map, ascending.
  PlaceIndex(const Map& map, const std::vector<LandmarkId>& among);

  // Makes it one of all landmarks of `map`: the same as one newly made. What has not changed since the
  // last call is not looked at again.
  void Update(const Map& map);

  // The keyframes that look most like the image, at most `limit`, best first, ties by smaller id.
  std::vector<KeyframeId> Resembling(const FrameFeatures& features, std::size_t limit) const;

  friend bool operator==(const PlaceIndex& a, const PlaceIndex& b) {
    return a.landmarks_ == b.landmarks_ && a.descriptors_ == b.descriptors_ && a.seen_by_ == b.seen_by_;
  }

 private:
  void Append(LandmarkId id, const Landmark& landmark);
  // What entry i says of the landmark, as it is now.
  void Refresh(std::size_t i, const Landmark& landmark);
  // `gone` ascending.
  void Remove(const std::vector<LandmarkId>& gone);

  IdMap<LandmarkId, Landmark> known_;             // those of the map of the last Update()
  std::vector<LandmarkId> landmarks_;             // ascending
  std::vector<Descriptor> descriptors_;           // of each
  std::vector<std::vector<KeyframeId>> seen_by_;  // ...and the keyframes that observe it
};

}  // namespace planar_vslam
