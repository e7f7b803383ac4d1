#pragma once
// A long drive that needs no rendering: a robot circles through rooms of 6 m by 6 m, its camera to the right, and sees
// points on their walls as keypoints with noisy pixels and descriptors, among as many that show nothing known.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/planar/odometry_noise.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

enum class Growth {
  kRooms,  // once round in each room, the rooms in a square spiral
  kLaps    // round and round in one room, half of whose points are replaced every lap: no keyframe is redundant
};
std::optional<Growth> GrowthOf(const std::string& name);  // "rooms" or "laps"

class GrowthWorld {
 public:
  static constexpr int kFramesPerKeyframe = 4;  // of the map that is given: 0.25 m or 12 degrees
  static constexpr int kFramesPerRoom = 216;    // after which all repeats, but for the corners of the spiral
  static constexpr int kKeypoints = 1000;       // of a frame

  struct View {
    FrameFeaturesPtr features;
    std::vector<std::optional<std::size_t>> points;  // by keypoint: what it shows
  };

  GrowthWorld(Growth growth, int frames);

  static CameraModel Camera();
  static Rigid3 CameraMount();  // T_base_camera
  static Timestamp StampOf(int frame) { return {100'000'000'000 + 100'000'000LL * frame}; }

  const Rigid2& PoseOf(int frame) const { return path_[static_cast<std::size_t>(frame)].T_map_base; }
  // What faultless wheels say of the way between two frames.
  std::vector<OdometryReading> Odometry(int from, int to) const;
  // The same frame gives the same view.
  View ViewOf(int frame) const;
  const Eigen::Vector3d& Point(std::size_t number) const { return points_[number].p_map; }

  // The map of a robot that has driven so far, with a keyframe every kFramesPerKeyframe frames: metric, poses true,
  // points true to millimetres, no sweeps.
  Map MapOf(int keyframes, const OdometryNoise& noise) const;

 private:
  struct Step {
    Rigid2 T_map_base;
    int first_group, last_group;  // whose points may be in view
  };
  struct WallPoint {
    Eigen::Vector3d p_map, normal;
    Descriptor descriptor;
  };

  void DriveThroughRooms(int frames);
  void DriveLaps(int frames);
  void AddWalls(const Eigen::Vector2d& center, int points_per_wall, unsigned seed);

  std::vector<Step> path_;
  std::vector<WallPoint> points_;
  std::vector<std::size_t> group_begin_{0};  // of each group in points_, and the end
};

}  // namespace planar_vslam
