#pragma once
// The landmarks of a map that a search for a place compares images with, one behind the other: those that are seen well
// enough to be looked for. A view upside down is no view of theirs, so they are also listed by how they are turned in
// the image.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

struct TableLandmark {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d view_direction = Eigen::Vector3d::Zero();  // mean, from the cameras to the point
  double min_distance = 0.0, max_distance = 0.0;             // m, from which it is detected
  std::uint32_t headings = 0;  // bit i: seen by a camera that looked within 60 degrees of heading sector i
  bool steady = false;         // looks much the same in all its images...
  bool unique = true;          // ...and nothing elsewhere in the map looks like it
};

// Landmarks one behind the other in the table that one look can pass over: landmarks of one keyframe are neighbours.
struct LandmarkGroup {
  std::size_t begin = 0, end = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0.0;         // m, of all of them around it
  double max_distance = 0.0;   // m, the largest
  std::uint32_t headings = 0;  // of any
};

class LandmarkTable {
 public:
  static constexpr std::size_t kSectors = 24;
  // Of an angle, rad.
  static std::size_t SectorOf(double angle);

  LandmarkTable() = default;
  explicit LandmarkTable(const Map& map);

  bool empty() const { return landmarks_.empty(); }
  const std::vector<TableLandmark>& landmarks() const { return landmarks_; }
  const std::vector<LandmarkGroup>& groups() const { return groups_; }
  const std::vector<Descriptor>& descriptors() const { return descriptors_; }
  // Indices of those that a keypoint of this orientation, rad, may show. Ascending.
  const std::vector<int>& TurnedLike(float angle) const;
  // Where the robot has been.
  const std::vector<Eigen::Vector2d>& driven() const { return driven_; }
  const std::vector<double>& octave_scales() const { return octave_scales_; }

 private:
  // `sectors`: how each landmark is turned.
  void FindUnique(const std::vector<std::size_t>& sectors);

  std::vector<TableLandmark> landmarks_;
  std::vector<LandmarkGroup> groups_;
  std::vector<Descriptor> descriptors_;
  std::array<std::vector<int>, kSectors> turned_like_;
  std::vector<Eigen::Vector2d> driven_;
  std::vector<double> octave_scales_;
};

}  // namespace planar_vslam
